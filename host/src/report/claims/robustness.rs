//! The key claims once more: other number formats, other bodies, other physics.

use super::super::case::{Case, Outcome};
use super::super::claim::{Claim, Finding, Scale, Table, Wanted};
use super::super::figure::{Axis, Figure, Ink, Panel};
use super::super::statistics::{median, share};
use super::each;
use core::f64::consts::TAU;

pub fn claims(scale: Scale) -> Vec<Claim> {
    vec![variations(scale), tabletop(scale), board(scale)]
}

/// What is varied: its name, and what is added to a line.
const VARIED: [(&str, &str); 19] = [
    ("as is (f32)", ""),
    ("f64", "--precision f64"),
    ("fixed point", "--precision fixed"),
    ("friction -20 %", "--set friction=0.08"),
    ("friction +20 %", "--set friction=0.12"),
    ("contact friction -20 %", "--set mu=0.512"),
    ("contact friction +20 %", "--set mu=0.768"),
    ("sensor noise -20 %", "NOISE-"),
    ("sensor noise +20 %", "NOISE+"),
    ("shell -20 %", "--set shellMass=0.8"),
    ("shell +20 %", "--set shellMass=1.2"),
    ("weights -20 %", "--set weightMass=0.8"),
    ("weights +20 %", "--set weightMass=1.2"),
    ("radius -20 %", "--set radius=0.4"),
    ("radius +20 %", "--set radius=0.6"),
    ("gravity -20 %", "--set gravity=7.85"),
    ("gravity +20 %", "--set gravity=11.77"),
    ("KP -20 %", "--set KP=160"),
    ("KP +20 %", "--set KP=240"),
];

/// What is varied, with the noise reckoned from that of the experiment.
fn varied(set: &str, noise: f64) -> String {
    match set {
        "NOISE-" => format!("--set sensorNoise={}", super::decimals(0.8 * noise)),
        "NOISE+" => format!("--set sensorNoise={}", super::decimals(1.2 * noise)),
        set => set.to_owned(),
    }
}

/// Runs of one variation and seed.
const RUNS: usize = 6;

