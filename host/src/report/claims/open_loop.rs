//! Experiment 1.1: the weights are driven by a sine, and nothing comes back.

use super::super::case::{Case, Outcome};
use super::super::claim::{Claim, Finding, Scale, Table, Wanted};
use super::super::figure::{Axis, Figure, Ink, Marker, Panel};
use super::super::statistics::{largest, mean, smallest};
use super::each;
use core::f64::consts::TAU;
use hil_sim::run::time;

pub fn claims(scale: Scale) -> Vec<Claim> {
    vec![locking(scale), doubling(scale), noise(scale)]
}

/// Angular velocity of a drive with this period in control steps, rad/s.
fn drive(period: f64) -> f64 {
    TAU / (period * time(1))
}

const SLOW: [f64; 4] = [300.0, 200.0, 150.0, 100.0];
const FAST: [f64; 3] = [50.0, 25.0, 10.0];
/// What the original simulator rolls at under these, with friction, from rest, rad/s.
const ORIGINAL: [f64; 3] = [1.5, 3.4, 7.7];

fn locking(scale: Scale) -> Claim {
    let seed = scale.seed;
    let periods =
        [400.0, 300.0, 200.0, 150.0, 125.0, 100.0, 90.0, 80.0, 75.0, 60.0, 50.0, 40.0, 30.0, 25.0, 20.0, 15.0, 10.0];
    let case = move |period: f64, friction: f64| {
        Case::new(format!(
            "run open-loop --seed {seed} --duration 300 --set period={period} --set friction={friction} \
             --measure rate:phi:120 --measure sd:omega:120"
        ))
    };
    let portrait = |period: f64| {
        Case::new(format!("run open-loop --seed {seed} --duration 140 --set period={period} --measure rate:phi:120"))
            .traced(&["x1", "x2", "y1", "omega"], 1)
    };
    let mut cases: Vec<Case> = [0.1, 0.0].iter().flat_map(|f| periods.map(|period| case(period, *f))).collect();
    cases.extend([portrait(200.0), portrait(50.0)]);
    let judge = move |outcomes: &[Outcome]| {
        let mut finding = Finding::default();
        let ratio = |i: usize, period: f64| outcomes[i].number(0).abs() / drive(period);
        let of = |f: usize, wanted: &[f64]| -> Vec<f64> {
            let place = |period: &f64| periods.iter().position(|p| p == period).unwrap_or(0);
            wanted.iter().map(|period| ratio(f * periods.len() + place(period), *period)).collect()
        };
        for (f, name) in ["with friction 0.1", "without friction"].into_iter().enumerate() {
            let slow = of(f, &SLOW);
            let off = largest(slow.iter().map(|ratio| (ratio - 1.0).abs()));
            finding.check(
                format!("{name}: |omega / drive - 1| at most, T = 300 to 100"),
                off,
                "",
                Wanted::AtMost(0.01),
            );
        }
        let fast = of(0, &FAST);
        let near = smallest(fast.iter().map(|ratio| (ratio - 1.0).abs()));
        finding.check(
            "with friction: |omega / drive - 1| at least, T = 50, 25 and 10, from rest",
            near,
            "",
            Wanted::AtLeast(0.2),
        );
        let spread = |f: usize| {
            let i = periods.iter().position(|p| *p == 300.0).unwrap_or(0) + f * periods.len();
            outcomes[i].number(1) / outcomes[i].number(0).abs()
        };
        finding.tell("sd / mean of omega at T = 300 with friction", spread(0), "");
        finding.check(
            "sd / mean of omega at T = 300 without friction: it locks, and oscillates",
            spread(1),
            "",
            Wanted::AtLeast(0.3),
        );
        let mut table = Table::new(
            "Fast drives, from rest, with friction 0.1: mean omega (rad/s)",
            &["period (steps)", "drive", "here", "original simulator"],
        );
        for (period, original) in FAST.iter().zip(ORIGINAL) {
            let omega = of(0, &[*period])[0] * drive(*period);
            table.row([
                period.to_string(),
                format!("{:.2}", drive(*period)),
                format!("{omega:.2}"),
                original.to_string(),
            ]);
        }
        finding.tables.push(table);
        let [t50, t25] = [of(0, &[50.0])[0], of(0, &[25.0])[0]];
        finding.note(format!(
            "Where the lock is lost it is not chaos that follows, but often a lock at a simple ratio: with friction, from rest, T = 50 rolls at {t50:.3} \
             of the drive's frequency, T = 25 at {t25:.3}. Without friction some fast drives catch the barrel even from rest: T = 25 rolls at {:.3}.",
            of(1, &[25.0])[0]
        ));
        let points = |f: usize| -> Vec<[f64; 2]> {
            periods
                .iter()
                .enumerate()
                .map(|(i, p)| [drive(*p), outcomes[f * periods.len() + i].number(0).abs()])
                .collect()
        };
        let span = [drive(400.0), drive(10.0)];
        let axis = || Axis::log("angular frequency of the drive (rad/s)");
        finding.figure(
            "Angular velocity of the barrel against that of the drive, from rest; on the line the rolling is locked.",
            Figure::one(
                Panel::new("locking", axis(), Axis::log("mean omega (rad/s)"))
                    .dashed("omega = drive", Ink::Grey, vec![[span[0], span[0]], [span[1], span[1]]])
                    .points("friction 0.1", Ink::Blue, Marker::Disc, points(0))
                    .points("no friction", Ink::Vermillion, Marker::Ring, points(1)),
                360.0,
            ),
        );
        let [locked, lost] = [&outcomes[2 * periods.len()], &outcomes[2 * periods.len() + 1]];
        let tail = |points: Vec<[f64; 2]>| points[points.len() * 6 / 7..].to_vec();
        let portrait = |name: &str, outcome: &Outcome| {
            Panel::new(name, Axis::linear("motor value y1"), Axis::linear("inclination x1")).line(
                "",
                Ink::Blue,
                tail(outcome.portrait(0, 2).into_iter().map(|[x, y]| [y, x]).collect()),
            )
        };
        let phase = |name: &str, outcome: &Outcome| {
            Panel::new(name, Axis::linear("inclination x1"), Axis::linear("omega (rad/s)").within(-3.5, 1.5)).line(
                "",
                Ink::Vermillion,
                tail(outcome.portrait(0, 3)),
            )
        };
        finding.figure(
            "Phase portraits over 20 s: locked to the drive, one turn a period (T = 200), and where that lock is lost (T = 50).",
            Figure::grid(
                vec![
                    portrait("T = 200", locked),
                    phase("T = 200", locked),
                    portrait("T = 50", lost),
                    phase("T = 50", lost),
                ],
                2,
                260.0,
            ),
        );
        finding
    };
    Claim::new(
        "locking",
        "Experiment 1.1, Video 1.1",
        "A slow sine on both weights, a quarter period apart, takes the barrel with it, one turn a period; with friction a fast one loses it.",
        "Each period from rest, 300 s, amplitude 1, without sensor noise; mean omega from 120 s on, by the angle turned. Phaseshift \
         1 is a quarter period (docs/equations.md).",
        cases,
        judge,
    )
}

