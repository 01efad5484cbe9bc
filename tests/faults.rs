//! What goes wrong on the board, and what becomes of it: the motors are off, the robot says why, and it can be taken into use
//! again.

use barrel_tests::BadLine;
use barrel_tests::board::{Bench, image, image_without_logs, variable};
use firmware::robot::BATTERY_LOW;
use hil_sim::virtual_board::Trouble;
use protocol::message::{FaultCode, Refusal, ResetCause, SafetyState};
use protocol::{HostMessage, RobotMessage};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// A robot that rolls under a fixed controller: its motors always have something to do.
fn rolling() -> Bench {
    let mut bench = Bench::start(&image(), "closed-loop", 1, &[("omega0", 2.0)]);
    for _ in 0..50 {
        bench.control_step();
    }
    bench.board().driven = 0;
    bench.pass(20);
    assert_eq!(bench.board().driven, 20, "it is driven all the time");
    bench
}

/// The motors are off and stay so until somebody clears the fault, homes where that is needed, and arms.
fn stays_off(bench: &mut Bench, fault: FaultCode, homed: bool) {
    bench.board().driven = 0;
    bench.pass(200);
    assert_eq!(
        bench.ask(HostMessage::Arm),
        RobotMessage::Refused(if homed { Refusal::InFault } else { Refusal::NotHomed })
    );
    assert_eq!(bench.hello().state, SafetyState::Fault(fault));
    assert_eq!(bench.board().driven, 0, "driven in {fault:?}");
    assert_eq!(bench.ask(HostMessage::ClearFault), RobotMessage::State(SafetyState::Disarmed));
    bench.pass(50);
    assert_eq!(bench.hello().state, SafetyState::Disarmed);
    assert_eq!(bench.board().driven, 0, "driven while Disarmed");
    if homed {
        assert_eq!(bench.ask(HostMessage::Arm), RobotMessage::State(SafetyState::Armed));
        bench.pass(20);
        assert!(bench.board().driven > 10, "it does not go on");
    }
}

/// Waits for a reset and returns after how many milliseconds it came.
fn reset_within(bench: &mut Bench, milliseconds: u32) -> u32 {
    let resets = bench.board().pins().resets;
    for passed in 1..=milliseconds {
        bench.pass(1);
        if bench.board().pins().resets > resets {
            assert_eq!(bench.board().pins().resets, resets + 1);
            return passed;
        }
    }
    panic!("no reset within {milliseconds} ms");
}

#[test]
fn a_servo_that_hangs_is_reset_by_the_watchdog() {
    let mut bench = rolling();
    bench.board().board.trouble(Trouble::StopTime).expect("stops");
    let after = reset_within(&mut bench, 12);
    assert!((3..=10).contains(&after), "the watchdog came after {after} ms");
    assert_eq!(bench.hello().reset, ResetCause::Watchdog);
    stays_off(&mut bench, FaultCode::Watchdog, false);
}

#[test]
fn a_tick_that_comes_too_late_takes_the_motors_away_and_is_reported() {
    let mut bench = rolling();
    let resets = bench.board().pins().resets;
    for _ in 0..2 {
        bench.board().board.trouble(Trouble::StopTime).expect("stops");
        bench.pass(2);
        bench.board().board.trouble(Trouble::ResumeTime).expect("goes on");
        bench.pass(2);
        stays_off(&mut bench, FaultCode::MissedDeadline, true);
    }
    bench.pass(1000);
    assert!(bench.vitals().overruns >= 2, "{:?}", bench.vitals());
    assert_eq!(bench.board().pins().resets, resets, "the watchdog has no part in it");
}

#[test]
fn a_supply_that_sags_takes_the_motors_away_and_a_reset_that_comes_of_it_is_reported() {
    let mut bench = rolling();
    let good = bench.board().around.supply_mv;
    bench.board().around.supply_mv = 2700;
    bench.pass(2);
    bench.board().driven = 0;
    bench.pass(20);
    assert_eq!(bench.board().driven, 0, "driven on what is left");
    bench.board().around.supply_mv = good;
    bench.pass(2);
    stays_off(&mut bench, FaultCode::BrownOut, true);
    bench.board().board.reset().expect("reset");
    assert_eq!(bench.hello().reset, ResetCause::Pin, "the supply has recovered since");

    bench.board().around.supply_mv = 2700;
    bench.pass(5);
    bench.board().board.reset().expect("reset");
    bench.board().around.supply_mv = good;
    assert_eq!(bench.hello().reset, ResetCause::BrownOut);
    stays_off(&mut bench, FaultCode::BrownOut, false);
}

