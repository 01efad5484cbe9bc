//! The 1 kHz loop. It alone has the robot: messages reach it and leave it through channels.

use core::sync::atomic::Ordering::Relaxed;

use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Instant, Ticker};
use firmware::Robot;
use firmware::load::LoadMeter;
use firmware::robot::Senses;
use firmware::timing::SERVO_PERIOD;
use protocol::message::SafetyState;
use protocol::{HostMessage, RobotMessage};

use crate::board::{Axes, Imu, StopInputs, Watchdog};
use crate::tasks::shared::{AWAKE, BATTERY, ERRANDS, GARBLED, INBOX, OUTBOX, Outgoing, Port, SHOWN, Shown, UNSENT};
use crate::{Brain, board, log};

/// Servo ticks in a second.
const SECOND: u32 = (1.0 / SERVO_PERIOD) as u32;
/// Messages carried out in one tick at most.
const AT_ONCE: usize = 2;
/// Longest time that the inertial sensor's transaction may take.
const IMU_LIMIT: Duration = Duration::from_micros(300);
/// Servo ticks that the inertial sensor is waited for at the start.
const IMU_START: u32 = 250;

/// Sensors, robot, motors, every millisecond, for ever.
#[embassy_executor::task]
pub async fn servo(mut robot: Robot<Brain>, mut imu: Imu, mut axes: Axes, stop: StopInputs, mut watchdog: Watchdog) {
    let mut ticker = Ticker::every(Duration::from_hz(u64::from(SECOND)));
    // A sensor that is still starting is not a stale one.
    for _ in 0..IMU_START {
        if imu.is_running() {
            break;
        }
        ticker.next().await;
        let _ = embassy_time::with_timeout(IMU_LIMIT, imu.tick()).await;
    }
    watchdog.unleash();
    let mut meter = LoadMeter::new(board::CORE_HZ);
    let mut deadline_missed = false;
    let mut ticks: u32 = 0;
    loop {
        if robot.simulated_sensors() {
            // The host's clock counts: its messages are carried out when they come.
            if let Either::Second((port, message)) = select(ticker.next(), INBOX.receive()).await {
                serve(&mut robot, port, &message);
                continue;
            }
        } else {
            ticker.next().await;
        }
        let start = board::cycles();
        for _ in 0..AT_ONCE {
            let Ok((port, message)) = INBOX.try_receive() else { break };
            serve(&mut robot, port, &message);
        }
        let reading = if robot.simulated_sensors() {
            None
        } else {
            let reading = embassy_time::with_timeout(IMU_LIMIT, imu.tick()).await.ok().flatten();
            if reading.is_none() {
                meter.imu_missed();
            }
            reading
        };
        let battery = BATTERY.load(Relaxed);
        let tick = robot.servo_tick(&Senses {
            imu: reading,
            encoder: axes.counts(),
            stop_button: stop.button(),
            stop_loop_open: stop.loop_open(),
            battery_mv: (battery > 0).then_some(battery),
            deadline_missed,
        });
        axes.drive(tick.outputs, tick.powered);
        let with_brain = tick.telemetry.is_some();
        let met = meter.tick(start, board::cycles(), with_brain);
        // A robot in the hands of a host is as late as the host makes it.
        deadline_missed = !met && !robot.simulated_sensors();
        if met || robot.simulated_sensors() {
            watchdog.pet();
        }
        if let Some(telemetry) = tick.telemetry {
            announce(&RobotMessage::Telemetry(telemetry));
        }
        ticks = ticks.wrapping_add(1);
        if ticks.is_multiple_of(SECOND) {
            vitals(&robot, &mut meter);
        }
        show(&robot);
    }
}

/// Has the robot carry out a message; its answers go to the host who asked.
fn serve(robot: &mut Robot<Brain>, port: Port, message: &HostMessage) {
    robot.handle(message, &mut |reply| post(port, Outgoing::Answer(*reply)));
    if let Some(errand) = robot.take_errand() {
        // One errand at a time: a host asks again when it hears nothing.
        let _ = ERRANDS.try_send((port, errand));
    }
}

fn announce(message: &RobotMessage) {
    for port in Port::ALL {
        post(port, Outgoing::Announcement(*message));
    }
}

fn post(port: Port, message: Outgoing) {
    if port.of(&OUTBOX).try_send(message).is_err() {
        let unsent = port.of(&UNSENT);
        unsent.store(unsent.load(Relaxed).wrapping_add(1), Relaxed);
    }
}

/// The figures of the second that has passed.
fn vitals(robot: &Robot<Brain>, meter: &mut LoadMeter) {
    meter.awake(AWAKE.swap(0, Relaxed));
    let mut vitals = meter.second();
    vitals.homed = robot.homed();
    vitals.simulated_sensors = robot.simulated_sensors();
    vitals.battery_mv = BATTERY.load(Relaxed);
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
