//! The report for machines: every run with its line and its numbers, every claim with its checks.

use super::Result;
use super::case::value_json;
use super::claim::{Check, Scale, Table, Wanted};
use hil_sim::experiment::{EXPERIMENTS, Experiment};
use hil_sim::setup::{BodyKind, Setup};
use protocol::Id;
use serde_json::{Map, Value as Json, json};

/// The whole report; a second run gives the same bytes.
pub fn json(results: &[Result], scale: Scale) -> String {
    let report = json!({
        "program": concat!("barrel ", env!("CARGO_PKG_VERSION")),
        "seed": scale.seed,
        "quick": scale.quick,
        "presets": EXPERIMENTS.iter().map(|e| (e.name.to_owned(), preset(e))).collect::<Map<String, Json>>(),
        "claims": results.iter().map(claim).collect::<Vec<_>>(),
    });
    format!("{report:#}\n")
}

/// Every parameter of an experiment on the chapter's body, before a line sets any.
fn preset(experiment: &'static Experiment) -> Json {
    let values = Setup::new(experiment, BodyKind::Chapter).values;
    Id::ALL.iter().map(|id| (id.name().to_owned(), json!(values.get(*id)))).collect::<Map<String, Json>>().into()
}

fn claim(result: &Result) -> Json {
    let Result { claim, outcomes, finding } = result;
    let run = |(case, outcome): (&super::case::Case, &super::case::Outcome)| {
        let values = case.measures().into_iter().zip(&outcome.values);
        let measures: Map<String, Json> = values.map(|((name, _), value)| (name, value_json(value))).collect();
        json!({ "line": case.line, "measures": measures, "broken": outcome.broken })
    };
    json!({
        "name": claim.name,
        "section": claim.section,
        "title": claim.title,
        "method": claim.method,
        "verdict": finding.verdict().name(),
        "checks": finding.checks.iter().map(check).collect::<Vec<_>>(),
        "tables": finding.tables.iter().map(table).collect::<Vec<_>>(),
        "notes": finding.notes,
        "runs": claim.cases.iter().zip(outcomes).map(run).collect::<Vec<_>>(),
    })
}

fn check(check: &Check) -> Json {
    let wanted = match check.wanted {
        Wanted::Within(low, high) => json!({ "at_least": low, "at_most": high }),
        Wanted::AtLeast(low) => json!({ "at_least": low }),
        Wanted::AtMost(high) => json!({ "at_most": high }),
        Wanted::Anything => Json::Null,
    };
    json!({ "what": check.what, "value": check.value, "unit": check.unit, "wanted": wanted, "holds": check.holds() })
}

fn table(table: &Table) -> Json {
    json!({ "caption": table.caption, "head": table.head, "rows": table.rows })
}