/// The periods of the sequence, and how long each lasts, s.
const SEQUENCE: [f64; 5] = [400.0, 200.0, 100.0, 50.0, 25.0];
const STAGE: f64 = 80.0;

fn doubling(scale: Scale) -> Claim {
    let stage = |i: usize| i as f64 * STAGE;
    let switches: String = (1..SEQUENCE.len()).map(|i| format!(" --at {}:period={}", stage(i), SEQUENCE[i])).collect();
    let end = stage(SEQUENCE.len());
    let measures: String = (0..=SEQUENCE.len())
        .map(|i| format!(" --measure rate:phi:{}:{}", stage(i) + STAGE / 2.0, stage(i) + STAGE))
        .collect();
    let line = format!(
        "run open-loop --seed {} --duration {} --set period={}{switches} --push {end}:-40:0.5{measures}",
        scale.seed,
        end + STAGE,
        SEQUENCE[0]
    );
    let judge = move |outcomes: &[Outcome]| {
        let run = &outcomes[0];
        let mut finding = Finding::default();
        let ratio = |i: usize| run.number(i).abs() / drive(SEQUENCE[i.min(SEQUENCE.len() - 1)]);
        let off = largest((0..4).map(|i| (ratio(i) - 1.0).abs()));
        finding.check("T = 400, 200, 100, 50: |omega / drive - 1| at most", off, "", Wanted::AtMost(0.01));
        finding.check("T = 25: omega / drive, lock lost", ratio(4), "", Wanted::AtMost(0.8));
        finding.check("T = 25 after the push: omega / drive, locked again", ratio(5), "", Wanted::Within(0.99, 1.01));
        let steps: Vec<[f64; 2]> = (0..=SEQUENCE.len())
            .flat_map(|i| {
                let omega = -drive(SEQUENCE[i.min(SEQUENCE.len() - 1)]);
                [[stage(i), omega], [stage(i) + STAGE, omega]]
            })
            .collect();
        finding.figure(
            "The drive's frequency is doubled every 80 s; at 400 s a push of 40 N·m for half a second, which leaves the picture.",
            Figure::one(
                Panel::new(
                    "frequency doubling",
                    Axis::linear("t (s)"),
                    Axis::linear("omega (rad/s)").within(-20.0, 5.0),
                )
                .line("barrel", Ink::Blue, run.curve(0))
                .dashed("drive", Ink::Vermillion, steps)
                .marks("push", vec![end]),
                320.0,
            ),
        );
        finding
    };
    Claim::new(
        "doubling",
        "Experiment 1.1",
        "Doubling the drive's frequency step by step, the lock holds, then is lost; a push to its speed brings it back.",
        "One run: T = 400, 200, 100, 50, 25 control steps for 80 s each, then a push; mean omega in the second half of each stage.",
        vec![Case::new(line).traced(&["omega"], 5)],
        judge,
    )
}

