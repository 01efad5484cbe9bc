//! The robot on its own sensors, in the body: the library as a board, so that what fails here is not the hardware's doing.

use barrel_tests::{BadLine, setup};
use firmware::Robot;
use hil_sim::coupling::Coupling;
use hil_sim::link::{Board, Direction, Embodied, LinkError, SoftBoard};
use hil_sim::measure::Measures;
use hil_sim::replay::{self, Event};
use hil_sim::run::{Run, RunError};
use hil_sim::setup::{BodyKind, Push};
use protocol::message::{FaultCode, Refusal, SafetyState, Transducers};
use protocol::{HostMessage, Id, RobotMessage};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::collections::VecDeque;

fn board() -> SoftBoard<f32> {
    SoftBoard::new(Robot::default())
}

fn start<B: Board>(seed: u64, board: B) -> Run<Embodied<B>> {
    Run::start(setup("homeokinetic", BodyKind::Tabletop, seed, &[]), Embodied::new(board)).expect("the run starts")
}

#[test]
fn it_homes_arms_leaves_rest_and_sweeps() {
    for seed in 1..=3 {
        let mut run = start(seed, board());
        let mut measures = Measures::default();
        let mut expected = 0.0;
        while run.time() < 180.0 {
            let record = run.step().expect("goes on");
            assert!((record.brain.t - expected).abs() < 1e-9, "no step is missing");
            expected += 0.02;
            measures.add(&record);
        }
        let left = measures.left_rest().unwrap_or(f64::INFINITY);
        assert!(left < 60.0, "seed {seed}: left rest at {left} s");
        assert!(measures.reversals().len() >= 4, "seed {seed}: turned back at {:?}", measures.reversals());
    }
}

#[test]
fn the_record_shows_the_world_at_the_instant_the_sensors_were_read() {
    let mut setup = setup("homeokinetic", BodyKind::Tabletop, 2, &[("sensorNoise", 0.0)]);
    setup.pushes.push(Push { start: 1.0, torque: 0.5, force: 0.0, seconds: 0.5 });
    let mut run = Run::start(setup, Embodied::new(board())).expect("starts");
    let (mut errors, mut late, mut fastest) = (Vec::new(), Vec::new(), 0.0_f64);
    let mut before = None;
    for _ in 0..500 {
        let record = run.step().expect("goes on");
        // A lying barrel's inclinations are sine and cosine of its roll.
        let roll = f64::from(record.brain.x[0]).atan2(f64::from(record.brain.x[1]));
        let error = |phi: f64| (roll + phi).sin().abs();
        errors.push(error(record.plant.phi));
        late.push(error(before.unwrap_or(record.plant.phi)));
        before = Some(record.plant.phi);
        fastest = fastest.max(record.plant.omega.abs());
    }
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    assert!(fastest > 3.0, "it rolled at {fastest:.1} rad/s at most");
    assert!(mean(&errors) < 0.02, "the roll is {:.4} rad off", mean(&errors));
    assert!(mean(&late) > 1.5 * mean(&errors), "a step late would show: {:.4} and {:.4}", mean(&late), mean(&errors));
}

#[test]
fn it_homes_and_starts_whatever_range_its_brain_is_given() {
    for range in [0.02, 0.05, 0.1] {
        let setup = setup("homeokinetic", BodyKind::Tabletop, 1, &[("range", range)]);
        let mut run = Run::start(setup, Embodied::new(board())).unwrap_or_else(|why| panic!("range {range}: {why}"));
        let mut farthest = 0.0_f64;
        for _ in 0..500 {
            let record = run.step().expect("goes on");
            farthest = record.plant.weights.iter().fold(farthest, |farthest, s| farthest.max(s.abs()));
        }
        assert_eq!(run.state(), SafetyState::Armed, "range {range}");
        // What the rail has no room for the servo cuts off.
        let reach = range.min(0.060);
        assert!(farthest > 0.5 * reach && farthest < reach + 0.005, "range {range}: a weight was at {farthest:.4} m");
    }
}

#[test]
fn a_barrel_that_starts_rolling_is_felt_to_roll_before_it_is_let_go_and_starts_without_a_jerk() {
    for omega0 in [0.2, 1.0, -5.0, 20.0] {
        let setup = setup("homeokinetic", BodyKind::Tabletop, 1, &[("omega0", omega0), ("sensorNoise", 0.0)]);
        let phi0 = setup.values.get(Id::Phi0);
        let mut run = Run::start(setup, Embodied::new(board())).expect("starts");
        for step in 0..6 {
            let record = run.step().expect("goes on");
            if step == 0 {
                assert_eq!(record.plant.omega, omega0);
                assert!((record.plant.phi - phi0).abs() < 1e-12, "{omega0} rad/s: starts at {}", record.plant.phi);
            }
            let roll = f64::from(record.brain.x[0]).atan2(f64::from(record.brain.x[1]));
            let error = (roll + record.plant.phi).sin();
            assert!(error.abs() < 0.005, "{omega0} rad/s: the roll is {error:.4} rad off in step {step}");
        }
    }
}

