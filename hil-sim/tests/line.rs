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
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::time::Duration;

/// What becomes of bytes on their way.
trait Carrier {
    /// What arrives of them.
    fn carry(&mut self, bytes: &[u8]) -> Vec<u8>;
}

/// A pipe to a robot on which, both ways, not every byte arrives.
struct Lossy<C> {
    pipe: InProcess<f32>,
    carrier: C,
}

impl<C: Carrier> Lossy<C> {
    fn new(carrier: C) -> Self {
        Lossy { pipe: InProcess::new(Robot::default()), carrier }
    }
}

impl<C: Carrier> Transport for Lossy<C> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.pipe.write(&self.carrier.carry(bytes))
    }

    fn read(&mut self, buffer: &mut Vec<u8>) -> Result<(), LinkError> {
        let mut arrived = Vec::new();
        self.pipe.read(&mut arrived)?;
        buffer.extend(self.carrier.carry(&arrived));
        Ok(())
    }
}

/// Byte number `lost` of both directions together is lost.
struct Leaky {
    lost: usize,
    carried: usize,
}

impl Carrier for Leaky {
    fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        let first = self.carried;
        self.carried += bytes.len();
        bytes.iter().enumerate().filter(|(i, _)| first + i != self.lost).map(|(_, byte)| *byte).collect()
    }
}

/// A run with this byte lost: its records, and how many bytes went over the line.
fn records(body: BodyKind, steps: usize, lost: usize) -> (Vec<Record>, usize) {
    let setup = Setup::new(Experiment::find("homeokinetic").expect("an experiment"), body);
    let line = Line::new(Lossy::new(Leaky { lost, carried: 0 }));
    let mut run = Run::start(setup, line).unwrap_or_else(|error| panic!("byte {lost}: {error}"));
    let records = (0..steps).map(|_| run.step().unwrap_or_else(|error| panic!("byte {lost}: {error}"))).collect();
    run.finish().unwrap_or_else(|error| panic!("byte {lost}: {error}"));
    (records, run.link_mut().transport_mut().carrier.carried)
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

/// One byte in 200 is lost.
struct Sieve {
    random: Pcg32,
    lost: usize,
}

impl Carrier for Sieve {
    fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        let arrived: Vec<u8> = bytes.iter().filter(|_| !self.random.next_u32().is_multiple_of(200)).copied().collect();
        self.lost += bytes.len() - arrived.len();
        arrived
    }
}

#[test]
fn half_a_percent_of_lost_bytes_is_made_good_for_a_minute() {
    const STEPS: usize = 3000;
    let (whole, _) = records(BodyKind::Tabletop, STEPS, usize::MAX);
    let setup = Setup::new(Experiment::find("homeokinetic").expect("an experiment"), BodyKind::Tabletop);
    let sieve = Lossy::new(Sieve { random: Pcg32::seed_from_u64(1), lost: 0 });
    let mut run = Run::start(setup, Line::new(sieve)).expect("it starts");
    for (step, record) in whole.iter().enumerate() {
        let heard = run.step().unwrap_or_else(|error| panic!("step {step}: {error}"));
        assert!(heard == *record, "step {step} differs");
    }
    let lost = run.link_mut().transport_mut().carrier.lost;
    assert!(lost > 10_000, "{lost} bytes lost: the line was too good to prove anything");
}

/// Nobody is there, and it takes its time to be sure.
struct Deaf {
    waited: u32,
}

impl Transport for Deaf {
    fn write(&mut self, _: &[u8]) -> Result<(), LinkError> {
        Ok(())
    }

    fn read(&mut self, _: &mut Vec<u8>) -> Result<(), LinkError> {
        self.waited += 1;
        std::thread::sleep(Duration::from_millis(1));
        Err(LinkError::NoAnswer)
    }

    fn patience(&self) -> Option<Duration> {
        Some(Duration::from_millis(1))
    }
}

#[test]
fn a_deaf_robot_is_given_up_after_not_much_more_than_twenty_times_the_lines_patience() {
    let mut line = Line::new(Deaf { waited: 0 });
    assert_eq!(line.request(&HostMessage::Arm), Err(LinkError::NoAnswer));
    let waited = line.transport_mut().waited;
    assert!((20..=30).contains(&waited), "{waited} times");
}

/// A robot that tells its vitals by itself, and is reset after some of them; it answers a hello with the next of them.
struct Reset {
    first: u16,
    sent: u16,
    ticks: u32,
    after: u32,
}

impl Transport for Reset {
    fn write(&mut self, _: &[u8]) -> Result<(), LinkError> {
        Ok(())
    }

    fn read(&mut self, buffer: &mut Vec<u8>) -> Result<(), LinkError> {
        if self.ticks == self.after {
            self.sent = 0;
            buffer.push(0);
        }
        let vitals = RobotMessage::Vitals(Vitals { ticks: self.ticks, ..Vitals::default() });
        buffer.extend_from_slice(encode(self.first + self.sent, &vitals, &mut [0; MAX_FRAME]).expect("fits"));
        (self.sent, self.ticks) = (self.sent + 1, self.ticks + 1);
        if self.ticks > self.after {
            self.first = 0;
        }
        Ok(())
    }
}

#[test]
fn a_robot_that_is_reset_early_is_heard_from_its_first_word_on() {
    // It may have been heard from its start, or only from some frame on.
    for first in [0, 5] {
        for after in [1, 20, 31, 32, 33, 100] {
            let mut line = Line::new(Reset { first, sent: 0, ticks: 0, after });
            for expected in 0..after + 50 {
                match line.listen().expect("a line") {
                    Some(RobotMessage::Vitals(vitals)) => {
                        assert_eq!(vitals.ticks, expected, "from {first}, reset after {after}");
                    }
                    other => panic!("{other:?}"),
                }
            }
            assert_eq!(line.lost(), 0, "from {first}, reset after {after}");
        }
    }
}
