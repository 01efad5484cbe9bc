//! What a tick costs on the microcontroller, in instructions as the emulator counts them, against `firmware/budget.toml`. The
//! same image always takes the same, so nothing here is a matter of luck. On the chip an instruction takes a cycle or more.

use barrel_tests::board::{Bench, image_in_fixed_point, image_without_logs};
use firmware::timing::SERVO_TICKS;
use hil_sim::virtual_board::CORE_HZ;
use protocol::HostMessage;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// Rules 0 to 3, each by an experiment that uses it.
const RULES: [&str; 4] = ["open-loop", "closed-loop", "homeostatic", "homeokinetic"];
/// Control periods that are looked at.
const PERIODS: usize = 100;

/// The most that was seen of each.
#[derive(Clone, Copy, Debug, Default)]
struct Costs {
    /// From the encoders' reading to the motors' duties, without a control step: attitude, servo, safety.
    servo: u64,
    /// What a control step adds to that: act and learn.
    brain: u64,
    /// What the two axes' servos are of it: armed less disarmed.
    axes: u64,
    /// All that the core does in a control period of 20 ms, telemetry on two lines included; the mean, without sleep.
    period: u64,
    /// What of it is there because of the control step: the brain, its telemetry and sending that on two lines.
    step: u64,
}

/// So many control periods: the longest servo tick without a control step, the longest with one, and, in the mean, all
/// instructions of a period and those of twenty milliseconds in which nothing but the servo runs.
fn watch(bench: &mut Bench) -> (u64, u64, u64, u64) {
    let (mut servo, mut brain) = (0, 0);
    let mut milliseconds: Vec<u64> = Vec::new();
    for _ in 0..PERIODS {
        let mut ticks: Vec<u64> = Vec::new();
        for _ in 0..SERVO_TICKS {
            bench.pass(1);
            let pins = &bench.board().pins;
            milliseconds.push(pins.instructions);
            ticks.push(pins.servo_instructions.expect("a servo tick every millisecond"));
        }
        ticks.sort_unstable();
        let [.., longest_servo, with_brain] = ticks[..] else { unreachable!("twenty of them") };
        servo = servo.max(longest_servo);
        brain = brain.max(with_brain);
    }
    let all = milliseconds.iter().sum::<u64>() / PERIODS as u64;
    milliseconds.sort_unstable();
    (servo, brain, all, milliseconds[milliseconds.len() / 2] * u64::from(SERVO_TICKS))
}

fn costs(image: &Path, experiment: &str) -> Costs {
    let mut bench = Bench::start(image, experiment, 1, &[("epsA", 0.1), ("omega0", 2.0)]);
    for _ in 0..50 {
        bench.control_step();
    }
    let (servo, brain, period, servo_alone) = watch(&mut bench);
    bench.ask(HostMessage::Disarm);
    bench.pass(20);
    let (disarmed, ..) = watch(&mut bench);
    Costs { servo, brain: brain - servo, axes: servo - disarmed, period, step: period - servo_alone }
}

fn budget(name: &str) -> u64 {
    let file: toml::Table = include_str!("../firmware/budget.toml").parse().expect("a table");
    let value = file["instructions"].get(name).and_then(toml::Value::as_integer);
    value.unwrap_or_else(|| panic!("firmware/budget.toml has no {name}")).unsigned_abs()
}

#[test]
fn ticks_keep_to_their_budget() {
    let mut table = format!("\n    {:<34}{:>12}{:>9}\n", "", "instructions", "budget");
    let mut over = Vec::new();
    for (format, image) in [("f32", image_without_logs()), ("fixed", image_in_fixed_point())] {
        let mut row = |what: &str, name: &str, cost: u64, note: &str| {
            let most = budget(name);
            let mark = if cost > most { "  OVER" } else { "" };
            writeln!(table, "    {:<34}{cost:>12}{most:>9}{mark}{note}", format!("{format}, {what}"))
                .expect("a string");
            over.extend((cost > most).then(|| format!("{format}, {what}: {cost} of {most}")));
        };
        for rule in RULES {
            let costs = costs(&image, rule);
            row(&format!("brain, {rule}"), &format!("brain-{format}-{rule}"), costs.brain, "");
            if rule == "homeokinetic" {
                let awake = costs.period as f64 / (CORE_HZ as f64 / 50.0) * 100.0;
                row("servo tick", &format!("servo-tick-{format}"), costs.servo, "");
                row("the two axes of it", &format!("axes-{format}"), costs.axes, "");
                let note = format!("    {awake:.2} % awake at {} MHz", CORE_HZ / 1_000_000);
                row("step, with its telemetry", &format!("step-{format}"), costs.step, "");
                row("control period, all in all", &format!("control-period-{format}"), costs.period, &note);
            }
        }
    }
    // Past the test harness, which keeps what is printed to itself: the table is for whoever reads the test run.
    std::io::stderr().write_all(table.as_bytes()).expect("written");
    assert!(over.is_empty(), "{over:#?}");
}
