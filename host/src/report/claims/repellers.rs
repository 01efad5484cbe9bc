//! Section 3.2: what the time loop error drives the controller away from.

use super::super::case::{Case, Outcome};
use super::super::claim::{Claim, Finding, Scale, Table, Wanted};
use super::super::figure::{Axis, Figure, Ink, Marker, Panel};
use super::super::statistics::{largest, median, share};
use super::each;

pub fn claims(scale: Scale) -> Vec<Claim> {
    vec![saturation(scale), no_model(scale)]
}

/// Biases at the start, both motors; tanh'(3 + 1/√2) is 0.0024.
const BIASES: [f64; 7] = [0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0];

fn saturation(scale: Scale) -> Claim {
    let seeds = scale.seeds(20, 4);
    let count = seeds.clone().count();
    let line = |h: f64, seed: u64| {
        Case::new(format!(
            "run homeokinetic --seed {seed} --duration 120 --set h1={h} --set h2={h} --measure mean:activity:0:2 --measure mean:activity:60 \
             --measure mean:normh:60 --measure reversals:60 --measure first:normh:10"
        ))
        .traced(&["normh", "activity"], 25)
    };
    let cases = each(&BIASES, seeds, line);
    let judge = move |outcomes: &[Outcome]| {
        let mut finding = Finding::default();
        let mut table = Table::new(
            "Started in saturation (medians over seeds)",
            &[
                "h1 = h2 at the start",
                "activity, first 2 s",
                "|h| after 10 s",
                "activity, 60 s on",
                "|h|, 60 s on",
                "sweeping after 60 s",
            ],
        );
        for (h, runs) in BIASES.iter().zip(outcomes.chunks(count)) {
            let of = |k: usize| median(runs.iter().map(|run| run.number(k)));
            table.row([
                format!("{h}"),
                format!("{:.3}", of(0)),
                format!("{:.3}", of(4)),
                format!("{:.3}", of(1)),
                format!("{:.3}", of(2)),
                format!("{:.0} %", 100.0 * share(runs, |run| run.number(3) >= 2.0)),
            ]);
        }
        finding.tables.push(table);
        let within = |from: usize, to: usize| outcomes[from * count..to * count].iter();
        finding.check(
            "h up to 4: |h| after 10 s, at most",
            largest(within(0, 6).map(|run| run.number(4))),
            "",
            Wanted::AtMost(1.5),
        );
        finding.check(
            "h up to 4: seeds that sweep from 60 s on",
            share(within(0, 6), |run| run.number(3) >= 2.0),
            "",
            Wanted::AtLeast(0.95),
        );
        let late: Vec<f64> = BIASES
            .iter()
            .zip(outcomes.chunks(count))
            .take(6)
            .map(|(_, runs)| median(runs.iter().map(|run| run.number(1))))
            .collect();
        finding.check(
            "h up to 4: activity from 60 s on, largest over smallest median",
            largest(late.iter().copied()) / late[0],
            "",
            Wanted::AtMost(1.1),
        );
        finding.check(
            "h = 6: activity from 60 s on, median, against that from h = 0",
            median(within(6, 7).map(|run| run.number(1))) / late[0],
            "",
            Wanted::AtLeast(0.9),
        );
        finding.tell("h = 6: seeds that sweep from 60 s on", share(within(6, 7), |run| run.number(3) >= 2.0), "");
        finding.note(
            "Deep in saturation (h = 6, g' below 1e-4) the clips, not the gradient, set the pace: h comes back at 0.1 a step, but C is pushed about \
             by its own clipped steps on the way and may end in another mode.",
        );
        let inks = [Ink::Grey, Ink::Sky, Ink::Green, Ink::Blue, Ink::Orange, Ink::Vermillion, Ink::Purple];
        let curves = |k: usize, name: &str, y: Axis| {
            BIASES.iter().zip(outcomes.chunks(count)).zip(inks).step_by(2).fold(
                Panel::new(name, Axis::linear("t (s)").within(0.0, 20.0), y),
                |panel, ((h, runs), ink)| {
                    panel.line(
                        format!("h = {h}"),
                        ink,
                        runs[0].curve(k).into_iter().filter(|[t, _]| *t <= 20.0).collect(),
                    )
                },
            )
        };
        finding.figure(
            "Out of the saturation: bias and activity (root mean square of the motor values) from different depths.",
            Figure::grid(
                vec![
                    curves(0, "bias", Axis::linear("|h|")),
                    curves(1, "activity", Axis::linear("activity").within(0.0, 1.05)),
                ],
                2,
                320.0,
            ),
        );
        let of = |k: usize| -> Vec<[f64; 2]> {
            let groups = BIASES.iter().zip(outcomes.chunks(count));
            groups.map(|(h, runs)| [*h, median(runs.iter().map(|run| run.number(k)))]).collect()
        };
        finding.figure(
            "Activity against the distance from the middle of the range: the deeper in saturation at the start, the more; a minute later \
             nothing is left of it, up to h = 4.",
            Figure::one(
                Panel::new("", Axis::linear("bias h at the start, both motors"), Axis::linear("activity").within(0.0, 1.05))
                    .line("", Ink::Vermillion, of(0))
                    .points("first 2 s", Ink::Vermillion, Marker::Square, of(0))
                    .line("", Ink::Blue, of(1))
                    .points("from 60 s on", Ink::Blue, Marker::Disc, of(1)),
                240.0,
            ),
        );
        finding
    };
    Claim::new(
        "saturation",
        "Section 3.2",
        "Saturation repels: a neuron at the end of its range is brought back to where it is sensitive.",
        "Both biases start at h, all else as in Experiment 3.1; 120 s.",
        cases,
        judge,
    )
}