/// On the chip the core takes its non-maskable interrupt at once, which ends as a panic does; the emulator has none.
#[test]
fn a_clock_that_fails_takes_the_motors_outputs_away_by_itself() {
    let mut bench = rolling();
    bench.board().board.trouble(Trouble::FailClock).expect("stops");
    for _ in 0..3 {
        bench.pass(1);
        assert_eq!(bench.board().pins().pwm, [0.0; 2]);
    }
}

#[test]
fn a_core_fault_takes_the_motors_away_at_once_and_is_reported() {
    let mut bench = rolling();
    // The servo's task is overwritten, as by a stray pointer: its next poll is nothing that can be executed.
    for address in variable(&image(), "tasks::servo::servo::POOL").step_by(4).take(8) {
        bench.board().board.trouble(Trouble::Poke(address, 0xFFFF_FFFF)).expect("there is memory");
    }
    assert!(reset_within(&mut bench, 5) <= 2, "it went on for milliseconds");
    bench.board().driven = 0;
    assert_eq!(bench.hello().reset, ResetCause::HardFault);
    stays_off(&mut bench, FaultCode::HardFault, false);
}

#[test]
fn a_panic_takes_the_motors_away_at_once_and_is_reported() {
    for image in [image(), image_without_logs()] {
        let mut bench = Bench::start(&image, "closed-loop", 1, &[("omega0", 2.0)]);
        bench.control_step();
        // The inbox's lock says that it is taken, which its owner holds for impossible.
        for address in variable(&image, "tasks::shared::INBOX").step_by(4) {
            bench.board().board.trouble(Trouble::Poke(address, 0xFFFF_FFFF)).expect("there is memory");
        }
        assert!(reset_within(&mut bench, 5) <= 2, "it went on for milliseconds");
        assert_eq!(bench.hello().reset, ResetCause::Panic);
        stays_off(&mut bench, FaultCode::Panic, false);
    }
}

#[test]
fn a_reset_in_mid_run_leaves_it_disarmed_and_not_homed() {
    let mut bench = rolling();
    bench.board().board.reset().expect("reset");
    bench.board().driven = 0;
    bench.pass(100);
    let identity = bench.hello();
    assert_eq!((identity.reset, identity.state), (ResetCause::Pin, SafetyState::Disarmed));
    assert_eq!(bench.ask(HostMessage::Arm), RobotMessage::Refused(Refusal::NotHomed));
    assert_eq!(bench.board().driven, 0);
}

#[test]
fn a_power_cut_in_mid_run_leaves_it_disarmed_and_not_homed() {
    let mut bench = rolling();
    bench.board().board.power_cycle().expect("comes up again");
    assert!(!bench.board().pins().enabled_meanwhile, "driven in the first millisecond");
    bench.board().driven = 0;
    bench.pass(100);
    let identity = bench.hello();
    assert_eq!((identity.reset, identity.state), (ResetCause::PowerOn, SafetyState::Disarmed));
    assert_eq!(bench.ask(HostMessage::Arm), RobotMessage::Refused(Refusal::NotHomed));
    assert_eq!(bench.board().driven, 0);
}

#[test]
fn the_stop_button_an_open_stop_loop_and_the_host_stop_it_within_two_milliseconds() {
    let mut bench = rolling();
    bench.board().around.stop_button = true;
    bench.pass(2);
    bench.board().around.stop_button = false;
    stays_off(&mut bench, FaultCode::EmergencyStop, true);
    bench.board().around.stop_loop_open = true;
    bench.pass(2);
    bench.board().around.stop_loop_open = false;
    stays_off(&mut bench, FaultCode::EmergencyStop, true);
    bench.ask(HostMessage::EmergencyStop);
    bench.pass(1);
    stays_off(&mut bench, FaultCode::EmergencyStop, true);
}

#[test]
fn an_empty_battery_stops_it() {
    let mut bench = rolling();
    bench.board().around.battery_mv = u32::from(BATTERY_LOW) - 500;
    // It is measured now and then, and may sag for a moment.
    bench.pass(1500);
    bench.board().around.battery_mv = 12_000;
    stays_off(&mut bench, FaultCode::BrownOut, true);
}

