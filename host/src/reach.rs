//! Reaches a robot on a serial line: the one that was named, or the one that answers among all ports.

use crate::cli::Address;
use crate::failure::Failure;
use hil_sim::link::serial::{Port, PortKind, RADIO_BAUD, USB_BAUD, ports, ports_in_words};
use hil_sim::link::{Direction, Identity, Line, Link, LinkError, Serial, hello};
use protocol::FrameError;
use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

/// Opens the port and makes sure that a robot of this build is at its end.
///
/// # Errors
/// A port that cannot be opened; something that is no robot, or one of another version.
pub fn reach(address: &Address) -> Result<(Line<Serial>, Identity), Failure> {
    let (port, baud) = (&address.port, address.baud());
    let mut line = Line::new(Serial::open(port, baud).map_err(Failure::bad)?);
    match greet(&mut line, port) {
        Ok(identity) => Ok((line, identity)),
        Err(Nobody::Unheard(garbage)) => Err(Failure::bad(no_robot(port, &[(baud, garbage)]))),
        Err(Nobody::Stranger(why) | Nobody::Foreign(why)) => Err(Failure::bad(why)),
    }
}

/// Who is there instead of a robot that can be talked to.
enum Nobody {
    /// None that speaks at this speed; what was wrong with what was heard, if anything was.
    Unheard(Option<FrameError>),
    /// None that speaks at any speed; a sentence for people.
    Stranger(String),
    /// A robot of another version, with whom nothing can be said; a sentence for people.
    Foreign(String),
}

/// Asks who is at the end of the line on this port.
fn greet(line: &mut Line<Serial>, port: &str) -> Result<Identity, Nobody> {
    let error = match hello(line) {
        Ok(identity) => return Ok(identity),
        Err(error) => error,
    };
    if echoes(line) {
        return Err(Nobody::Stranger(format!(
            "what is on {port} sends back what it is sent: it is a loopback plug or something else that echoes, no robot"
        )));
    }
    Err(match error {
        LinkError::NoAnswer => Nobody::Unheard(None),
        LinkError::Garbled(why) => Nobody::Unheard(Some(why)),
        // It says itself which port it was.
        LinkError::Broken(why) => Nobody::Stranger(why),
        LinkError::Version { .. } | LinkError::Schema { .. } => Nobody::Foreign(format!("{port}: {error}")),
        error => Nobody::Stranger(format!("{port}: {error}")),
    })
}

/// Whether the last thing that was sent has come back.
fn echoes(line: &mut Line<Serial>) -> bool {
    let (mut sent, mut came_back) = (Vec::new(), false);
    line.drain_frames(&mut |direction, bytes| match direction {
        Direction::ToRobot => sent = bytes.to_vec(),
        Direction::ToHost => came_back |= bytes == sent,
    });
    came_back
}

/// Why what is on a port is not taken for a robot, after it was asked at these speeds.
fn no_robot(port: &str, asked: &[(u32, Option<FrameError>)]) -> String {
    let bauds = asked.iter().map(|(baud, _)| baud.to_string()).collect::<Vec<_>>().join(" or ");
    let what = match asked.iter().find_map(|&(baud, garbage)| Some((baud, garbage?))) {
        None => format!("nothing on {port} answers as a barrel's robot does at {bauds} baud"),
        Some((baud, why)) => {
            format!("what is on {port} does not answer as a barrel's robot does at {bauds} baud (at {baud}: {why})")
        }
    };
    // What has been tried is not advised.
    let write = if asked.len() > 1 { String::new() } else { format!(" (write {port}@{RADIO_BAUD})") };
    format!(
        "{what}: is the board powered and does it run the barrel's firmware (docs/flashing.md)? The board on USB talks at \
         {USB_BAUD} baud, its radio at {RADIO_BAUD}{write}; {}",
        ports_in_words()
    )
}

/// How long an answer of an unknown device is waited for, each time that it is asked.
const GLANCE: Duration = Duration::from_millis(25);
/// A device on USB that is no robot is left alone for so long, and then for good: opening its port may reset it, and its owner
/// does not want to hear from us.
const MANNERS: [Duration; 2] = [Duration::from_secs(5), Duration::from_secs(60)];

/// A robot that was found.
#[derive(Debug)]
pub struct Found {
    /// The way to it.
    pub line: Line<Serial>,
    /// Who it is.
    pub identity: Identity,
    /// Where it is.
    pub address: Address,
}

/// Looks for a robot, again and again.
pub struct Finder {
    /// Where to look; anywhere without it.
    named: Option<Address>,
    /// The ports that there are.
    ports: Box<dyn Fn() -> Vec<Port>>,
    /// Devices that were asked and are no robots.
    strangers: BTreeMap<String, Stranger>,
    /// Where a robot was: it may come back.
    known: BTreeSet<String>,
}

