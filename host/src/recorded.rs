//! A run that is recorded: it comes to its end in order, whatever ends it.

use crate::failure::Failure;
use crate::plot::Title;
use crate::recorder::{Places, Recorder};
use crate::words;
use hil_sim::coupling::Coupling;
use hil_sim::link::{HELLO, LinkError, recognise};
use hil_sim::record::Record;
use hil_sim::run::{Run, RunError};
use hil_sim::setup::Setup;
use protocol::message::{Refusal, SafetyState};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A run and its files.
pub struct Recorded<L> {
    /// The run.
    pub run: Run<L>,
    /// What writes its files.
    pub recorder: Recorder,
    places: Places,
    /// Time of the next control step, s; it never goes back.
    time: f64,
    /// The robot did not answer in a control step.
    is_deaf: bool,
}

/// A control step that was recorded.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// What was recorded.
    pub record: Record,
    /// The robot's safety state, if it is another than before.
    pub state: Option<SafetyState>,
}

impl<L: Coupling> Recorded<L> {
    /// Readies the robot and opens the files, in places that are asked for only then.
    ///
    /// # Errors
    /// Those of [`Run::start`]; a file that cannot be written, with the robot disarmed again.
    pub fn start(
        setup: Setup,
        link: L,
        places: impl FnOnce() -> Result<Places, Failure>,
        about: &BTreeMap<String, String>,
        title: Title,
    ) -> Result<Self, Failure> {
        let values = setup.values.clone();
        let mut run = Run::start(setup, link).map_err(Failure::bad)?;
        let opened = places().and_then(|places| {
            let recorder = Recorder::create(&places, about, &values, title)?;
            Ok((places, recorder))
        });
        match opened {
            Ok((places, recorder)) => Ok(Recorded { run, recorder, places, time: 0.0, is_deaf: false }),
            Err(failure) => match run.finish() {
                Ok(()) => Err(failure),
                Err(error) => Err(Failure::bad(format!("{failure}; the robot could not be left disarmed: {error}"))),
            },
        }
    }

    /// Time of the next control step, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// One control step, recorded.
    ///
    /// # Errors
    /// Those of [`Run::step`]; a robot that was reset; a file that cannot be written any more.
    pub fn step(&mut self) -> Result<Step, Failure> {
        let record = match self.run.step() {
            // Its count of control steps has begun anew.
            Ok(record) if record.brain.t < self.time => return self.was_reset("the robot was reset"),
            Ok(record) => record,
            // It had been given the simulation's.
            Err(RunError::Link(LinkError::Refused(Refusal::OwnSensors))) => {
                return self
                    .was_reset("the robot is on its own sensors: another host has put it there, or it was reset");
            }
            Err(error) => {
                self.is_deaf = matches!(&error, RunError::Link(link) if !matches!(link, LinkError::Refused(_)));
                return Err(Failure::broken(error));
            }
        };
        self.time = self.run.time();
        self.recorder.step(&record, self.run.link_mut())?;
        let state = self.run.state();
        let is_new = self.recorder.state(record.brain.t, state)?;
        Ok(Step { record, state: is_new.then_some(state) })
    }

    /// Writes that the robot is no longer the one that was readied, and says why it last started.
    fn was_reset(&mut self, what: &str) -> Result<Step, Failure> {
        let asked = self.run.ask(&HELLO).and_then(|answer| recognise(&answer.message));
        let why = match asked {
            Ok(identity) => format!("its last start was: {}", words::reset(identity.reset)),
            Err(error) => error.to_string(),
        };
        let said = format!("{what} at {:.2} s ({why})", self.time);
        self.recorder.frames(self.time, self.run.link_mut())?;
        self.recorder.event(self.time, "reset", &said)?;
        Err(Failure::broken(said))
    }

    /// Ends the run as it `ended`: leaves the robot disarmed, with its own sensors, and completes the files. Returns where they
    /// are.
    ///
    /// # Errors
    /// Why it ended, if not in its time, and what else went wrong, with the places of the files: what is in them is valid.
    pub fn finish(mut self, ended: Result<(), Failure>) -> Result<Vec<PathBuf>, Failure> {
        let left = self.run.finish().map_err(|error| {
            // Why a robot does not answer is not said twice.
            let why = if self.is_deaf { String::new() } else { format!(": {error}") };
            Failure::broken(format!("the robot could not be left disarmed{why}"))
        });
        let last = self.recorder.frames(self.time, self.run.link_mut());
        let complete = self.recorder.finish();
        let files: Vec<PathBuf> = self.places.files().filter(|file| file.exists()).map(Into::into).collect();
        let failures: Vec<Failure> = [ended, left, last, complete].into_iter().filter_map(Result::err).collect();
        if failures.is_empty() {
            return Ok(files);
        }
        let mut said: Vec<String> = failures.iter().map(Failure::to_string).collect();
        // A full disk is met by every file on it.
        said.dedup();
        said.push(format!("the run ended at {:.2} s", self.time));
        let mut said = said.join("; ");
        if !files.is_empty() {
            let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
            said += &format!(", and what was recorded until then is in {}", files.join(", "));
        }
        Err(match failures.as_slice() {
            [Failure::Interrupted(_)] => Failure::Interrupted(said),
            _ => Failure::Broken(said),
        })
    }
}
