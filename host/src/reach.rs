//! Reaches a robot on a serial line: the one that was named, or the one that answers among all ports.

use crate::cli::Address;
use crate::failure::Failure;
use hil_sim::link::serial::{PortKind, RADIO_BAUD, USB_BAUD, ports, ports_in_words};
use hil_sim::link::{Identity, Line, LinkError, Serial, hello};
use std::collections::BTreeMap;
use std::time::Duration;

/// Opens the port and makes sure that a robot of this build is at its end.
///
/// # Errors
/// A port that cannot be opened; something that is no robot, or one of another version.
pub fn reach(address: &Address) -> Result<(Line<Serial>, Identity), Failure> {
    let mut line = Line::new(Serial::open(&address.port, address.baud()).map_err(Failure::bad)?);
    let identity = hello(&mut line).map_err(|error| Failure::bad(no_robot(&address.port, address.baud(), &error)))?;
    Ok((line, identity))
}

/// Why what is on a port is not taken for a robot.
fn no_robot(port: &str, baud: u32, error: &LinkError) -> String {
    let what = match error {
        LinkError::NoAnswer => format!("nothing on {port} answers as a barrel's robot does at {baud} baud"),
        LinkError::Garbled(why) => {
            format!("what is on {port} answers at {baud} baud, but not as this robot does ({why})")
        }
        // Another version, or a port that is gone: the sentence says it all.
        _ => return error.to_string(),
    };
    format!(
        "{what}: is the board powered and does it run the barrel's firmware (docs/flashing.md)? The board on USB talks at \
         {USB_BAUD} baud, its radio at {RADIO_BAUD} (write {port}@{RADIO_BAUD}); {}",
        ports_in_words()
    )
}

/// How long the first answer of an unknown device is waited for; a few times that in all.
const GLANCE: Duration = Duration::from_millis(25);
/// A device on USB that did not answer as a robot is left alone for so many looks: it may be something else, whose owner
/// does not want to hear from us.
const MANNERS: u32 = 10;

/// A robot that was found.
pub struct Found {
    /// The way to it.
    pub line: Line<Serial>,
    /// Who it is.
    pub identity: Identity,
    /// Where it is.
    pub address: Address,
}

/// Looks for a robot, again and again.
#[derive(Debug, Default)]
pub struct Finder {
    /// Where to look; anywhere without it.
    named: Option<Address>,
    /// Devices that did not answer, and for how many looks they are left alone.
    strangers: BTreeMap<String, u32>,
}

impl Finder {
    /// Looks at this address only, or on every port on USB.
    pub fn new(named: Option<Address>) -> Self {
        Finder { named, strangers: BTreeMap::new() }
    }

    /// Looks once.
    ///
    /// # Errors
    /// Nobody is there: why, one sentence for each port that was looked at.
    pub fn look(&mut self) -> Result<Found, Vec<String>> {
        if let Some(named) = &self.named {
            return try_port(&named.port, named.baud).map_err(|why| vec![why]);
        }
        let candidates: Vec<_> = ports().into_iter().filter(|port| port.kind != PortKind::Other).collect();
        // What was pulled out and is plugged in again is looked at anew.
        self.strangers.retain(|name, _| candidates.iter().any(|port| port.name == *name));
        let mut nobody = Vec::new();
        for port in candidates {
            if let Some(looks) = self.strangers.get_mut(&port.name).filter(|looks| **looks > 0) {
                *looks -= 1;
                nobody.push(format!("{} did not answer as a robot", port.name));
                continue;
            }
            match try_port(&port.name, None) {
                Ok(found) => return Ok(found),
                Err(why) => nobody.push(why),
            }
            if port.kind != PortKind::DebugProbe {
                self.strangers.insert(port.name, MANNERS);
            }
        }
        if nobody.is_empty() {
            nobody.push(format!("no robot: {}", ports_in_words()));
        }
        Err(nobody)
    }

    /// The next look is at the port where the robot was, too.
    pub fn lost(&mut self, found: &Address) {
        self.strangers.remove(&found.port);
    }
}

/// Asks who is there, at the speeds that a robot may have.
fn try_port(port: &str, baud: Option<u32>) -> Result<Found, String> {
    let bauds = baud.map_or(vec![USB_BAUD, RADIO_BAUD], |baud| vec![baud]);
    let mut why = String::new();
    for baud in bauds {
        let mut serial = Serial::open(port, baud).map_err(|error| error.to_string())?;
        serial.set_patience(GLANCE).map_err(|error| error.to_string())?;
        let mut line = Line::new(serial);
        match hello(&mut line) {
            Ok(identity) => {
                let address = Address { port: port.to_owned(), baud: Some(baud) };
                return Ok(Found { line, identity, address });
            }
            // A robot, but not one that can be talked to at any speed.
            Err(error @ (LinkError::Version { .. } | LinkError::Schema { .. })) => {
                return Err(format!("{port}: {error}"));
            }
            Err(error) => why = no_robot(port, baud, &error),
        }
    }
    Err(why)
}