#[test]
fn a_transaction_that_is_lost_on_the_bus_is_missed_and_nothing_else() {
    let mut bench = rolling();
    bench.pass(1000);
    // While the sensor started, there was nothing to read.
    let before = bench.vitals().imu_missed;
    for lost in 1..=4 {
        bench.board().board.trouble(Trouble::LoseImu(lost)).expect("lost");
        bench.pass(500);
        assert_eq!(bench.hello().state, SafetyState::Armed, "{lost} in a row");
    }
    bench.pass(1000);
    let missed = bench.vitals().imu_missed - before;
    assert!((1..=40).contains(&missed), "{missed} readings are missed");
}

#[test]
fn bursts_of_lost_transactions_at_any_moment_are_ridden_out() {
    let mut bench = rolling();
    let mut random = Pcg32::seed_from_u64(5);
    for _ in 0..1000 {
        bench.board().board.trouble(Trouble::LoseImu(3 + random.next_u32() % 2)).expect("lost");
        bench.pass(8 + random.next_u32() % 8);
        assert_eq!(bench.control_step().telemetry.state, SafetyState::Armed);
    }
    assert!(bench.vitals().imu_missed > 3000, "{:?}", bench.vitals());
}

#[test]
fn bits_that_the_bus_gets_wrong_are_ridden_out() {
    let mut bench = rolling();
    let mut random = Pcg32::seed_from_u64(6);
    let mut worst: f32 = 0.0;
    for _ in 0..1000 {
        // Somewhere in a reading, at some bit, every few milliseconds.
        bench.board().board.trouble(Trouble::FlipImu(1 << (random.next_u32() % 8))).expect("flipped");
        bench.pass(1 + random.next_u32() % 8);
        let step = bench.control_step();
        assert_eq!(step.telemetry.state, SafetyState::Armed);
        // A lying barrel's inclinations are sine and cosine of its roll.
        let [x1, x2] = step.telemetry.x;
        worst = worst.max((x1.atan2(x2) + step.plant.phi as f32).sin().abs());
    }
    assert!(worst < 0.1, "the roll was {worst:.3} rad off");
}

#[test]
fn an_inertial_sensor_that_falls_silent_stops_it_and_is_used_again_when_it_answers() {
    let mut bench = rolling();
    bench.board().around.imu_silent = true;
    bench.pass(12);
    bench.board().driven = 0;
    bench.pass(100);
    assert_eq!(bench.board().driven, 0, "it is driven blindly");
    bench.board().around.imu_silent = false;
    bench.pass(1000);
    stays_off(&mut bench, FaultCode::StaleSensor, true);
}

#[test]
fn bytes_lost_and_garbled_on_the_line_cost_steps_of_the_record_and_nothing_of_the_run() {
    let mut bench = rolling();
    bench.board().line = Some(BadLine::losing(397));
    let mut missing = 0;
    let mut last = bench.control_step().telemetry.tick;
    for _ in 0..500 {
        let step = bench.control_step();
        assert!(step.telemetry.tick > last, "the count goes back");
        assert_eq!(step.telemetry.state, SafetyState::Armed);
        missing += step.telemetry.tick - last - 1;
        last = step.telemetry.tick;
    }
    assert!(missing > 5, "{missing} steps missing: the line was not bad enough to say anything");
    assert!(bench.robot.lost() >= missing, "{} counted, {missing} missing", bench.robot.lost());
    for _ in 0..300 {
        assert_eq!(bench.hello().state, SafetyState::Armed, "requests get through");
    }
    bench.board().line = None;
    bench.pass(1000);
    let vitals = bench.vitals();
    assert!(vitals.garbled > 0 && vitals.overruns == 0, "{vitals:?}");
}

#[test]
fn noise_and_framing_errors_on_the_wires_leave_the_uarts_in_order() {
    let mut bench = rolling();
    // A byte in a hundred.
    bench.board().board.trouble(Trouble::GarbleUarts(5000)).expect("garbled");
    for _ in 0..300 {
        assert_eq!(bench.hello().state, SafetyState::Armed, "requests get through");
    }
    bench.board().board.trouble(Trouble::GarbleUarts(0)).expect("clean");
    bench.pass(1000);
    let before = bench.vitals();
    assert!(before.garbled > 20 && before.overruns == 0, "{before:?}");
    for _ in 0..300 {
        bench.hello();
    }
    bench.pass(1000);
    assert_eq!(bench.vitals().garbled, before.garbled, "a clean line is clean again");
}
