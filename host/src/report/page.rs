//! The report for people: one HTML file with all of its pictures in it, to be read offline.

use super::Result;
use super::case::Case;
use super::claim::{Check, Claim, Finding, Scale, Table, Verdict, Wanted};
use super::figure::FigureError;
use hil_sim::measure::Value;
use std::collections::{BTreeMap, BTreeSet};

use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page.css");

/// The whole report; a second run gives the same bytes.
///
/// # Errors
/// A picture that cannot be drawn.
pub fn html(results: &[Result], scale: Scale) -> core::result::Result<String, FigureError> {
    let mut sections = Vec::new();
    for result in results {
        sections.push(section(result)?);
    }
    let runs: usize = results.iter().map(|result| result.outcomes.len()).sum();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "The barrel: the chapter's claims, run" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "The barrel: the chapter's claims, run" }
                p {
                    "What the chapter “Playful Machines” (Der & Martius) claims about the BARREL, claim by claim: what was run, the numbers that decide, the pictures, \
                     the verdict. " (runs) " runs of barrel " (env!("CARGO_PKG_VERSION")) ", seeds from " (scale.seed) " on"
                    @if scale.quick { ", in the quick version (fewer seeds)" }
                    ". Each run is a line; typed again, on any machine, it prints the same numbers. All of them are in the JSON beside this page."
                }
                p {
                    "Every line starts from an experiment's preset (" code { "barrel list" } "): the chapter's settings where it gives them, the original simulator's elsewhere. What is set \
                     otherwise stands with each claim. What a number must be is the chapter's word, the original simulator's value, or a plain reading: nearly all is nine of ten or more, \
                     most is more than half. What is only told decides nothing."
                }
                table.overview {
                    thead { tr { th { "claim" } th { "chapter" } th { "verdict" } th { "runs" } } }
                    tbody {
                        @for result in results {
                            @let verdict = result.finding.verdict();
                            tr {
                                td { a href={ "#" (result.claim.name) } { (result.claim.title) } }
                                td.nowrap { (result.claim.section) }
                                td.nowrap { (badge(verdict)) }
                                td.number { (result.outcomes.len()) }
                            }
                        }
                    }
                }
                @for section in &sections { (section) }
            }
        }
    };
    Ok(page.into_string())
}

fn badge(verdict: Verdict) -> Markup {
    let class = match verdict {
        Verdict::Holds => "holds",
        Verdict::Partly => "partly",
        Verdict::Fails => "fails",
        Verdict::NotJudged => "open",
    };
    let sign = match verdict {
        Verdict::Holds => "✓",
        Verdict::Partly => "◐",
        Verdict::Fails => "✗",
        Verdict::NotJudged => "–",
    };
    html! { span.badge.(class) { (sign) " " (verdict.name()) } }
}

fn section(result: &Result) -> core::result::Result<Markup, FigureError> {
    let Result { claim, finding, .. } = result;
    let mut figures = Vec::new();
    for (caption, figure) in &finding.figures {
        figures.push((caption, figure.svg()?));
    }
    Ok(html! {
        section id=(claim.name) {
            h2 { (claim.title) }
            p.meta { (claim.section) " · " (badge(finding.verdict())) " · " code { "barrel report --only " (claim.name) } }
            p { (claim.method) }
            (departures(claim))
            (checks(finding))
            @for (caption, svg) in &figures {
                figure {
                    (PreEscaped(svg))
                    figcaption { (caption) }
                }
            }
            @for each in &finding.tables { (table(each)) }
            @for note in &finding.notes { p { (note) } }
            (runs(result))
        }
    })
}

fn checks(finding: &Finding) -> Markup {
    html! {
        @if !finding.checks.is_empty() {
            table {
                thead { tr { th { "number" } th { "value" } th { "wanted" } th { "" } } }
                tbody {
                    @for check in &finding.checks {
                        tr {
                            td { (check.what) }
                            td.number { (figures(check.value)) " " (check.unit) }
                            td.number { (check.wanted) @if check.wanted != Wanted::Anything { " " (check.unit) } }
                            td { (mark(check)) }
                        }
                    }
                }
            }
        }
    }
}

fn mark(check: &Check) -> Markup {
    match (check.wanted, check.holds()) {
        (Wanted::Anything, _) => html! {},
        (_, true) => html! { span.yes { "✓" } },
        (_, false) => html! { span.no { "✗" } },
    }
}

fn table(table: &Table) -> Markup {
    html! {
        table {
            caption { (table.caption) }
            thead { tr { @for cell in &table.head { th { (cell) } } } }
            tbody { @for row in &table.rows { tr { @for cell in row { td { (cell) } } } } }
        }
    }
}

/// What its lines set otherwise than the presets; of many values, how many.
fn departures(claim: &Claim) -> Markup {
    let mut set: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (name, value) in claim.cases.iter().flat_map(Case::departures) {
        set.entry(name).or_default().insert(value);
    }
    let words: Vec<String> = set
        .into_iter()
        .map(|(name, values)| match values.len() {
            0..=4 => format!("{name} {}", values.into_iter().collect::<Vec<_>>().join(", ")),
            many => format!("{name} ({many} values)"),
        })
        .collect();
    html! {
        @if !words.is_empty() {
            p.meta { "Set otherwise than the presets in some or all of the lines: " (words.join("; ")) "." }
        }
    }
}

/// The first lines of a claim's runs, the others folded away.
fn runs(result: &Result) -> Markup {
    let rows: Vec<_> = result.claim.cases.iter().zip(&result.outcomes).collect();
    html! {
        @if let Some((case, outcome)) = rows.first() {
            (line(case, &outcome.values))
        }
        @if rows.len() > 1 {
            details {
                summary { "all " (rows.len()) " runs" }
                @for (case, outcome) in &rows { (line(case, &outcome.values)) }
            }
        }
    }
}

fn line(case: &Case, values: &[Value]) -> Markup {
    let numbers: Vec<String> = case
        .measures()
        .into_iter()
        .zip(values)
        .map(|((name, unit), value)| format!("{name} = {value} {unit}").trim_end().to_owned())
        .collect();
    html! {
        pre { code { (case.line) } "\n" span.out { (numbers.join("\n")) } }
    }
}

/// A number for people: four figures that count.
pub fn figures(value: f64) -> String {
    if value.is_nan() {
        return "never".to_owned();
    }
    if value == 0.0 || (value.fract() == 0.0 && value.abs() < 1e6) {
        return format!("{value:.0}");
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    let text = format!("{value:.*}", (3.0 - magnitude).max(0.0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_figures_that_count() {
        for (value, text) in [
            (0.999_96, "1"),
            (0.5, "0.5"),
            (12.345_6, "12.35"),
            (1234.56, "1235"),
            (0.001_234_56, "0.001235"),
            (1.5e-7, "1.50e-7"),
            (50.0, "50"),
            (0.0, "0"),
            (f64::NAN, "never"),
        ] {
            assert_eq!(figures(value), text);
        }
    }
}