fn variations(scale: Scale) -> Claim {
    let seeds = scale.seeds(20, 3);
    let count = seeds.clone().count();
    let sets = VARIED.map(|(_, set)| set);
    let mut cases = Vec::new();
    for set in sets {
        let [quiet, small, large] = [0.0, 0.01, 0.1].map(|noise| varied(set, noise));
        let upright = varied(&set.replace("mu=0.512", "mu=0.8").replace("mu=0.768", "mu=1.2"), 0.1);
        let lines = [
            format!("run open-loop {quiet} --duration 180 --set period=150 --measure rate:phi:60"),
            format!("run closed-loop {quiet} --duration 120 --measure rate:phi:60"),
            format!("run homeostatic {small} --set lambdaA=0.001 --duration 300 --measure left-rest"),
            format!(
                "run homeostatic {small} --set lambdaA=0.001 --duration 600 --push 60:10:0.5 --measure reversals:400"
            ),
            format!("run homeokinetic {large} --duration 300 --measure left-rest --measure interval"),
            format!("run upright {upright} --duration 120 --measure fell"),
        ];
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        cases.extend(each(&lines, seeds.clone(), |line, seed| Case::new(format!("{line} --seed {seed}"))));
    }
    let judge = move |outcomes: &[Outcome]| {
        let mut finding = Finding::default();
        let mut table = Table::new(
            "Key claims under variation (shares of seeds; medians)",
            &[
                "",
                "1.1: locked at T = 150",
                "1.2: omega (rad/s)",
                "2.2: rest kept",
                "2.2: sweeping after a kick",
                "3.1: rest left in 60 s",
                "reverses every (s)",
                "upright: toppled",
            ],
        );
        let mut held = Vec::new();
        for ((name, _), runs) in VARIED.iter().zip(outcomes.chunks(RUNS * count)) {
            let groups: Vec<&[Outcome]> = runs.chunks(count).collect();
            let of = |group: usize, k: usize| groups[group].iter().map(move |run| run.number(k));
            let drive = TAU / 3.0;
            let numbers = [
                share(of(0, 0), |omega| (omega.abs() / drive - 1.0).abs() < 0.01),
                median(of(1, 0)),
                share(of(2, 0), f64::is_nan),
                share(of(3, 0), |reversals| reversals >= 2.0),
                share(of(4, 0), |t| t < 60.0),
                median(of(4, 1)),
                share(of(5, 0), f64::is_finite),
            ];
            let percent = |share: f64| format!("{:.0} %", 100.0 * share);
            table.row([
                (*name).to_owned(),
                percent(numbers[0]),
                format!("{:.2}", numbers[1]),
                percent(numbers[2]),
                percent(numbers[3]),
                percent(numbers[4]),
                format!("{:.1}", numbers[5]),
                percent(numbers[6]),
            ]);
            held.push(numbers);
        }
        finding.tables.push(table);
        let worst = |k: usize| held.iter().map(|numbers| numbers[k]).fold(1.0, f64::min);
        finding.check("locked at T = 150: share of seeds in the worst variation", worst(0), "", Wanted::AtLeast(0.95));
        let slowest = held.iter().map(|numbers| numbers[1]).fold(f64::INFINITY, f64::min);
        finding.check("C = U(0.5): slowest rolling of all variations", slowest, "rad/s", Wanted::AtLeast(2.0));
        finding.check("homeostatic, rest kept: worst", worst(2), "", Wanted::AtLeast(0.9));
        finding.check("homeostatic, sweeping after a kick: worst", worst(3), "", Wanted::AtLeast(0.9));
        finding.check("homeokinetic, rest left within 60 s: worst", worst(4), "", Wanted::AtLeast(0.95));
        finding.check("upright, toppled within 120 s: worst", worst(6), "", Wanted::AtLeast(0.9));
        let off = |k: usize| {
            let of = |i: usize| held[i][k];
            ((of(1) / of(0) - 1.0).abs()).max((of(2) / of(0) - 1.0).abs())
        };
        finding.check(
            "f64 and fixed point: interval of 3.1 off that of f32 by, at most",
            off(5),
            "",
            Wanted::AtMost(0.1),
        );
        finding
    };
    Claim::new(
        "robustness",
        "all experiments",
        "The key claims hold in every number format and with friction, grip, noise, masses, size and servo varied by a fifth.",
        "Each line of the table is all else as preset (2.2 with lambdaA = 0.001, upright with mu from 1.0), one thing changed.",
        cases,
        judge,
    )
}

/// What is shown of a run of Experiment 3.1.
const TRACED: [&str; 3] = ["omega", "angleC", "angleA"];

fn sweeping(run: &Outcome) -> Figure {
    let time = || Axis::linear("t (s)");
    let omega = Panel::new("", time(), Axis::linear("omega (rad/s)")).line("", Ink::Black, run.curve(0));
    let angles = Panel::new("", time(), Axis::linear("rotation angle (rad)"))
        .line("of C", Ink::Blue, run.curve(1))
        .line("of A", Ink::Vermillion, run.curve(2));
    Figure::stacked(vec![omega, angles], 170.0)
}

