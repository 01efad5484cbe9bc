//! Where a run is written: a CSV, a log and a picture, in a run folder or in the places asked for.

use crate::csv::{self, BRAIN_COLUMNS, PLANT_COLUMNS, Table, brain_row, plant_row};
use crate::failure::Failure;
use crate::{log, plot, words};
use hil_sim::coupling::Coupling;
use hil_sim::link::Direction;
use hil_sim::record::Record;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use protocol::Values;
use protocol::message::{SafetyState, Vitals};

/// Which files are wanted, and where.
#[derive(Clone, Debug, Default)]
pub struct Places {
    /// The CSV.
    pub csv: Option<PathBuf>,
    /// The log.
    pub log: Option<PathBuf>,
    /// The picture.
    pub plot: Option<PathBuf>,
    /// The run folder that was made for them.
    folder: Option<PathBuf>,
}

impl Places {
    /// These places, asked for one by one.
    pub fn new(csv: Option<PathBuf>, log: Option<PathBuf>, plot: Option<PathBuf>) -> Places {
        Places { csv, log, plot, folder: None }
    }

    /// A new folder `runs/<date>-<name>` with all three files in it; never one that is already there.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn run_folder(name: &str) -> Result<Places, Failure> {
        // UTC, without the colons that some file systems refuse.
        let date = humantime::format_rfc3339_seconds(SystemTime::now()).to_string().replace(':', "");
        let runs = Path::new("runs");
        fs::create_dir_all(runs).map_err(|error| cannot_write(runs, &error))?;
        let mut folder = runs.join(format!("{date}-{name}"));
        for attempt in 2.. {
            match fs::create_dir(&folder) {
                Ok(()) => break,
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
                    folder = runs.join(format!("{date}-{name}-{attempt}"));
                }
                Err(error) => return Err(cannot_write(&folder, &error)),
            }
        }
        Ok(Places {
            csv: Some(folder.join("run.csv")),
            log: Some(folder.join("run.mcap")),
            plot: Some(folder.join("run.png")),
            folder: Some(folder),
        })
    }

    /// As [`Places::run_folder`], for a log alone: nobody knows how long it will get.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn log_folder(name: &str) -> Result<Places, Failure> {
        Ok(Places { csv: None, plot: None, ..Places::run_folder(name)? })
    }

    /// Makes sure that a run folder can be made, before there is anything to put into it. None is left behind.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn check_run_folder() -> Result<(), Failure> {
        let runs = Path::new("runs");
        let is_new = !runs.exists();
        let made = Places::run_folder("check").map(|places| places.withdraw());
        if is_new {
            // Somebody else may have found a use for it meanwhile.
            let _ = fs::remove_dir(runs);
        }
        made
    }

    /// Makes sure that every file can be written, before there is anything to write. What was not there is not there
    /// afterwards.
    ///
    /// # Errors
    /// The file that cannot be written.
    pub fn check(&self) -> Result<(), Failure> {
        let mut made = Vec::new();
        let checked = self.try_all(&mut made);
        remove(&made);
        checked
    }

    /// Takes a run folder away in which nothing has come to stand.
    pub fn withdraw(&self) {
        if let Some(folder) = &self.folder {
            // What stands in it, stays in it.
            let _ = fs::remove_dir(folder);
        }
    }

    /// Whether no file is wanted.
    pub fn is_empty(&self) -> bool {
        self.files().next().is_none()
    }

    /// Every file, in the order in which they are written.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        [&self.csv, &self.log, &self.plot].into_iter().filter_map(|path| path.as_deref())
    }

    /// Makes sure that every file can be written, before any of them is touched. Files that were not there are created and
    /// noted in `made`.
    fn try_all<'p>(&'p self, made: &mut Vec<&'p Path>) -> Result<(), Failure> {
        for (i, path) in self.files().enumerate() {
            if path == Path::new("-") {
                return Err(Failure::bad("a run is written into files, not to standard output: give a file's name"));
            }
            if self.files().take(i).any(|other| other == path) {
                return Err(Failure::bad(format!(
                    "{} is asked for twice: give each file its own name",
                    path.display()
                )));
            }
        }
        if let Some(path) = &self.plot {
            plot::check_target(path).map_err(Failure::bad)?;
        }
        for path in self.csv.iter().chain(&self.log) {
            // A pipe's reader would take the end of the trial for the end of the run.
            if path.exists() && !path.is_file() && !path.is_dir() {
                continue;
            }
            let is_new = !path.exists();
            fs::File::options().append(true).create(true).open(path).map_err(|error| cannot_write(path, &error))?;
            made.extend(is_new.then_some(path.as_path()));
        }
        Ok(())
    }
}

/// Removes files that have been made and stayed empty.
fn remove(made: &[&Path]) {
    for path in made {
        // What cannot be removed now was at least never a run.
        let _ = fs::remove_file(path);
    }
}

fn cannot_write(path: &Path, error: &std::io::Error) -> Failure {
    Failure::bad(format!(
        "cannot write {}: {error}; run in a folder that may be written, or name another place for the file",
        path.display()
    ))
}

