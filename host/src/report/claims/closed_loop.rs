//! Experiment 1.2: a fixed controller feeds the inclinations back.

use super::super::case::{Case, Outcome};
use super::super::claim::{Claim, Finding, Scale, Table, Wanted};
use super::super::figure::{Axis, Figure, Ink, Marker, Panel};
use super::super::statistics::{largest, share, smallest};
use super::rotation;
use hil_sim::measure::Motion;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

pub fn claims(scale: Scale) -> Vec<Claim> {
    vec![speed(scale), recovery(scale), map(scale)]
}

const GAINS: [f64; 5] = [0.5, 0.75, 1.0, 1.5, 2.0];
/// Speeds that the original simulator rolls at with C = U(φ), rad/s.
const ORIGINAL: [[f64; 2]; 4] = [[0.1, 2.2], [0.3, 4.2], [0.5, 5.8], [0.9, 8.0]];

/// The same with the servo's derivative on the measurement, by the planar equations and by an independent engine.
const LATE: [[f64; 2]; 3] = [[0.1, 1.2], [0.3, 2.1], [0.5, 3.1]];

fn speed(scale: Scale) -> Claim {
    let angles: Vec<f64> = match scale.quick {
        false => (1..=15).map(|i| f64::from(i) / 10.0).collect(),
        true => vec![0.1, 0.3, 0.5, 0.9, 1.3],
    };
    let seed = scale.seed;
    let line = move |c: f64, phi: f64| {
        Case::new(format!(
            "run closed-loop --seed {seed} --duration 120 {} --measure rate:phi:60 --measure mean:chi:60 --measure motion:60",
            rotation(c, phi)
        ))
    };
    let mut cases: Vec<Case> = GAINS.iter().flat_map(|c| angles.iter().map(move |phi| line(*c, *phi))).collect();
    cases.extend(angles.iter().map(|phi| line(1.0, -phi)));
    cases.extend(LATE.iter().map(|[phi, _]| {
        let line = format!(
            "run closed-loop --seed {seed} --duration 120 {} --set derivativeOnMeasurement=1",
            rotation(1.0, *phi)
        );
        Case::new(format!("{line} --measure rate:phi:60"))
    }));
    let judge = move |outcomes: &[Outcome]| {
        let mut finding = Finding::default();
        let (fixed, late) = outcomes.split_at(outcomes.len() - LATE.len());
        let rows: Vec<&[Outcome]> = fixed.chunks(angles.len()).collect();
        let rolls = |run: &Outcome| matches!(run.motion(2), Some(Motion::RollingForth | Motion::Hopping));
        let rolling =
            || GAINS.iter().zip(&rows).flat_map(|(_, row)| angles.iter().zip(row.iter())).filter(|(_, run)| rolls(run));
        finding.check(
            "c = 1: rolls in the sense of phi, share of phi = 0.1 to 1.5",
            share(rows[2], rolls),
            "",
            Wanted::AtLeast(1.0),
        );
        finding.check(
            "phi - chi, at least, of all that roll",
            smallest(rolling().map(|(phi, run)| phi - run.number(1))),
            "rad",
            Wanted::AtLeast(0.0),
        );
        let rising = rows[2].windows(2).map(|pair| pair[1].number(0) - pair[0].number(0));
        finding.check("c = 1: omega rises with phi, least step", smallest(rising), "rad/s", Wanted::AtLeast(0.0));
        let off = angles.iter().zip(rows[2]).filter_map(|(phi, run)| {
            let [_, omega] = ORIGINAL.iter().find(|[at, _]| at == phi)?;
            Some((run.number(0) / omega - 1.0).abs())
        });
        finding.check("c = 1: off the original simulator's speeds by, at most", largest(off), "", Wanted::AtMost(0.1));
        let behind = LATE.iter().zip(late).map(|([_, omega], run)| (run.number(0) / omega - 1.0).abs());
        finding.check(
            "c = 1, derivative on the measurement: off the reference's 1.2, 2.1, 3.1 rad/s by, at most",
            largest(behind),
            "",
            Wanted::AtMost(0.1),
        );
        let mirrored =
            rows[2].iter().zip(rows[5]).map(|(forth, back)| (forth.number(0) + back.number(0)).abs() / forth.number(0));
        finding.check("-phi mirrors the rolling: |sum| / omega at most", largest(mirrored), "", Wanted::AtMost(0.05));
        let resting: Vec<String> = GAINS
            .iter()
            .zip(&rows)
            .flat_map(|(c, row)| angles.iter().zip(row.iter()).map(move |(phi, run)| (c, phi, run)))
            .filter(|(.., run)| run.motion(2) == Some(Motion::Rest))
            .map(|(c, phi, _)| format!("c = {c}, phi = {phi}"))
            .collect();
        if !resting.is_empty() {
            finding.note(format!(
                "A stronger coupling holds the barrel: {} stays at rest. The weights hang at the ends of their ways, where tanh \
                 is flat, and a small rotation of the inclinations no longer moves them.",
                resting.join("; ")
            ));
        }
        let inks = [Ink::Sky, Ink::Green, Ink::Blue, Ink::Orange, Ink::Vermillion];
        let markers = [Marker::Ring, Marker::Triangle, Marker::Disc, Marker::Square, Marker::Diamond];
        let panel = |name: &str, axis: &str, measure: usize| {
            GAINS.iter().zip(&rows).zip(inks.iter().zip(markers)).fold(
                Panel::new(name, Axis::linear("phi (rad)"), Axis::linear(axis)),
                |panel, ((c, row), (ink, marker))| {
                    let points: Vec<[f64; 2]> =
                        angles.iter().zip(row.iter()).map(|(phi, run)| [*phi, run.number(measure)]).collect();
                    panel.line("", *ink, points.clone()).points(format!("c = {c}"), *ink, marker, points)
                },
            )
        };
        let chi =
            panel("turn per control step", "chi (rad)", 1).dashed("chi = phi", Ink::Grey, vec![[0.0, 0.0], [0.5, 0.5]]);
        let omega =
            panel("speed", "omega (rad/s)", 0).points("original, c = 1", Ink::Black, Marker::Cross, ORIGINAL.to_vec());
        finding.figure(
            "Speed and turn per control step against the rotation angle of C. All of chi lies far below phi: the controller leads.",
            Figure::grid(vec![omega, chi], 2, 340.0),
        );
        finding
    };
    Claim::new(
        "rolling-speed",
        "Experiment 1.2",
        "With C = c U(phi) the barrel rolls by itself; the faster the larger phi, and the angle chi that it turns by in a step stays below phi.",
        "c = 0.5 to 2, phi = 0.1 to 1.5 (and -phi for c = 1), from the 45° pose at rest, without sensor noise, so that every seed gives the same; means from 60 to 120 s. The \
         original's speeds were read from its simulator. Its servo takes the derivative of the error, set-point steps \
         included, which leads the loop; with the derivative of the measurement alone the barrel rolls at about half the speed.",
        cases,
        judge,
    )
}

