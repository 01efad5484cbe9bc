//! What a robot on a line says by itself, on one clock that never goes back, into a log.
//!
//! The log's time is the robot's, in control steps from the first one heard. A robot that starts anew counts from 0 again:
//! the time then goes on by as much as has passed here.

use crate::failure::Failure;
use crate::log;
use crate::recorder::Places;
use crate::words;
use hil_sim::link::{Direction, Identity, Line, Link, LinkError, Transport};
use hil_sim::record::BrainRecord;
use hil_sim::run::time;
use hil_sim::setup::{BodyKind, defaults};
use hil_sim::world::robot_parameters;
use protocol::message::{SafetyState, Vitals};
use protocol::{HostMessage, RobotMessage, Telemetry, Values};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Control steps in a second.
const STEPS: f64 = 50.0;
/// A count of steps that runs ahead of the clock by more than this, s, is not the one that was followed.
const AHEAD: f64 = 5.0;
/// The robot's count of servo ticks goes on by less than this, an hour, from one of its vitals to the next.
const TICKS: u32 = 3_600_000;
/// A log without news is brought onto the disk after this.
const REST: Duration = Duration::from_secs(1);

/// What is new.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum News {
    /// The robot is in another safety state.
    State(SafetyState),
    /// Its brain has begun anew.
    Restarted,
    /// The robot was reset.
    Reset,
    /// Its vitals, once a second.
    Vitals,
}

/// Follows one robot, over any number of lines.
pub struct Journal {
    log: Option<log::Writer>,
    path: Option<PathBuf>,
    clock: Clock,
    gaps: Gaps,
    garbled: u32,
    garbled_before: u32,
    state: Option<SafetyState>,
    telemetry: Option<Telemetry>,
    vitals: Option<Vitals>,
    steps: u64,
    bytes: u64,
    written: Instant,
}

impl Journal {
    /// A journal that keeps no log.
    pub fn new() -> Self {
        Journal {
            log: None,
            path: None,
            clock: Clock::default(),
            gaps: Gaps::default(),
            garbled: 0,
            garbled_before: 0,
            state: None,
            telemetry: None,
            vitals: None,
            steps: 0,
            bytes: 0,
            written: Instant::now(),
        }
    }

