//! `barrel list`: what there is.

use crate::cli::{ListArgs, Listing};
use crate::csv::{BRAIN_COLUMNS, PLANT_COLUMNS, shortest};
use crate::failure::Failure;
use hil_sim::experiment::EXPERIMENTS;
use hil_sim::measure::quantity::QUANTITIES;
use hil_sim::measure::{EVENTS, STATISTICS};
use hil_sim::setup::{BodyKind, defaults};
use protocol::Id;

/// Prints the list that was asked for; without one, experiments and bodies.
///
/// # Errors
/// None so far; the signature is that of every command.
pub fn list(args: &ListArgs) -> Result<(), Failure> {
    match args.what {
        None => {
            experiments();
            say!("");
            bodies();
            say!("\nMore: barrel list parameters, barrel list columns, barrel list measures");
        }
        Some(Listing::Experiments) => experiments(),
        Some(Listing::Bodies) => bodies(),
        Some(Listing::Parameters) => parameters(),
        Some(Listing::Columns) => columns(),
        Some(Listing::Measures) => measures(),
    }
    Ok(())
}

fn experiments() {
    say!("Experiments (barrel run NAME):");
    for e in EXPERIMENTS {
        say!("  {:<17} {} ({})", e.name, e.summary, e.section);
        let preset: Vec<String> =
            e.preset.iter().map(|(id, value)| format!("{}={}", id.name(), shortest(*value))).collect();
        say!("  {:<17}   {}", "", preset.join(" "));
    }
}

fn bodies() {
    say!("Bodies (--body NAME):");
    for kind in BodyKind::ALL {
        let body = kind.body();
        say!(
            "  {:<9} {} m across, {} m long, {} kg and two weights of {} kg that slide by ±{} m",
            kind.name(),
            2.0 * body.radius,
            body.length,
            body.shell_mass,
            body.weight_mass,
            body.range
        );
    }
}

fn parameters() {
    let tabletop = defaults(BodyKind::Tabletop);
    say!("{:<24} {:>10} {:>10}  {:<18} {:<7} help", "parameter", "chapter", "tabletop", "range", "unit");
    for &id in Id::ALL {
        let p = id.parameter();
        say!(
            "{:<24} {:>10} {:>10}  {:<18} {:<7} {}",
            p.name,
            short(p.default),
            short(tabletop.get(id)),
            format!("{} .. {}", short(p.min), short(p.max)),
            p.unit,
            p.help
        );
    }
}

/// A number for a table: few digits, exponent where it would be long.
fn short(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 { format!("{value:e}") } else { format!("{}", (value * 1e4).round() / 1e4) }
}

fn columns() {
    say!("Columns of the CSV; those after E_tle only where there is a simulated barrel:");
    for column in BRAIN_COLUMNS.iter().chain(&PLANT_COLUMNS) {
        say!("  {:<6} {:<6} {}", column.name, column.unit, column.help);
    }
}

fn measures() {
    say!("Measures (--measure NAME[:FROM[:TO]], or --measure STATISTIC:QUANTITY[:FROM[:TO]]; FROM and TO in s):");
    for (_, name, unit, help) in EVENTS {
        say!("  {name:<10} {unit:<6} {help}");
    }
    say!("Statistics:");
    for (_, name, help) in STATISTICS {
        say!("  {name:<10}        {help}");
    }
    say!("Quantities:");
    for quantity in QUANTITIES {
        say!("  {:<10} {:<6} {}", quantity.name, quantity.unit, quantity.help);
    }
    say!("Measures of `barrel chain`:");
    for measure in &hil_sim::chain::reading::MEASURES {
        say!("  {:<11} {:<5} {}", measure.name, measure.unit, measure.help);
    }
}