#[test]
fn a_robot_that_cannot_be_armed_says_which_fault_it_is_in() {
    // Faster than its gyroscope can follow.
    for omega0 in [40.0, -100.0] {
        let setup = setup("homeokinetic", BodyKind::Tabletop, 1, &[("omega0", omega0)]);
        let Err(RunError::Link(LinkError::Broken(why))) = Run::start(setup, Embodied::new(board())) else {
            panic!("{omega0} rad/s: it was started, or it was not said why not")
        };
        assert!(why.contains("in Fault: a sensor reads what no barrel can do"), "{why}");
    }
}

/// A board whose bytes take their time on the line.
struct Slow {
    board: SoftBoard<f32>,
    /// On their way.
    sent: VecDeque<u8>,
}

impl Board for Slow {
    fn tick(&mut self, sensed: &Transducers, to: &[u8], from: &mut Vec<u8>) -> Result<[f32; 2], LinkError> {
        let mut said = Vec::new();
        let duty = self.board.tick(sensed, to, &mut said)?;
        self.sent.extend(said);
        // 460 800 baud.
        from.extend(self.sent.drain(..self.sent.len().min(46)));
        Ok(duty)
    }
}

#[test]
fn telemetry_that_takes_two_milliseconds_on_the_line_is_recorded_with_the_world_as_it_was() {
    let setup = setup("homeokinetic", BodyKind::Tabletop, 1, &[("omega0", 20.0), ("sensorNoise", 0.0)]);
    let board = Slow { board: board(), sent: VecDeque::new() };
    let mut run = Run::start(setup, Embodied::new(board)).expect("starts");
    for step in 0..6 {
        let record = run.step().expect("goes on");
        let roll = f64::from(record.brain.x[0]).atan2(f64::from(record.brain.x[1]));
        let error = (roll + record.plant.phi).sin();
        assert!(error.abs() < 0.005, "the roll is {error:.4} rad off in step {step}");
    }
}

#[test]
fn one_seed_gives_one_run() {
    let records = |seed| {
        let mut run = start(seed, board());
        (0..1000).map(|_| run.step().expect("goes on")).collect::<Vec<_>>()
    };
    assert_eq!(records(5), records(5));
    assert_ne!(records(5), records(6));
}

#[test]
fn its_log_replays_bit_for_bit() {
    let mut run = start(4, board());
    for k in 0..600 {
        if k == 300 {
            run.set(Id::EpsC, 0.2).expect("in range");
        }
        run.step().expect("goes on");
    }
    let mut frames = Vec::new();
    run.link_mut().drain_frames(&mut |direction: Direction, bytes: &[u8]| frames.push((direction, bytes.to_vec())));
    let mut steps = 0;
    let verdict = replay::replay::<f32>(frames.iter().map(|(d, b)| (*d, &b[..])), &[], |event| {
        steps = if matches!(event, Event::Restart) { 0 } else { steps + 1 };
    });
    assert!(verdict.is_identical(), "{verdict:?}");
    assert!(steps >= 600, "{steps} steps");
    let other = replay::replay::<f32>(frames.iter().map(|(d, b)| (*d, &b[..])), &[(Id::EpsA, 0.2)], |_| {});
    assert!(!other.is_identical(), "another learning rate must show");
}

/// A board at the end of a line on which not every byte arrives, either way.
struct Lossy<L> {
    board: SoftBoard<f32>,
    line: L,
}

impl<L: FnMut(&[u8]) -> Vec<u8>> Board for Lossy<L> {
    fn tick(&mut self, sensed: &Transducers, to: &[u8], from: &mut Vec<u8>) -> Result<[f32; 2], LinkError> {
        let to = (self.line)(to);
        let mut said = Vec::new();
        let duty = self.board.tick(sensed, &to, &mut said)?;
        from.extend((self.line)(&said));
        Ok(duty)
    }
}

/// A line that loses and changes every so many-th byte.
fn bad(every: u32) -> impl FnMut(&[u8]) -> Vec<u8> {
    let mut line = BadLine::losing(every);
    move |bytes| line.carry(bytes)
}

