//! `barrel plot`: a picture of a recording.

use crate::cli::PlotArgs;
use crate::failure::Failure;
use crate::{log, plot};

/// Draws a whole run, or the columns that were asked for.
///
/// # Errors
/// A recording that cannot be read, a column that it does not have, a picture that cannot be written.
pub fn plot(args: &PlotArgs) -> Result<(), Failure> {
    Failure::unless_there(&args.file)?;
    let out = args.out.clone().unwrap_or_else(|| args.file.with_extension("png"));
    plot::check_target(&out).map_err(Failure::bad)?;
    let (table, truncated) = log::read_table(&args.file).map_err(Failure::bad)?;
    let title = plot::Title { heading: args.file.display().to_string(), details: format!("{} rows", table.rows()) };
    if args.columns.is_empty() {
        plot::run(&table, &title, &out).map_err(Failure::bad)?;
    } else {
        plot::columns(&table, &args.columns, &title, &out).map_err(Failure::bad)?;
    }
    say!("written: {}", out.display());
    if truncated {
        eprintln!("barrel: {} was cut off: this is all of it up to its last whole chunk", args.file.display());
    }
    Ok(())
}
