//! A robot at the end of a line that loses bytes: whichever byte it is, the run goes on as if nothing had been.

use firmware::Robot;
use hil_sim::experiment::Experiment;
use hil_sim::link::{InProcess, Line, Link, LinkError, Transport};
use hil_sim::record::Record;
use hil_sim::run::Run;
use hil_sim::setup::{BodyKind, Setup};
use protocol::frame::MAX_FRAME;
use protocol::message::Vitals;
use protocol::{HostMessage, RobotMessage, encode};

/// A pipe to a robot, on which byte number `lost` of both directions together is lost.
struct Leaky {
    pipe: InProcess<f32>,
    lost: usize,
    carried: usize,
}

impl Leaky {
    fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        let first = self.carried;
        self.carried += bytes.len();
        bytes.iter().enumerate().filter(|(i, _)| first + i != self.lost).map(|(_, byte)| *byte).collect()
    }
}

impl Transport for Leaky {
    fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let bytes = self.carry(bytes);
        self.pipe.write(&bytes)
    }

    fn read(&mut self, buffer: &mut Vec<u8>) -> Result<(), LinkError> {
        let mut arrived = Vec::new();
        self.pipe.read(&mut arrived)?;
        let arrived = self.carry(&arrived);
        buffer.extend(arrived);
        Ok(())
    }
}

/// A run with this byte lost: its records, and how many bytes went over the line.
fn records(body: BodyKind, steps: usize, lost: usize) -> (Vec<Record>, usize) {
    let setup = Setup::new(Experiment::find("homeokinetic").expect("an experiment"), body);
    let line = Line::new(Leaky { pipe: InProcess::new(Robot::default()), lost, carried: 0 });
    let mut run = Run::start(setup, line).unwrap_or_else(|error| panic!("byte {lost}: {error}"));
    let records = (0..steps).map(|_| run.step().unwrap_or_else(|error| panic!("byte {lost}: {error}"))).collect();
    run.finish().unwrap_or_else(|error| panic!("byte {lost}: {error}"));
    (records, run.link_mut().transport_mut().carried)
}

#[test]
fn any_lost_byte_is_made_good() {
    for (body, steps) in [(BodyKind::Chapter, 5), (BodyKind::Tabletop, 2)] {
        let (whole, bytes) = records(body, steps, usize::MAX);
        for lost in 0..bytes {
            let (records, carried) = records(body, steps, lost);
            assert!(records == whole, "byte {lost} of {bytes} changes the run");
            assert!(carried > bytes, "byte {lost} was not even missed");
        }
    }
}

/// A robot that talks all the time, as one on its own sensors does, and whose first answer is lost.
struct Talkative {
    sent: u16,
    asked: u32,
}

impl Talkative {
    fn say(&mut self, message: &RobotMessage, buffer: &mut Vec<u8>) {
        buffer.extend_from_slice(encode(self.sent, message, &mut [0; MAX_FRAME]).expect("fits"));
        self.sent += 1;
    }
}

impl Transport for Talkative {
    fn write(&mut self, _: &[u8]) -> Result<(), LinkError> {
        self.asked += 1;
        Ok(())
    }

    fn read(&mut self, buffer: &mut Vec<u8>) -> Result<(), LinkError> {
        let answer = RobotMessage::Stored;
        match self.asked {
            1 if self.sent == 0 => {
                self.say(&RobotMessage::Vitals(Vitals::default()), buffer);
                self.say(&answer, &mut Vec::new());
                self.say(&RobotMessage::Vitals(Vitals::default()), buffer);
            }
            1 => return Err(LinkError::NoAnswer),
            // The answer again, under its old number.
            _ => buffer.extend_from_slice(encode(1, &answer, &mut [0; MAX_FRAME]).expect("fits")),
        }
        Ok(())
    }
}

#[test]
fn an_answer_that_was_lost_between_other_frames_is_heard_when_it_is_repeated() {
    let mut line = Line::new(Talkative { sent: 0, asked: 0 });
    let answer = line.request(&HostMessage::Store).expect("it is repeated");
    assert_eq!(answer.message, RobotMessage::Stored);
    assert_eq!(line.lost(), 0, "it has arrived after all");
    assert_eq!(line.overheard(), Some(RobotMessage::Vitals(Vitals::default())));
}
