//! `barrel chain`: the brain in another body, a chain of driven pendulums.

use crate::cli::ChainArgs;
use crate::csv::shortest;
use crate::draft::Draft;
use crate::failure::Failure;
use hil_sim::chain::{self, ChainRecord, ChainSetup, reading::ChainMeasure};
use std::io::{BufWriter, Write};
use std::path::Path;

/// What is told of a run when nothing else is asked for.
const SUMMARY: [&str; 6] = ["left-rest", "speed", "reach", "frequency", "max-C", "max-A"];

/// Runs a chain from hanging at rest, and prints and writes what was asked for.
///
/// # Errors
/// A parameter that a chain does not have, a file that cannot be written; numbers that overflow on the way.
pub fn chain(args: &ChainArgs) -> Result<(), Failure> {
    let setup = args.setup()?;
    let draft = args.csv.as_deref().map(|path| Draft::beside(path).map_err(cannot_write(path))).transpose()?;
    let mut records = Vec::new();
    chain::run(&setup, args.duration, |record| records.push(record)).map_err(|broken| {
        Failure::broken(format!("the chain's numbers overflowed {broken}; choose less extreme parameters"))
    })?;
    if let (Some(draft), Some(path)) = (draft, args.csv.as_deref()) {
        write_csv(draft.path(), &records).and_then(|()| draft.commit()).map_err(cannot_write(path))?;
    }
    for measure in args.measures.iter().copied().chain(unasked(args)) {
        say!("{}", format!("{measure} = {} {}", measure.of(&records), measure.what.unit).trim_end());
    }
    Ok(())
}

/// The summary, where no measure was asked for.
fn unasked(args: &ChainArgs) -> impl Iterator<Item = ChainMeasure> {
    SUMMARY.iter().filter(|_| args.measures.is_empty()).filter_map(|name| name.parse().ok())
}

impl ChainArgs {
    /// The setup that was asked for.
    ///
    /// # Errors
    /// A parameter that a chain does not have, or a value out of range; a pendulum that there is not.
    pub fn setup(&self) -> Result<ChainSetup, Failure> {
        let mut setup = ChainSetup::new(self.shape);
        setup.seed = self.seed;
        for &(id, value) in &self.sets {
            setup.set(id, value).map_err(Failure::bad)?;
        }
        let pendulums = self.shape.pendulums();
        if let Some(hand) = self.holds.iter().find(|hand| hand.pendulum >= pendulums) {
            return Err(Failure::bad(format!(
                "there is no pendulum {}: {} has {pendulums}, counted from 1",
                hand.pendulum + 1,
                self.shape.name()
            )));
        }
        setup.hands.clone_from(&self.holds);
        Ok(setup)
    }
}

fn cannot_write(path: &Path) -> impl Fn(std::io::Error) -> Failure {
    move |error| {
        Failure::bad(format!("cannot write {}: {error}; choose a file in a folder that exists", path.display()))
    }
}

fn write_csv(path: &Path, records: &[ChainRecord]) -> std::io::Result<()> {
    let mut file = BufWriter::new(std::fs::File::create(path)?);
    let columns = |record: &ChainRecord| {
        [("angle", &record.angles), ("rate", &record.rates), ("x", &record.x), ("y", &record.y), ("h", &record.h)]
            .map(|(name, numbers)| (name, numbers.clone()))
    };
    if let Some(first) = records.first() {
        let names: Vec<String> = columns(first)
            .into_iter()
            .flat_map(|(name, numbers)| (1..=numbers.len()).map(move |i| format!("{name}{i}")))
            .collect();
        writeln!(file, "t,{},E,E_tle", names.join(","))?;
    }
    for record in records {
        let numbers = columns(record).into_iter().flat_map(|(_, numbers)| numbers);
        let all = core::iter::once(record.t).chain(numbers).chain([record.error, record.time_loop_error]);
        writeln!(file, "{}", all.map(shortest).collect::<Vec<_>>().join(","))?;
    }
    file.flush()
}