const MODELS: [f64; 5] = [0.0, 1e-3, 1e-2, 1e-1, 1.0];

fn no_model(scale: Scale) -> Claim {
    let seeds = scale.seeds(20, 4);
    let count = seeds.clone().count();
    let line = |a: f64, seed: u64| {
        Case::new(format!(
            "run homeokinetic --seed {seed} --duration 120 --set A11={a} --set A22={a} --measure left-rest --measure max:normC:0:10 \
             --measure last:normA:0:10 --measure reversals:60 --measure mean:speed:0:10"
        ))
        .traced(&["normA", "normC"], 2)
    };
    let cases = each(&MODELS, seeds, line);
    let judge = move |outcomes: &[Outcome]| {
        let mut finding = Finding::default();
        let groups: Vec<&[Outcome]> = outcomes.chunks(count).collect();
        let of = |a: usize, k: usize| median(groups[a].iter().map(|run| run.number(k)));
        let mut table = Table::new(
            "From a model that knows little (medians)",
            &[
                "A = a 1, a",
                "rest left after (s)",
                "|C| within 10 s, at most",
                "|A| after 10 s",
                "mean |omega|, first 10 s (rad/s)",
            ],
        );
        for (i, a) in MODELS.iter().enumerate() {
            table.row([
                format!("{a}"),
                format!("{:.2}", of(i, 0)),
                format!("{:.2}", of(i, 1)),
                format!("{:.2}", of(i, 2)),
                format!("{:.3}", of(i, 4)),
            ]);
        }
        finding.tables.push(table);
        finding.check("A = 0: rest left after, median, against A = 1", of(0, 0) / of(4, 0), "", Wanted::AtMost(0.5));
        finding.check("A = 0: |C| within 10 s against A = 1", of(0, 1) / of(4, 1), "", Wanted::AtLeast(1.3));
        finding.check(
            "all: seeds that sweep in the second minute",
            share(outcomes, |run| run.number(3) >= 2.0),
            "",
            Wanted::AtLeast(0.95),
        );
        let inks = [Ink::Vermillion, Ink::Orange, Ink::Purple, Ink::Sky, Ink::Blue];
        let panel = |k: usize, name: &str, y: Axis| {
            MODELS.iter().zip(&groups).zip(inks).fold(
                Panel::new(name, Axis::linear("t (s)").within(0.0, 15.0), y),
                |panel, ((a, runs), ink)| {
                    panel.line(
                        format!("a = {a}"),
                        ink,
                        runs[0].curve(k).into_iter().filter(|[t, _]| *t <= 15.0).collect(),
                    )
                },
            )
        };
        finding.figure(
            "A small A makes the error in the motor values, zeta = (A G')⁻¹ xi, large: C is driven up until the body answers and A is learned.",
            Figure::grid(vec![panel(0, "model", Axis::linear("|A|")), panel(1, "controller", Axis::linear("|C|"))], 2, 300.0),
        );
        let against = |k: usize| MODELS.iter().enumerate().skip(1).map(|(i, a)| [*a, of(i, k)]).collect::<Vec<_>>();
        let panel = |y: &str, k: usize| {
            Panel::new("", Axis::log("a at the start"), Axis::linear(y)).points("", Ink::Blue, Marker::Disc, against(k))
        };
        finding.figure(
            "With a small model rest is left sooner, and the barrel is faster meanwhile. A = 0 is in the table.",
            Figure::grid(vec![panel("rest left after (s)", 0), panel("mean |omega|, first 10 s (rad/s)", 4)], 2, 220.0),
        );
        finding
    };
    Claim::new(
        "no-model",
        "Section 3.2",
        "A model without response repels, too: the smaller A, the more the controller acts.",
        "A = a 1 at the start, all else as in Experiment 3.1; 120 s.",
        cases,
        judge,
    )
}