/// The tabletop robot over its full sensor chain.
fn tabletop(scale: Scale) -> Claim {
    let seeds = scale.seeds(20, 3);
    let count = seeds.clone().count();
    let lines = [
        "run open-loop --body tabletop --duration 120 --set period=150 --measure rate:phi:60",
        "run closed-loop --body tabletop --duration 120 --measure rate:phi:60",
        "run homeostatic --body tabletop --duration 300 --measure left-rest",
        "run homeokinetic --body tabletop --duration 300 --measure left-rest --measure interval",
        "run homeokinetic --body tabletop --precision fixed --duration 300 --measure left-rest --measure interval",
    ];
    let mut cases = each(&lines, seeds, |line, seed| Case::new(format!("{line} --seed {seed}")));
    let shown = format!("run homeokinetic --body tabletop --duration 120 --seed {} --measure left-rest", scale.seed);
    cases.push(Case::new(shown).traced(&TRACED, 5));
    let judge = move |outcomes: &[Outcome]| {
        let mut finding = Finding::default();
        let groups: Vec<&[Outcome]> = outcomes.chunks(count).collect();
        let of = |group: usize, k: usize| groups[group].iter().map(move |run| run.number(k));
        let locked = share(of(0, 0), |omega| (omega.abs() / (TAU / 3.0) - 1.0).abs() < 0.02);
        finding.check("1.1: locked at T = 150 within 2 %, share of seeds", locked, "", Wanted::AtLeast(0.9));
        finding.check("1.2: C = U(0.5) rolls, median", median(of(1, 0)), "rad/s", Wanted::AtLeast(1.0));
        finding.check("2.2: rest kept for 300 s, share", share(of(2, 0), f64::is_nan), "", Wanted::AtLeast(0.9));
        for (group, format) in [(3, "f32"), (4, "fixed point")] {
            finding.check(
                format!("3.1, {format}: rest left within 60 s, share"),
                share(of(group, 0), |t| t < 60.0),
                "",
                Wanted::AtLeast(0.9),
            );
            finding.tell(format!("3.1, {format}: rest left after, median"), median(of(group, 0)), "s");
            finding.tell(format!("3.1, {format}: reverses every, median"), median(of(group, 1)), "s");
            let sweeping = share(of(group, 1), f64::is_finite);
            finding.check(format!("3.1, {format}: turns back, share"), sweeping, "", Wanted::AtLeast(0.9));
        }
        if let Some(shown) = outcomes.last() {
            finding.figure("Two minutes of Experiment 3.1 on the tabletop robot.", sweeping(shown));
        }
        finding
    };
    Claim::new(
        "tabletop",
        "all experiments",
        "A robot that can be built does the same, through inertial sensor, attitude, encoders and motors.",
        "Body tabletop: 24 cm across, an ICM-42688-P and encoders read at 1 kHz, DC motors on an H-bridge; presets otherwise.",
        cases,
        judge,
    )
}

/// The unmodified flash image.
fn board(scale: Scale) -> Claim {
    let seeds = scale.seeds(3, 1);
    let has_board = cfg!(feature = "virtual-board");
    let line =
        "run homeokinetic --body tabletop --link virtual-board --duration 60 --measure left-rest --measure max:speed";
    let case = |line: &str, seed: u64| Case::new(format!("{line} --seed {seed}")).traced(&TRACED, 5);
    let cases = if has_board { each(&[line], seeds, case) } else { Vec::new() };
    let judge = |outcomes: &[Outcome]| {
        let mut finding = Finding::default();
        if outcomes.is_empty() {
            finding.note("This `barrel` was built without the emulator, whose build takes minutes: `cargo virtual report` has it.");
            return finding;
        }
        let left = || outcomes.iter().map(|run| run.number(0));
        finding.check(
            "3.1: rest left within 60 s, share of seeds",
            share(left(), |t| t < 60.0),
            "",
            Wanted::AtLeast(1.0),
        );
        finding.tell("rest left after, median", median(left()), "s");
        finding.tell("largest |omega|, median", median(outcomes.iter().map(|run| run.number(1))), "rad/s");
        if let Some(shown) = outcomes.first() {
            finding.figure("A minute of the image on the virtual board.", sweeping(shown));
        }
        finding
    };
    Claim::new(
        "virtual-board",
        "Experiment 3.1",
        "The unmodified flash image on a virtual board leaves rest and rolls.",
        "Body tabletop, closed through the emulated pins and buses; only in a `barrel` that was built with the emulator (`cargo virtual report`).",
        cases,
        judge,
    )
}
