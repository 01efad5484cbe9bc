//! The 1 kHz loop. It alone has the robot: messages reach it and leave it through channels.

use core::sync::atomic::Ordering::Relaxed;

use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Instant};
use firmware::Robot;
use firmware::load::LoadMeter;
use firmware::robot::Senses;
use firmware::timing::SERVO_HZ;
use protocol::message::{Refusal, SafetyState, Vitals};
use protocol::{HostMessage, RobotMessage};

use crate::board::{Axes, Imu, StopInputs, Supply, Watchdog};
use crate::tasks::pace::Pace;
use crate::tasks::shared::{
    AWAKE, BATTERY, ERRANDS, FOR_ANSWERS, GARBLED, INBOX, OUTBOX, Outgoing, Port, SHOWN, Shown, UNSENT,
};
use crate::{Brain, board, log};

/// Messages carried out in one tick at most.
const AT_ONCE: usize = 2;
/// Servo ticks that the inertial sensor is left alone after a transaction that did not end within its tick. That tick is
/// lost; more of them in a row would be the watchdog's business.
const IMU_REST: u8 = 100;
/// Servo ticks that the inertial sensor is waited for at the start.
const IMU_START: u32 = 250;

/// Sensors, robot, motors, every millisecond, for ever.
#[embassy_executor::task]
pub async fn servo(
    mut robot: Robot<Brain>,
    mut imu: Imu,
    mut axes: Axes,
    stop: StopInputs,
    mut supply: Supply,
    mut watchdog: Watchdog,
) {
    let mut pace = Pace::every(Duration::from_hz(u64::from(SERVO_HZ)));
    // A sensor that is still starting is not a stale one.
    for _ in 0..IMU_START {
        if imu.is_running() {
            break;
        }
        pace.tick().await;
        let _ = select(imu.tick(), pace.tick()).await;
    }
    watchdog.unleash();
    let mut meter = LoadMeter::new(board::CORE_HZ);
    let mut deadline_missed = false;
    let mut imu_rest = 0;
    let mut battery = 0;
    let mut ticks: u32 = 0;
    loop {
        if robot.simulated_sensors() {
            // The host's clock counts: its messages are carried out when they come.
            if let Either::Second((port, message)) = select(pace.tick(), INBOX.receive()).await {
                let start = board::cycles();
                serve(&mut robot, port, &message);
                meter.simulated_tick(start, board::cycles());
                continue;
            }
        } else {
            pace.tick().await;
        }
        let start = board::cycles();
        for _ in 0..AT_ONCE {
            let Ok((port, message)) = INBOX.try_receive() else { break };
            serve(&mut robot, port, &message);
        }
        let mut reading = None;
        if !robot.simulated_sensors() {
            if imu_rest > 0 {
                imu_rest -= 1;
            } else {
                match select(imu.tick(), pace.tick()).await {
                    Either::First(new) => reading = new,
                    Either::Second(()) => imu_rest = IMU_REST,
                }
            }
            if reading.is_none() {
                meter.imu_missed();
            }
        }
        let measured = match BATTERY.swap(0, Relaxed) {
            0 => None,
            millivolts => {
                battery = millivolts;
                Some(millivolts)
            }
        };
        let encoder = axes.counts();
        let tick = robot.servo_tick(&Senses {
            imu: reading,
            encoder,
            stop_button: stop.button(),
            stop_loop_open: stop.loop_open(),
            battery_mv: measured,
            supply_low: supply.is_low(),
            deadline_missed,
        });
        axes.drive(tick.outputs, tick.powered);
        let met = meter.tick(start, board::cycles(), tick.stepped);
        deadline_missed = !met;
        if met {
            watchdog.pet();
        } else {
            // What was not done in time is not made up for: it would only be late again, and a sensor that is read twice at once
            // has nothing new.
            pace.begin_anew();
        }
        if tick.stepped {
            announce(&RobotMessage::Telemetry(robot.telemetry()));
        }
        ticks = ticks.wrapping_add(1);
        if ticks.is_multiple_of(SERVO_HZ) {
            meter.awake(AWAKE.swap(0, Relaxed));
            let mut vitals = meter.second();
            (vitals.battery_mv, vitals.encoder) = (battery, encoder);
            tell(&robot, vitals);
        }
        show(&robot);
    }
}

/// Has the robot carry out a message; its answers go to the host who asked.
fn serve(robot: &mut Robot<Brain>, port: Port, message: &HostMessage) {
    robot.handle(message, &mut |reply| post(port, Outgoing::Answer(*reply)));
    if let Some(errand) = robot.take_errand()
        && ERRANDS.try_send((port, errand)).is_err()
    {
        // One errand at a time.
        post(port, Outgoing::Answer(RobotMessage::Refused(Refusal::Busy)));
    }
}

/// Tells both hosts.
fn announce(message: &RobotMessage) {
    for port in Port::ALL {
        post(port, Outgoing::Announcement(*message));
    }
}

/// Puts a message on its way, or counts it.
fn post(port: Port, message: Outgoing) {
    let outbox = port.of(&OUTBOX);
    let crowded = matches!(message, Outgoing::Announcement(_)) && outbox.free_capacity() <= FOR_ANSWERS;
    if crowded || outbox.try_send(message).is_err() {
        let unsent = port.of(&UNSENT);
        unsent.store(unsent.load(Relaxed).wrapping_add(1), Relaxed);
    }
}

/// Tells both hosts the figures of the second that has passed.
fn tell(robot: &Robot<Brain>, mut vitals: Vitals) {
    vitals.homed = robot.homed();
    vitals.simulated_sensors = robot.simulated_sensors();
    for port in Port::ALL {
        vitals.unsent = port.of(&UNSENT).load(Relaxed);
        vitals.garbled = port.of(&GARBLED).load(Relaxed);
        post(port, Outgoing::Announcement(RobotMessage::Vitals(vitals)));
    }
}

/// Hands the lamps what they are to show, and the log what has changed.
fn show(robot: &Robot<Brain>) {
    let now = Shown { state: robot.safety_state(), homed: robot.homed(), simulated: robot.simulated_sensors() };
    let before = SHOWN.lock(|shown| shown.replace(now));
    if before.state != now.state {
        match now.state {
            SafetyState::Fault(code) => log::warning!("fault: {}", log::shown(&code)),
            state => log::info!("{} at {} ms", log::shown(&state), Instant::now().as_millis()),
        }
    }
}
