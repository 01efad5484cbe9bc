//! `barrel report`: every claim of the chapter, run and judged.

use crate::cli::ReportArgs;
use crate::draft::Draft;
use crate::failure::Failure;
use crate::interrupt;
use crate::report::campaign::Campaign;
use crate::report::claim::{Claim, Scale};
use crate::report::page::figures;
use crate::report::{claims, data, judge, page};
use crate::suggest::did_you_mean;
use std::io::Write;
use std::path::Path;

/// Runs what the report needs and writes it. What is done when somebody interrupts it need not be done again.
///
/// # Errors
/// A claim that there is not, a folder that cannot be written; Ctrl-C.
pub fn report(args: &ReportArgs) -> Result<(), Failure> {
    let scale = Scale { quick: args.quick, seed: args.seed };
    let claims = chosen(scale, &args.only)?;
    let folder = &args.out;
    let cannot = |error: std::io::Error| {
        Failure::bad(format!("cannot write {}: {error}; choose another folder with --out", folder.display()))
    };
    std::fs::create_dir_all(folder).map_err(cannot)?;
    let (html, json) = (folder.join("report.html"), folder.join("report.json"));
    let drafts = [Draft::beside(&html).map_err(cannot)?, Draft::beside(&json).map_err(cannot)?];
    let journal = folder.join("report.journal");
    let stop = interrupt::flag()?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = args.jobs.map_or(cores, usize::from);
    let campaign = Campaign { jobs, journal: Some(journal.clone()), stop: &stop, quiet: args.quiet };
    let results = judge(&claims, &campaign).map_err(|failure| match failure {
        Failure::Interrupted(_) => Failure::Interrupted(format!(
            "interrupted; what is done is kept in {}: the same line goes on from there",
            journal.display()
        )),
        other => other,
    })?;
    let written = page::html(&results, scale).map_err(Failure::broken)?;
    for (draft, text) in drafts.into_iter().zip([written, data::json(&results, scale)]) {
        write(draft.path(), &text).and_then(|()| draft.commit()).map_err(cannot)?;
    }
    campaign.forget(&claims.iter().flat_map(|claim| &claim.cases).collect::<Vec<_>>())?;
    for result in &results {
        say!("{:<15} {:<14} {}", result.finding.verdict().name(), result.claim.name, result.claim.title);
        for check in result.finding.checks.iter().filter(|check| !check.holds()) {
            let value = figures(check.value);
            say!("{:<15}   {}: {value} {}, wanted {}", "", check.what, check.unit, check.wanted);
        }
    }
    say!("Written:\n  {}\n  {}", html.display(), json.display());
    Ok(())
}

fn chosen(scale: Scale, names: &[String]) -> Result<Vec<Claim>, Failure> {
    let all = claims::all(scale);
    if let Some(unknown) = names.iter().find(|name| all.iter().all(|claim| claim.name != **name)) {
        let known: Vec<&str> = all.iter().map(|claim| claim.name).collect();
        let hint = did_you_mean(unknown, known.iter().copied());
        return Err(Failure::bad(format!("there is no claim '{unknown}'{hint}; there are {}", known.join(", "))));
    }
    let is_chosen = |claim: &Claim| names.is_empty() || names.iter().any(|name| name == claim.name);
    Ok(all.into_iter().filter(is_chosen).collect())
}

fn write(path: &Path, text: &str) -> std::io::Result<()> {
    std::fs::File::create(path)?.write_all(text.as_bytes())
}