fn recovery(scale: Scale) -> Claim {
    let seed = scale.seed;
    let pushes = [-40.0, -20.0, -10.0, 10.0, 20.0];
    let starts = [-3.0, -6.0, -9.0, -12.0];
    let mut cases: Vec<Case> = pushes
        .iter()
        .map(|push| {
            Case::new(format!(
                "run closed-loop --seed {seed} --duration 120 --push 60:{push}:0.5 --measure rate:phi:40:60 \
                 --measure rate:phi:100:120 --measure settle:omega:60.5:120 --measure min:omega:60:62"
            ))
            .traced(&["omega"], 5)
        })
        .collect();
    cases.extend(starts.iter().map(|omega| {
        Case::new(format!(
            "run closed-loop --seed {seed} --duration 60 --set omega0={omega} --measure rate:phi:40:60 --measure settle:omega:0:60"
        ))
        .traced(&["omega"], 5)
    }));
    let judge = move |outcomes: &[Outcome]| {
        let mut finding = Finding::default();
        let (pushed, reversed) = outcomes.split_at(pushes.len());
        let steady = pushed[0].number(0);
        let off = |run: &Outcome, i: usize| (run.number(i) / steady - 1.0).abs();
        finding.check(
            "pushed: speed afterwards off by, at most",
            largest(pushed.iter().map(|run| off(run, 1))),
            "",
            Wanted::AtMost(0.01),
        );
        finding.check(
            "pushed: settled after, at most",
            largest(pushed.iter().map(|run| run.number(2))),
            "s",
            Wanted::AtMost(20.0),
        );
        finding.check(
            "the push of -20 N·m turns it round: least omega",
            pushed[1].number(3),
            "rad/s",
            Wanted::AtMost(0.0),
        );
        finding.check(
            "started backwards: speed afterwards off by, at most",
            largest(reversed.iter().map(|run| off(run, 0))),
            "",
            Wanted::AtMost(0.01),
        );
        finding.check(
            "started backwards: settled after, at most",
            largest(reversed.iter().map(|run| run.number(1))),
            "s",
            Wanted::AtMost(20.0),
        );
        let inks = [Ink::Vermillion, Ink::Orange, Ink::Purple, Ink::Green, Ink::Blue];
        let after = pushes.iter().zip(pushed).zip(inks).fold(
            Panel::new(
                "pushed at 60 s for 0.5 s",
                Axis::linear("t (s)").within(55.0, 80.0),
                Axis::linear("omega (rad/s)"),
            ),
            |panel, ((push, run), ink)| {
                let curve = run.curve(0).into_iter().filter(|[t, _]| (55.0..80.0).contains(t)).collect();
                panel.line(format!("{push} N·m"), ink, curve)
            },
        );
        let back = starts.iter().zip(reversed).zip(inks).fold(
            Panel::new("started backwards", Axis::linear("t (s)").within(0.0, 25.0), Axis::linear("omega (rad/s)")),
            |panel, ((start, run), ink)| {
                let curve = run.curve(0).into_iter().filter(|[t, _]| *t < 25.0).collect();
                panel.line(format!("from {start} rad/s"), ink, curve)
            },
        );
        finding.figure("The speed comes back.", Figure::grid(vec![after, back], 2, 320.0));
        finding
    };
    Claim::new(
        "recovery",
        "Experiment 1.2",
        "The rolling is stable: pushed, or even started backwards, the barrel comes back to its speed and direction.",
        "C = U(0.5). A push of ±10 to 40 N·m for half a second, or a start at 3 to 12 rad/s backwards; without sensor noise, so that every seed gives the same. Settled: within a tenth of the \
         largest departure.",
        cases,
        judge,
    )
}