/// A line that loses one byte in so many, by chance.
fn leaky(one_in: u32, seed: u64) -> impl FnMut(&[u8]) -> Vec<u8> {
    let mut random = Pcg32::seed_from_u64(seed);
    move |bytes| bytes.iter().filter(|_| !random.next_u32().is_multiple_of(one_in)).copied().collect()
}

#[test]
fn bytes_lost_on_the_line_cost_steps_of_the_record_and_nothing_of_the_run() {
    let mut clean = start(1, board());
    let mut lossy = start(1, Lossy { board: board(), line: bad(1009) });
    let kept: Vec<_> = (0..400).map(|_| clean.step().expect("goes on")).collect();
    let mut missing = 0;
    let mut last = -0.02;
    while lossy.time() < 7.9 {
        let record = lossy.step().expect("goes on");
        missing += ((record.brain.t - last) / 0.02).round() as u32 - 1;
        last = record.brain.t;
        let k = (record.brain.t / 0.02).round() as usize;
        // Not to the bit: the noise of the chips has run on while requests were repeated. But every step says so.
        assert_eq!(record.brain.t, kept[k].brain.t);
    }
    assert!(missing > 5, "{missing} steps missing: the line was not bad enough to say anything");
    assert!(lossy.link_mut().lost() >= missing, "{} counted, {missing} missing", lossy.link_mut().lost());
}

#[test]
fn a_line_that_loses_half_a_percent_of_its_bytes_is_good_enough_to_home_and_to_start() {
    fn homes_and_starts(line: impl FnMut(&[u8]) -> Vec<u8>) {
        let mut run = start(1, Lossy { board: board(), line });
        let mut last = -1.0;
        for _ in 0..100 {
            let record = run.step().expect("goes on");
            assert!(record.brain.t > last, "time goes back");
            last = record.brain.t;
        }
        assert_eq!(run.state(), SafetyState::Armed);
        let lost = run.link_mut().lost();
        assert!(lost > 200, "{lost} frames lost: the line was not bad enough to say anything");
        run.finish().expect("it is disarmed");
    }
    for every in [151, 180, 199, 200, 201, 250] {
        homes_and_starts(bad(every));
    }
    for seed in 1..=10 {
        homes_and_starts(leaky(200, seed));
    }
}

/// A board whose inertial sensor falls silent, or never spoke.
struct Blind {
    robot: Robot<f32>,
}

#[test]
fn a_bare_board_can_still_be_put_into_a_simulated_body() {
    let mut blind = Blind { robot: Robot::default() };
    let mut ask = |message: HostMessage| {
        for _ in 0..20 {
            let tick = blind.robot.servo_tick(&firmware::robot::Senses {
                stop_loop_open: true,
                battery_mv: Some(0),
                ..firmware::robot::Senses::default()
            });
            assert_eq!((tick.outputs.duty(), tick.powered), ([0.0; 2], false));
        }
        let mut answer = None;
        blind.robot.handle(&message, &mut |reply| answer = Some(*reply));
        answer.expect("an answer")
    };
    assert_eq!(ask(HostMessage::Arm), RobotMessage::Refused(Refusal::NotHomed));
    let fault = RobotMessage::State(SafetyState::Fault(FaultCode::EmergencyStop));
    assert_eq!(ask(HostMessage::Disarm), fault, "no stop loop, no chips: it says so");
    assert_eq!(ask(HostMessage::SimulatedSensors(true)), fault);
    assert_eq!(ask(HostMessage::ClearFault), RobotMessage::State(SafetyState::Disarmed));
    assert_eq!(ask(HostMessage::Arm), RobotMessage::State(SafetyState::Armed));
    assert_eq!(ask(HostMessage::SimulatedSensors(false)), RobotMessage::Refused(Refusal::WhileArmed));
}

/// A board whose motors pull nothing.
struct Limp(SoftBoard<f32>);

impl Board for Limp {
    fn tick(&mut self, sensed: &Transducers, to: &[u8], from: &mut Vec<u8>) -> Result<[f32; 2], LinkError> {
        self.0.tick(sensed, to, from).map(|_| [0.0; 2])
    }
}

#[test]
fn motors_that_pull_nothing_are_found_by_homing() {
    let setup = setup("homeokinetic", BodyKind::Tabletop, 1, &[]);
    let Err(RunError::Link(LinkError::Broken(why))) = Run::start(setup, Embodied::new(Limp(board()))) else {
        panic!("a limp robot was started")
    };
    assert!(why.contains("an axis does not end where it should"), "{why}");
}
