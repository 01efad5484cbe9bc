//! What a tick costs on the microcontroller, in instructions as the emulator counts them, against `firmware/budget.toml`. The
//! same image always takes the same, so nothing here is a matter of luck. On the chip an instruction takes a cycle or more.

use barrel_tests::board::{Bench, function, image_in_fixed_point, image_without_logs};
use firmware::timing::SERVO_TICKS;
use hil_sim::virtual_board::CORE_HZ;
use protocol::HostMessage;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// Rules 0 to 3, each by an experiment that uses it.
const RULES: [&str; 4] = ["open-loop", "closed-loop", "homeostatic", "homeokinetic"];
/// Control periods that are looked at, and the seconds that may begin in them.
const PERIODS: usize = 100;
const VITALS: usize = 3;

/// The most that was seen of each.
#[derive(Clone, Copy, Debug, Default)]
struct Costs {
    /// From the encoders' reading to the motors' duties, without a control step: attitude, servo, safety.
    servo: u64,
    /// What a control step adds to that: act and learn.
    brain: u64,
    /// What the two axes' servos are of it: a usual tick armed less one disarmed. The longest of each may have had the clock's own
    /// interrupt in the middle, or not.
    axes: u64,
    /// Framing one telemetry: from the message to the UART.
    frame: u64,
    /// All that the core does in a control period of 20 ms, telemetry on two lines included; the mean, without sleep.
    period: u64,
    /// What of it is there because of the control step: the brain, its telemetry and sending that on two lines.
    step: u64,
}

/// What was seen in so many control periods.
#[derive(Default)]
struct Seen {
    /// The longest servo tick without a control step, and with one.
    servo: u64,
    with_brain: u64,
    /// The median of all servo ticks.
    usual: u64,
    /// The longest framing of a telemetry.
    frame: u64,
    /// In the mean, all instructions of a period, and those of twenty milliseconds in which nothing but the servo runs.
    period: u64,
    servo_alone: u64,
}

fn watch(bench: &mut Bench) -> Seen {
    let mut seen = Seen::default();
    let mut milliseconds: Vec<u64> = Vec::new();
    let mut frames: Vec<u64> = Vec::new();
    let mut all: Vec<u64> = Vec::new();
    for _ in 0..PERIODS {
        let mut ticks: Vec<u64> = Vec::new();
        for _ in 0..SERVO_TICKS {
            bench.pass(1);
            let pins = bench.board().pins();
            milliseconds.push(pins.instructions);
            // One may begin in one millisecond and end in the next.
            ticks.extend(pins.servo_instructions);
            frames.extend(pins.framing_instructions);
        }
        all.extend(&ticks);
        ticks.sort_unstable();
        let [.., servo, with_brain] = ticks[..] else { panic!("there are no servo ticks") };
        seen.servo = seen.servo.max(servo);
        seen.with_brain = seen.with_brain.max(with_brain);
    }
    // Once a second the robot says how it does, which may take longer.
    frames.sort_unstable();
    seen.frame = frames[frames.len() - 1 - VITALS];
    all.sort_unstable();
    seen.usual = all[all.len() / 2];
    seen.period = milliseconds.iter().sum::<u64>() / PERIODS as u64;
    milliseconds.sort_unstable();
    seen.servo_alone = milliseconds[milliseconds.len() / 2] * u64::from(SERVO_TICKS);
    seen
}

fn costs(image: &Path, experiment: &str) -> Costs {
    let mut bench = Bench::start(image, experiment, 1, &[("epsA", 0.1), ("omega0", 2.0)]);
    for _ in 0..50 {
        bench.control_step();
    }
    bench.board().board.watch_framing(function(image, "port::Port::announce")).expect("watched");
    let armed = watch(&mut bench);
    bench.ask(HostMessage::Disarm);
    bench.pass(20);
    let disarmed = watch(&mut bench);
    Costs {
        servo: armed.servo,
        brain: armed.with_brain - armed.servo,
        axes: armed.usual - disarmed.usual,
        frame: armed.frame,
        period: armed.period,
        step: armed.period - armed.servo_alone,
    }
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
                let tick = costs.servo - costs.axes + costs.brain + costs.frame;
                let note = "    attitude, safety, Eq. 12, one frame of telemetry";
                row("brain tick, all of it", &format!("brain-tick-{format}"), tick, note);
                row("one frame of telemetry of it", &format!("frame-{format}"), costs.frame, "");
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