    /// Begins the log, in its place among these, with what the robot is and what its parameters are now.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn begin_log(
        &mut self,
        places: &Places,
        command: &str,
        link: &str,
        identity: &Identity,
        values: &Values<f64>,
    ) -> Result<(), Failure> {
        let about = BTreeMap::from(
            [
                ("link", link.to_owned()),
                ("precision", crate::cli::Format::from(identity.precision).name().to_owned()),
                ("firmware_version", words::version(identity.firmware)),
                ("reset", words::reset(identity.reset).to_owned()),
                ("command", command.to_owned()),
            ]
            .map(|(name, value)| (name.to_owned(), value)),
        );
        let path = places.log.clone().unwrap_or_default();
        let log =
            log::Writer::create(&path, &about, values).inspect_err(|_| places.withdraw()).map_err(Failure::bad)?;
        self.log = Some(log);
        self.path = Some(path);
        Ok(())
    }

    /// Whether there is a log.
    pub fn has_log(&self) -> bool {
        self.log.is_some()
    }

    /// Goes on over a new line, from the first frames on it, with the robot as it says it is.
    pub fn connected<T: Transport>(&mut self, line: &Line<T>, identity: &Identity) {
        self.state = Some(identity.state);
        self.garbled = self.garbled();
        self.garbled_before = line.garbled();
        self.gaps.base = line.lost();
        self.gaps.suspect = 0;
    }

    /// Takes a message as it is heard, and returns what is new in it.
    ///
    /// # Errors
    /// A log that cannot be written any more.
    pub fn heard<T: Transport>(&mut self, message: &RobotMessage, line: &mut Line<T>) -> Result<Vec<News>, Failure> {
        let mut news = Vec::new();
        self.gaps.note(line.lost());
        match message {
            RobotMessage::Telemetry(telemetry) => {
                let (step, goes_on) = self.clock.step(telemetry.tick);
                self.gaps.settle(goes_on);
                self.steps += 1;
                if !goes_on {
                    news.push(News::Restarted);
                }
                if self.state.replace(telemetry.state) != Some(telemetry.state) {
                    news.push(News::State(telemetry.state));
                }
                self.telemetry = Some(*telemetry);
                self.frames(line)?;
                if let Some(log) = &mut self.log {
                    log.record(&BrainRecord::from_telemetry(telemetry, time(step)), None).map_err(Failure::broken)?;
                }
            }
            RobotMessage::Vitals(vitals) => {
                let goes_on =
                    self.vitals.is_none_or(|before| (1..TICKS).contains(&vitals.ticks.wrapping_sub(before.ticks)));
                self.gaps.settle(goes_on);
                if !goes_on {
                    news.push(News::Reset);
                }
                self.vitals = Some(*vitals);
                news.push(News::Vitals);
                let t = self.now();
                self.frames(line)?;
                if let Some(log) = &mut self.log {
                    log.vitals(t, vitals).map_err(Failure::broken)?;
                }
            }
            _ => self.frames(line)?,
        }
        for new in &news {
            match new {
                News::State(state) => self.event("state", &words::state(*state))?,
                News::Restarted => self.event("restart", "the brain began anew")?,
                News::Reset | News::Vitals => {}
            }
        }
        self.garbled_now(line);
        Ok(news)
    }

    /// Nothing was heard for a moment: what there is goes onto the disk before long.
    ///
    /// # Errors
    /// A log that cannot be written any more.
    pub fn rest<T: Transport>(&mut self, line: &mut Line<T>) -> Result<(), Failure> {
        self.frames(line)?;
        self.garbled_now(line);
        if self.written.elapsed() < REST {
            return Ok(());
        }
        self.flush()
    }

    /// Hands everything so far to the operating system.
    ///
    /// # Errors
    /// A log that cannot be written any more.
    pub fn flush(&mut self) -> Result<(), Failure> {
        self.written = Instant::now();
        self.log.as_mut().map_or(Ok(()), log::Writer::flush).map_err(Failure::broken)
    }

    /// Writes that something happened.
    ///
    /// # Errors
    /// A log that cannot be written any more.
    pub fn event(&mut self, kind: &str, text: &str) -> Result<(), Failure> {
        let t = self.now();
        self.log.as_mut().map_or(Ok(()), |log| log.event(t, kind, text)).map_err(Failure::broken)
    }

    /// Completes the log and returns where it is.
    ///
    /// # Errors
    /// A log that cannot be written any more.
    pub fn finish(mut self) -> Result<Option<PathBuf>, Failure> {
        if let Some(log) = self.log.take() {
            log.finish().map_err(Failure::broken)?;
        }
        Ok(self.path)
    }

    /// Time of the log, s.
    pub fn now(&self) -> f64 {
        self.clock.now()
    }

    /// Time of the last control step heard, s.
    pub fn time(&self) -> f64 {
        time(self.clock.step)
    }

    /// Control steps heard.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Bytes heard.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Frames that did not arrive, by the gaps in their numbers; those that a robot off the line or in a reset never sent
    /// are not among them.
    pub fn lost(&self) -> u64 {
        self.gaps.lost
    }

    /// Frames that arrived garbled.
    pub fn garbled(&self) -> u32 {
        self.garbled
    }

    /// The last control step heard.
    pub fn telemetry(&self) -> Option<&Telemetry> {
        self.telemetry.as_ref()
    }

    /// The last vitals heard.
    pub fn vitals(&self) -> Option<&Vitals> {
        self.vitals.as_ref()
    }

    fn frames<T: Transport>(&mut self, line: &mut Line<T>) -> Result<(), Failure> {
        let time = (self.now() * 1e9).round() as u64;
        let mut result = Ok(());
        let (log, count) = (&mut self.log, &mut self.bytes);
        line.drain_frames(&mut |direction, bytes| {
            *count += if direction == Direction::ToHost { bytes.len() as u64 } else { 0 };
            if let (Some(log), true) = (log.as_mut(), result.is_ok()) {
                result = log.frame(time, direction, bytes);
            }
        });
        result.map_err(Failure::broken)
    }

    fn garbled_now<T: Transport>(&mut self, line: &Line<T>) {
        let now = line.garbled();
        self.garbled += now.saturating_sub(self.garbled_before);
        self.garbled_before = now;
    }
}

