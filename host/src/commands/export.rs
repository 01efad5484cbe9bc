//! `barrel export`: the CSV of a log.

use crate::cli::ExportArgs;
use crate::failure::Failure;
use crate::log;

/// Writes the CSV that the logged run would have written.
///
/// # Errors
/// A log that cannot be read or is damaged, a CSV that cannot be written; no CSV is then left behind.
pub fn export(args: &ExportArgs) -> Result<(), Failure> {
    Failure::unless_there(&args.log)?;
    let csv = args.csv.clone().unwrap_or_else(|| args.log.with_extension("csv"));
    let export = log::export(&args.log, &csv).map_err(Failure::bad)?;
    say!("{} rows written to {}", export.rows, csv.display());
    if export.truncated {
        eprintln!("barrel: {} was cut off: this is all of it up to its last whole chunk", args.log.display());
    }
    Ok(())
}
