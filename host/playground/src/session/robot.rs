//! A real robot on a serial line, as it stands there: it is listened to, talked to, and, when its line is lost, looked for.

use super::{Asked, LinkState, Port};
use crate::channel::{Frame, Id as Channel};
use crate::order::{Order, Start};
use barrel::cli::{Address, SetupArgs};
use barrel::console::{Action, Command, Target, parse};
use barrel::failure::Failure;
use barrel::journal::{Journal, parameters};
use barrel::reach::{Found, Missed, try_port};
use barrel::recorder::Places;
use barrel::session::{Attached, Audience};
use barrel::words;
use hil_sim::link::{Link, LinkError, Serial, hello};
use hil_sim::record::BrainRecord;
use hil_sim::setup::{BodyKind, Setup};
use hil_sim::world::robot_parameters;
use protocol::parameter::Scope;
use protocol::{HostMessage, Id, RobotMessage};
use std::time::{Duration, Instant};

/// Time between two looks for a robot that is not there.
const LOOK: Duration = Duration::from_millis(500);
/// Time between two looks at the orders while there is no robot.
const MOMENT: Duration = Duration::from_millis(20);
/// A robot that has said nothing for so long lags, and after this it is asked.
const LATE: Duration = Duration::from_millis(300);
const SILENT: Duration = Duration::from_secs(1);

/// Watches the robot on this port until the window is gone.
pub(super) fn watch(args: &SetupArgs, address: &Address, mut port: Port) {
    // It is a body that one can build, whatever was asked for, and its parameters are its own.
    let start = Start { body: BodyKind::Tabletop, sets: Vec::new(), ..Start::from(args) };
    port.publish(|status| {
        status.start = Some(start);
        status.link = LinkState::Connecting(format!("looking for the robot on {address}"));
    });
    let mut watch = Watch { port, address, robot: None, stop_wanted: false };
    let ended = watch.go_on();
    let Watch { mut port, robot, .. } = watch;
    let finished = robot.map_or(Ok(None), Attached::finish);
    if let Ok(Some(log)) = &finished {
        port.say(&format!("written: {}", log.display()));
    }
    if let Err(failure) = ended.and(finished.map(drop)) {
        // The disk, mostly: the robot is autonomous, and its window says why it sees no more.
        port.complain(&failure.to_string());
        port.publish(|status| status.link = LinkState::Over(failure.to_string()));
        while !matches!(port.wait(Duration::from_millis(100)), Asked::Gone) {
            port.publish(|_| {});
        }
    }
}

/// Why a robot is no longer listened to.
enum Left {
    /// The window is gone.
    Window,
    /// The robot is gone; a sentence.
    Robot(String),
}

struct Watch<'a> {
    port: Port,
    address: &'a Address,
    /// The robot, once it was found.
    robot: Option<Attached<Serial>>,
    /// Somebody pressed the emergency stop while the line was lost.
    stop_wanted: bool,
}