/// Numbers to two decimals, so that a line says all of them.
fn draw(random: &mut Pcg32, within: f64) -> f64 {
    let unit = f64::from(random.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    (unit * within * 100.0).round() / 100.0
}

/// Whether a motion with this mean omega is of a kind.
type Fits = Box<dyn Fn(Motion, f64) -> bool>;

fn map(scale: Scale) -> Claim {
    let mut random = Pcg32::seed_from_u64(scale.seed);
    let draws: Vec<[f64; 6]> = (0..scale.pick(300, 120))
        .map(|_| [5.0, 5.0, 5.0, 5.0, 3.0, 3.0].map(|within| draw(&mut random, within)))
        .collect();
    let cases: Vec<Case> = draws
        .iter()
        .map(|[c11, c12, c21, c22, h1, h2]| {
            Case::new(format!(
                "run closed-loop --seed {} --duration 150 --set C11={c11} --set C12={c12} --set C21={c21} --set C22={c22} --set h1={h1} \
                 --set h2={h2} --measure motion:120 --measure rate:phi:120",
                scale.seed
            ))
            .traced(&["omega"], 5)
        })
        .collect();
    let judge = move |outcomes: &[Outcome]| {
        let mut finding = Finding::default();
        let motions: Vec<Option<Motion>> = outcomes.iter().map(|run| run.motion(0)).collect();
        let count = |motion: Motion| motions.iter().filter(|m| **m == Some(motion)).count();
        let mut table = Table::new("What random controllers do", &["motion", "draws", "share"]);
        for motion in Motion::ALL {
            let share = 100.0 * count(motion) as f64 / draws.len() as f64;
            table.row([motion.to_string(), count(motion).to_string(), format!("{share:.0} %")]);
        }
        let round = |way: f64| {
            let turns = |run: &&Outcome| {
                matches!(run.motion(0), Some(Motion::RollingForth | Motion::RollingBack | Motion::Hopping))
                    && run.number(1) * way > 0.0
            };
            outcomes.iter().filter(turns).count()
        };
        let kinds = [count(Motion::Rest), round(1.0), round(-1.0), count(Motion::Rocking)];
        let seen = kinds.iter().filter(|count| **count > 0).count();
        let rolling = share(&motions, |m| matches!(m, Some(Motion::RollingForth | Motion::RollingBack)));
        finding.check("draws that roll without leaving the ground", rolling, "", Wanted::AtLeast(0.05));
        finding.check(
            "seen, of rest, going round either way (rolling or hopping), and rocking",
            seen as f64,
            "of 4",
            Wanted::AtLeast(4.0),
        );
        let hopping = share(&motions, |m| *m == Some(Motion::Hopping));
        finding.note(format!(
            "Of the draws, {:.0} % leave the ground as they roll: with entries of up to 5 the neurons switch between their ends, and the servo, which may pull a weight of 10 N with \
             200 N, throws it. Rolling that stays on the ground takes a smaller C (rolling-speed).",
            100.0 * hopping
        ));
        finding.check("draws that rest", share(&motions, |m| *m == Some(Motion::Rest)), "", Wanted::Within(0.05, 0.95));
        let turning = |m: &Motion| matches!(m, Motion::RollingForth | Motion::RollingBack | Motion::Hopping);
        let senses = draws.iter().zip(outcomes).filter(|(_, run)| run.motion(0).as_ref().is_some_and(turning)).map(
            |(d, run)| {
                // The rotation in C: C21 - C12 > 0 turns by +phi.
                ((d[2] - d[1]) * run.number(1)).signum()
            },
        );
        finding.check(
            "of those that go round, in the sense of C's rotation part",
            share(senses, |sign| sign > 0.0),
            "",
            Wanted::AtLeast(0.8),
        );
        finding.tables.push(table);
        let hops = |way: f64| move |motion: Motion, omega: f64| motion == Motion::Hopping && omega * way > 0.0;
        let is = |kind: Motion| move |motion: Motion, _: f64| motion == kind;
        let looks: [(&str, Ink, Marker, Fits); 8] = [
            ("rest", Ink::Grey, Marker::Cross, Box::new(is(Motion::Rest))),
            ("rolling +", Ink::Blue, Marker::Disc, Box::new(is(Motion::RollingForth))),
            ("rolling -", Ink::Vermillion, Marker::Disc, Box::new(is(Motion::RollingBack))),
            ("hopping +", Ink::Blue, Marker::Ring, Box::new(hops(1.0))),
            ("hopping -", Ink::Vermillion, Marker::Ring, Box::new(hops(-1.0))),
            ("rocking", Ink::Green, Marker::Triangle, Box::new(is(Motion::Rocking))),
            ("sweeping", Ink::Purple, Marker::Diamond, Box::new(is(Motion::Sweeping))),
            ("irregular", Ink::Black, Marker::Square, Box::new(is(Motion::Irregular))),
        ];
        let place = |d: &[f64; 6]| [(d[0] + d[3]) / 2.0, (d[2] - d[1]) / 2.0];
        let map = Panel::new(
            "random C (±5) and h (±3)",
            Axis::linear("c cos phi: the part of C that hangs the weights down"),
            Axis::linear("c sin phi: the part that turns"),
        );
        let panel = looks.iter().fold(map, |panel, (name, ink, marker, fits)| {
            let of =
                draws.iter().zip(outcomes).filter(|(_, run)| run.motion(0).is_some_and(|m| fits(m, run.number(1))));
            let points: Vec<[f64; 2]> = of.map(|(d, _)| place(d)).collect();
            if points.is_empty() { panel } else { panel.points(*name, *ink, *marker, points) }
        });
        finding.figure(
            "Each draw at the rotation that its C contains: rest mostly where it hangs the weights down or the bias holds them; what turns, turns in the sense of the rotation. Many of these \
             controllers throw their weights so hard that the barrel leaves the ground (rings): mg is 10 N, the servo may pull with 200 N.",
            Figure::one(panel, 460.0),
        );
        // Rest would look like motion on a scale of its own.
        let scale = |motion| {
            let axis = Axis::linear("omega (rad/s)");
            if motion == Motion::Rest { axis.within(-1.0, 1.0) } else { axis }
        };
        let examples: Vec<Panel> = Motion::ALL
            .into_iter()
            .flat_map(|motion| {
                let of = outcomes.iter().filter(move |run| run.motion(0) == Some(motion)).take(2);
                of.map(move |run| {
                    let curve = run.curve(0).into_iter().filter(|[t, _]| (130.0..150.0).contains(t)).collect();
                    Panel::new(motion.name(), Axis::linear("t (s)"), scale(motion)).line("", Ink::Blue, curve)
                })
            })
            .collect();
        let shown = examples.len() / 3 * 3;
        let examples: Vec<Panel> = examples.into_iter().take(shown).collect();
        finding.figure("Up to two examples of each kind, 20 s.", Figure::grid(examples, 3, 170.0));
        finding
    };
    Claim::new(
        "random-controllers",
        "Experiment 1.2",
        "Random controllers find rest, rolling either way, rocking, and hopping or irregular motion.",
        "Entries of C uniform in ±5, of h in ±3, to two decimals; 150 s from the 45° pose, the last 30 s are classified. The first that fits: \
         hopping (the centre over 5 mm above its lowest in more than 1 % of the steps), rest (|omega| never over 0.5 rad/s), rolling (a whole turn \
         or more, nine tenths of its way one way), rocking (turns back twice or more within one turn), sweeping (the same over more than a turn), irregular.",
        cases,
        judge,
    )
}