/// Writes a run while it goes on.
pub struct Recorder {
    csv: Option<csv::Writer>,
    log: Option<log::Writer>,
    picture: Option<(PathBuf, plot::Title, Vec<Vec<f64>>)>,
    /// The robot's vitals that were last recorded.
    vitals: Option<Vitals>,
    /// The safety state that was last recorded: a run begins Armed.
    state: SafetyState,
}

impl Recorder {
    /// Opens the files. If one cannot be opened, those that were are removed again.
    ///
    /// # Errors
    /// The file that cannot be written.
    pub fn create(
        places: &Places,
        run: &BTreeMap<String, String>,
        values: &Values<f64>,
        title: plot::Title,
    ) -> Result<Self, Failure> {
        let mut made = Vec::new();
        let opened = places.try_all(&mut made).and_then(|()| Self::open(places, run, values, title));
        if opened.is_err() {
            remove(&made);
            places.withdraw();
        }
        opened
    }

    fn open(
        places: &Places,
        run: &BTreeMap<String, String>,
        values: &Values<f64>,
        title: plot::Title,
    ) -> Result<Self, Failure> {
        let mut recorder = Recorder { csv: None, log: None, picture: None, vitals: None, state: SafetyState::Armed };
        if let Some(path) = &places.csv {
            recorder.csv = Some(csv::Writer::create(path, true).map_err(Failure::bad)?);
        }
        if let Some(path) = &places.log {
            recorder.log = Some(log::Writer::create(path, run, values).map_err(Failure::bad)?);
        }
        if let Some(path) = &places.plot {
            let columns = vec![Vec::new(); BRAIN_COLUMNS.len() + PLANT_COLUMNS.len()];
            recorder.picture = Some((path.clone(), title, columns));
        }
        Ok(recorder)
    }

    /// Writes one control step: the frames that went over the wire in it, and what they decode to.
    ///
    /// # Errors
    /// A file that cannot be written any more, as when the disk is full.
    pub fn step(&mut self, record: &Record, link: &mut impl Coupling) -> Result<(), Failure> {
        self.frames(record.brain.t, link)?;
        if let Some(log) = &mut self.log {
            log.record(&record.brain, Some(&record.plant)).map_err(Failure::broken)?;
            if let Some(vitals) = link.vitals().filter(|vitals| self.vitals.as_ref() != Some(vitals)) {
                log.vitals(record.brain.t, vitals).map_err(Failure::broken)?;
                self.vitals = Some(*vitals);
            }
        }
        if let Some(csv) = &mut self.csv {
            csv.write(&record.brain, Some(&record.plant)).map_err(Failure::broken)?;
        }
        if let Some((_, _, columns)) = &mut self.picture {
            let numbers = std::iter::once(record.brain.t)
                .chain(brain_row(&record.brain).map(f64::from))
                .chain(plant_row(&record.plant));
            for (column, number) in columns.iter_mut().zip(numbers) {
                column.push(number);
            }
        }
        Ok(())
    }

    /// Writes the frames that went over the wire, at time `t` (s).
    ///
    /// # Errors
    /// A log that cannot be written any more.
    pub fn frames(&mut self, t: f64, link: &mut impl Coupling) -> Result<(), Failure> {
        let mut result = Ok(());
        let log = &mut self.log;
        link.drain_frames(&mut |direction: Direction, bytes: &[u8]| {
            if let (Some(log), true) = (log.as_mut(), result.is_ok()) {
                result = log.frame((t * 1e9).round() as u64, direction, bytes);
            }
        });
        result.map_err(Failure::broken)
    }

    /// Takes the robot's safety state at time `t`, s, and writes an event if it is another than before. Returns whether it is.
    ///
    /// # Errors
    /// A log that cannot be written any more.
    pub fn state(&mut self, t: f64, state: SafetyState) -> Result<bool, Failure> {
        if state == self.state {
            return Ok(false);
        }
        self.state = state;
        self.event(t, "state", &words::state(state))?;
        Ok(true)
    }

    /// Writes that something happened: a parameter was set, somebody pushed.
    ///
    /// # Errors
    /// A log that cannot be written any more.
    pub fn event(&mut self, t: f64, kind: &str, text: &str) -> Result<(), Failure> {
        self.log.as_mut().map_or(Ok(()), |log| log.event(t, kind, text)).map_err(Failure::broken)
    }

    /// Completes the files and draws the picture, if there is something to draw.
    ///
    /// # Errors
    /// A file that cannot be written; those that can are complete even so.
    pub fn finish(self) -> Result<(), Failure> {
        let csv = self.csv.map_or(Ok(()), |csv| csv.finish().map(drop).map_err(Failure::broken));
        let log = self.log.map_or(Ok(()), |log| log.finish().map(drop).map_err(Failure::broken));
        let picture = self.picture.filter(|(_, _, columns)| columns.iter().any(|column| !column.is_empty()));
        let drawn = picture.map_or(Ok(()), |(path, title, columns)| {
            let mut table = Table::new("this run");
            for (column, numbers) in BRAIN_COLUMNS.iter().chain(&PLANT_COLUMNS).zip(columns) {
                table.insert(column.name, numbers);
            }
            plot::run(&table, &title, &path).map_err(Failure::broken)
        });
        csv.and(log).and(drawn)
    }
}