/// A device that was asked and is no robot.
#[derive(Default)]
struct Stranger {
    why: String,
    /// How often it was asked.
    asked: usize,
    /// When it is asked again, if ever.
    again: Option<Instant>,
}

impl Finder {
    /// Looks at this address only, or on every port on USB.
    pub fn new(named: Option<Address>) -> Self {
        Finder { named, ..Finder::among(ports) }
    }

    /// Looks on these ports, those on USB among them.
    pub fn among(ports: impl Fn() -> Vec<Port> + 'static) -> Self {
        Finder { named: None, ports: Box::new(ports), strangers: BTreeMap::new(), known: BTreeSet::new() }
    }

    /// Looks once; it is `now`.
    ///
    /// # Errors
    /// Nobody is there: why, one sentence for each port. What is so with a port is said in the same words at each look.
    pub fn look(&mut self, now: Instant) -> Result<Found, Vec<String>> {
        if let Some(named) = &self.named {
            return try_port(&named.port, named.baud).map_err(|missed| vec![missed.why()]);
        }
        let candidates: Vec<_> = (self.ports)().into_iter().filter(|port| port.kind != PortKind::Other).collect();
        // What was pulled out and is plugged in again is looked at anew.
        let is_there = |name: &str| candidates.iter().any(|port| port.name == name);
        self.strangers.retain(|name, _| is_there(name));
        self.known.retain(|name| is_there(name));
        let mut nobody = Vec::new();
        for port in candidates {
            let stranger = self.strangers.get(&port.name);
            if let Some(stranger) = stranger.filter(|stranger| stranger.again.is_none_or(|again| now < again)) {
                nobody.push(stranger.why.clone());
                continue;
            }
            match try_port(&port.name, None) {
                Ok(found) => return Ok(found),
                // On the board's own probe, and where a robot was, one is waited for.
                Err(Missed::Stranger(why) | Missed::Foreign(why))
                    if port.kind != PortKind::DebugProbe && !self.known.contains(&port.name) =>
                {
                    nobody.push(self.note(port.name, why, now));
                }
                Err(missed) => nobody.push(missed.why()),
            }
        }
        if nobody.is_empty() {
            nobody.push(format!("no robot: {}", ports_in_words()));
        }
        Err(nobody)
    }

    /// The robot is no longer there: the next look is at its port, too.
    pub fn lost(&mut self, found: &Address) {
        self.strangers.remove(&found.port);
        self.known.insert(found.port.clone());
    }

    /// Notes that this port's device is no robot, for this reason, and returns what there is to say of it.
    fn note(&mut self, port: String, why: String, now: Instant) -> String {
        let stranger = self.strangers.entry(port).or_default();
        stranger.again = MANNERS.get(stranger.asked).map(|&manners| now + manners);
        stranger.asked += 1;
        stranger.why = match stranger.again {
            Some(_) => why,
            None => format!("{why}; it is left alone until it is plugged in again"),
        };
        stranger.why.clone()
    }
}

/// Why there is no robot on a port; a sentence for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Missed {
    /// The port could not be used: nobody was asked.
    Unasked(String),
    /// It was asked, and is no robot.
    Stranger(String),
    /// A robot of another version, with whom nothing can be said.
    Foreign(String),
}

impl Missed {
    /// The sentence.
    pub fn why(self) -> String {
        match self {
            Missed::Unasked(why) | Missed::Stranger(why) | Missed::Foreign(why) => why,
        }
    }
}

/// Asks once who is on a port: at this speed, or at those that a robot may have.
///
/// # Errors
/// Nobody who can be talked to.
pub fn try_port(port: &str, baud: Option<u32>) -> Result<Found, Missed> {
    let unasked = |error: LinkError| Missed::Unasked(error.to_string());
    let bauds = baud.map_or(vec![USB_BAUD, RADIO_BAUD], |baud| vec![baud]);
    let mut asked = Vec::new();
    for baud in bauds {
        let mut serial = Serial::open(port, baud).map_err(unasked)?;
        serial.set_patience(GLANCE).map_err(unasked)?;
        let mut line = Line::new(serial);
        match greet(&mut line, port) {
            Ok(identity) => {
                let address = Address { port: port.to_owned(), baud: Some(baud) };
                return Ok(Found { line, identity, address });
            }
            Err(Nobody::Unheard(garbage)) => asked.push((baud, garbage)),
            Err(Nobody::Stranger(why)) => return Err(Missed::Stranger(why)),
            Err(Nobody::Foreign(why)) => return Err(Missed::Foreign(why)),
        }
    }
    Err(Missed::Stranger(no_robot(port, &asked)))
}