impl Watch<'_> {
    fn go_on(&mut self) -> Result<(), Failure> {
        loop {
            match try_port(&self.address.port, self.address.baud) {
                Ok(found) => match self.attend(found)? {
                    Left::Window => return Ok(()),
                    Left::Robot(why) => {
                        self.port.say(&format!("{why}; looking for the robot"));
                        self.lost(why);
                        if let Some(robot) = &mut self.robot {
                            robot.journal_mut().event("gone", "the robot's line is lost")?;
                            robot.journal_mut().flush()?;
                        }
                    }
                },
                Err(Missed::Foreign(why)) => {
                    self.port.publish(|status| {
                        status.link = LinkState::Refused(why);
                        status.state = None;
                    });
                }
                Err(missed) => self.lost(missed.why()),
            }
            if self.rest() {
                return Ok(());
            }
        }
    }

    /// Says that the robot is not there.
    fn lost(&mut self, why: String) {
        let was_there = self.robot.is_some();
        self.port.publish(|status| {
            status.link = if was_there { LinkState::Lost(why) } else { LinkState::Connecting(why) };
            status.state = None;
        });
    }

    /// Waits until the next look; whether the window is gone.
    fn rest(&mut self) -> bool {
        let until = Instant::now() + LOOK;
        while Instant::now() < until {
            match self.port.wait(MOMENT) {
                Asked::Gone => return true,
                Asked::Nothing => self.port.publish(|_| {}),
                Asked::Order(Order::Line(line)) => {
                    self.port.typed(&line);
                    match parse(&line) {
                        Ok(Command::Act(Action::Stop)) => {
                            self.stop_wanted = true;
                            self.port.complain("the robot is not there: it is stopped as soon as it is found");
                        }
                        Ok(_) => self.port.complain("the robot is not there"),
                        Err(error) => self.port.complain(&error.to_string()),
                    }
                }
                Asked::Order(_) => self.port.complain("the robot is not there"),
            }
        }
        false
    }

    /// Listens to a robot that was found, and talks to it, until it is gone.
    fn attend(&mut self, found: Found) -> Result<Left, Failure> {
        let Found { mut line, identity, address } = found;
        if self.stop_wanted && line.request(&HostMessage::EmergencyStop).is_ok() {
            self.stop_wanted = false;
            self.port.say("stopped");
        }
        // It was asked at a glance who it is; what it is told may take as long as its line needs.
        if let Err(error) = line.transport_mut().be_patient() {
            return Ok(Left::Robot(error.to_string()));
        }
        // Why it last started is said; in the bar stands what does not change.
        let who = words::identity(&identity);
        let (said, who) = (who.join("; "), who.into_iter().next().unwrap_or_default());
        let again = if self.robot.is_some() { " again" } else { "" };
        self.port.say(&format!("found the robot on {address}{again}: {said}"));
        let values = match parameters(&mut line) {
            Ok(values) => values,
            Err(error) => return Ok(Left::Robot(error.to_string())),
        };
        let is_new = self.robot.is_none();
        let mut robot = match self.robot.take() {
            Some(mut robot) => {
                robot.reconnect(line, &identity);
                robot
            }
            None => {
                let mut journal = Journal::new();
                journal.connected(&line, &identity);
                match Places::log_folder("play-robot") {
                    Ok(places) => {
                        let (command, link) =
                            (format!("barrel play --link serial:{address}"), format!("serial:{address}"));
                        journal.begin_log(&places, &command, &link, &identity, &values)?;
                        self.port.publish(|status| status.log = places.log);
                    }
                    Err(failure) => self.port.complain(&format!("not recorded: {failure}")),
                }
                Attached::new(line, journal)
            }
        };
        robot.journal_mut().event("connected", &said)?;
        self.port.publish(|status| {
            status.session += u64::from(is_new);
            status.link = LinkState::Live;
            status.state = Some(identity.state);
            status.values = Some(values);
            status.who = who;
            status.revision += 1;
        });
        let left = self.listen(&mut robot);
        self.robot = Some(robot);
        left
    }

    fn listen(&mut self, robot: &mut Attached<Serial>) -> Result<Left, Failure> {
        if let Err(failure) = robot.own_sensors(&mut self.port) {
            return Ok(Left::Robot(failure.to_string()));
        }
        let mut heard = Instant::now();
        let mut asked = Instant::now();
        loop {
            loop {
                match self.port.wait(Duration::ZERO) {
                    Asked::Order(order) => self.carry_out(order, robot)?,
                    Asked::Nothing => break,
                    Asked::Gone => return Ok(Left::Window),
                }
            }
            match robot.turn(&mut self.port) {
                Ok(true) => heard = Instant::now(),
                Ok(false) => {}
                // What is wrong with the line is the robot's loss, with the log everybody's.
                Err(failure) => match glance(robot) {
                    Ok(()) => return Err(failure),
                    Err(_) => return Ok(Left::Robot(failure.to_string())),
                },
            }
            let quiet = heard.elapsed();
            let mut link = match quiet {
                quiet if quiet > LATE => {
                    LinkState::Lagging(format!("nothing was heard of the robot for {:.1} s", quiet.as_secs_f64()))
                }
                _ => LinkState::Live,
            };
            if quiet > SILENT && asked.elapsed() > SILENT {
                asked = Instant::now();
                match glance(robot) {
                    Ok(()) => {}
                    Err(LinkError::Broken(why)) => return Ok(Left::Robot(why)),
                    Err(error) => link = LinkState::Lost(error.to_string()),
                }
            } else if quiet > SILENT {
                link = super::lock(&self.port.desk).status.link.clone();
            }
            let (state, homing, vitals) = (robot.state(), robot.is_homing(), robot.journal().vitals().copied());
            self.port.publish(|status| {
                status.link = link;
                status.state = state.or(status.state);
                status.homing = homing;
                status.vitals = vitals;
            });
        }
    }

    fn carry_out(&mut self, order: Order, robot: &mut Attached<Serial>) -> Result<(), Failure> {
        match order {
            Order::Line(line) => {
                self.port.typed(&line);
                let command = parse(&line);
                let sets = matches!(command, Ok(Command::Load(_) | Command::Set(..) | Command::Act(Action::Forget)));
                robot.offer(command, true, &mut self.port)?;
                if sets {
                    self.read_parameters(robot);
                }
                Ok(())
            }
            Order::Set(id, value) => {
                match robot.set(id, value) {
                    Ok(held) => self.hold(id, held),
                    Err(why) => self.port.complain(&format!("{}: {why}", id.name())),
                }
                Ok(())
            }
            Order::Hand(_) => Ok(()),
            Order::Start(start) => self.begin(&start, robot),
        }
    }

    /// Gives a robot an experiment's parameters, and starts its brain afresh. Its mechanics stay its own.
    fn begin(&mut self, start: &Start, robot: &mut Attached<Serial>) -> Result<(), Failure> {
        let mut setup = Setup::new(start.experiment, BodyKind::Tabletop);
        for &(id, value) in &start.sets {
            setup.set(id, value).map_err(Failure::bad)?;
        }
        for id in robot_parameters()
            .filter(|id| matches!(id.parameter().scope, Scope::Brain | Scope::Stimulus | Scope::Sensor))
        {
            if let Err(why) = robot.set(id, setup.values.get(id)) {
                self.port.complain(&format!("{}: {why}", id.name()));
                return Ok(());
            }
        }
        let said = match robot.line_mut().request(&HostMessage::Restart { seed: start.seed }) {
            Ok(_) => format!("{} from now on, seed {}", start.experiment.name, start.seed),
            Err(error) => error.to_string(),
        };
        self.port.say(&said);
        robot.journal_mut().event("experiment", &said)?;
        self.port.publish(|status| status.start = Some(start.clone()));
        self.read_parameters(robot);
        Ok(())
    }

    /// Notes that the robot holds this value now.
    fn hold(&mut self, id: Id, value: f64) {
        self.port.publish(|status| {
            if let Some(values) = &mut status.values {
                values.set(id, value);
            }
            status.revision += 1;
        });
    }

    fn read_parameters(&mut self, robot: &mut Attached<Serial>) {
        match parameters(robot.line_mut()) {
            Ok(values) => self.port.publish(|status| {
                status.values = Some(values);
                status.revision += 1;
            }),
            Err(error) => self.port.complain(&error.to_string()),
        }
    }
}

/// Asks whether the robot is there, without long waits: orders are waiting, too.
fn glance(robot: &mut Attached<Serial>) -> Result<(), LinkError> {
    let line = robot.line_mut();
    line.transport_mut().set_patience(MOMENT)?;
    let there = hello(line);
    line.transport_mut().be_patient()?;
    there.map(drop)
}

/// Takes what a robot says by itself.
pub(super) fn heard(port: &mut Port, t: f64, message: &RobotMessage) {
    match message {
        RobotMessage::Telemetry(telemetry) => {
            let mut frame = Frame::at(t);
            frame.set_brain(&BrainRecord::from_telemetry(telemetry, t));
            let (range, vitals) = {
                let desk = super::lock(&port.desk);
                (desk.status.values.as_ref().map_or(f64::NAN, |values| values.get(Id::Range)), desk.status.vitals)
            };
            frame.set_all(Channel::Target1, &telemetry.y.map(|y| -(range as f32) * y));
            if let Some(vitals) = &vitals {
                frame.set_vitals(vitals);
            }
            port.frame(frame);
        }
        RobotMessage::Vitals(vitals) => port.publish(|status| status.vitals = Some(*vitals)),
        _ => {}
    }
}