impl Default for Journal {
    fn default() -> Self {
        Journal::new()
    }
}

/// The robot's parameters as it holds them now; the simulator's as they are on the body that one can build.
///
/// # Errors
/// A robot that does not answer.
pub fn parameters<T: Transport>(line: &mut Line<T>) -> Result<Values<f64>, LinkError> {
    let mut values = defaults(BodyKind::Tabletop);
    for id in robot_parameters() {
        let answer = line.request(&HostMessage::GetParameter { index: id.index() })?;
        if let RobotMessage::Parameter { value, .. } = answer.message {
            values.set(id, f64::from(value));
        }
    }
    Ok(values)
}

/// Control steps since the log began, whatever the robot counts.
#[derive(Debug)]
struct Clock {
    /// What the robot counted last.
    tick: Option<u32>,
    /// The step that this was.
    step: u64,
    /// When it was heard.
    heard: Instant,
}

impl Default for Clock {
    fn default() -> Self {
        Clock { tick: None, step: 0, heard: Instant::now() }
    }
}

impl Clock {
    /// The step of the robot's `tick`, and whether its count goes on.
    fn step(&mut self, tick: u32) -> (u64, bool) {
        let passed = self.heard.elapsed().as_secs_f64();
        let (advance, goes_on) = match self.tick {
            None => (0, true),
            Some(before) => {
                let advance = u64::from(tick.saturating_sub(before));
                if advance > 0 && advance as f64 <= (passed + AHEAD) * STEPS {
                    (advance, true)
                } else {
                    (((passed * STEPS) as u64).max(1), false)
                }
            }
        };
        self.step += advance;
        self.tick = Some(tick);
        self.heard = Instant::now();
        (self.step, goes_on)
    }

    /// Now, s.
    fn now(&self) -> f64 {
        time(self.step) + if self.tick.is_some() { self.heard.elapsed().as_secs_f64() } else { 0.0 }
    }
}

/// Counts lost frames. A robot that starts anew numbers its frames anew, too, which may look like a gap: only when the
/// robot's own count has gone on was it one.
#[derive(Debug, Default)]
struct Gaps {
    /// What the line has counted so far.
    base: u32,
    /// Not known yet to be gaps.
    suspect: i64,
    lost: u64,
}

impl Gaps {
    fn note(&mut self, lost: u32) {
        self.suspect += i64::from(lost) - i64::from(self.base);
        self.base = lost;
    }

    fn settle(&mut self, goes_on: bool) {
        if goes_on {
            self.lost = self.lost.saturating_add_signed(self.suspect);
        }
        self.suspect = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_follows_the_robots_steps_and_goes_on_over_a_restart() {
        let mut clock = Clock::default();
        assert_eq!([1000, 1001, 1004].map(|tick| clock.step(tick)), [(0, true), (1, true), (4, true)]);
        let (step, goes_on) = clock.step(0);
        assert!(step > 4 && !goes_on);
        assert_eq!(clock.step(1), (step + 1, true));
        // A count that nobody can have heard grow is another robot's.
        assert!(!clock.step(1_000_000).1);
    }

    #[test]
    fn a_gap_is_one_only_if_the_robot_has_gone_on() {
        let mut gaps = Gaps::default();
        gaps.note(3);
        gaps.settle(true);
        gaps.note(20_000);
        gaps.settle(false);
        gaps.note(20_002);
        gaps.note(20_001);
        gaps.settle(true);
        assert_eq!(gaps.lost, 4);
    }
}