const COLORS: [f64; 5] = [0.0, 10.0, 50.0, 200.0, 1000.0];

fn noise(scale: Scale) -> Claim {
    let seeds = scale.seeds(10, 3);
    let count = seeds.clone().count();
    let line = |color: f64, seed: u64| {
        Case::new(format!(
            "run open-loop --seed {seed} --duration 300 --set amplitude=0 --set noise=1 --set color={color} \
             --measure rate:phi --measure mean:speed --measure reversals"
        ))
        .traced(&["omega"], 5)
    };
    let cases = each(&COLORS, seeds, line);
    let judge = move |outcomes: &[Outcome]| {
        let mut finding = Finding::default();
        let mut table = Table::new(
            "Coloured noise instead of a sine",
            &[
                "correlation time (steps)",
                "mean |omega| (rad/s)",
                "turning back, every (s)",
                "net omega (rad/s, rms over seeds)",
            ],
        );
        let mut worst: f64 = 0.0;
        for (color, runs) in COLORS.iter().zip(outcomes.chunks(count)) {
            let speed = mean(runs.iter().map(|run| run.number(1)));
            let interval = 300.0 / mean(runs.iter().map(|run| run.number(2)));
            let net = (runs.iter().map(|run| run.number(0).powi(2)).sum::<f64>() / count as f64).sqrt();
            worst = worst.max(net / speed);
            table.row([format!("{color}"), format!("{speed:.2}"), format!("{interval:.1}"), format!("{net:.2}")]);
        }
        finding.check("net over mean speed, at most over the colours: it goes nowhere", worst, "", Wanted::AtMost(0.5));
        finding.tables.push(table);
        let panel = |color: usize| {
            let run = &outcomes[color * count];
            Panel::new(
                format!("correlation time {} steps", COLORS[color]),
                Axis::linear("t (s)"),
                Axis::linear("omega (rad/s)"),
            )
            .line("", Ink::Blue, run.curve(0).into_iter().filter(|[t, _]| *t <= 60.0).collect())
        };
        finding.figure("A minute under noise of two colours.", Figure::stacked(vec![panel(1), panel(3)], 180.0));
        finding
    };
    Claim::new(
        "noise-drive",
        "Experiment 1.1",
        "Coloured noise moves the barrel, but no rolling comes of it.",
        "Standard deviation 1 before the motor values are clipped to ±1, amplitude of the sine 0; 300 s a run.",
        cases,
        judge,
    )
}
