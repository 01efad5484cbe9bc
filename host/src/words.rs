//! What a robot says of itself, for people.

use crate::console::AXES;
use hil_sim::link::Identity;
use protocol::message::{
    CalibrationPhase, CalibrationProgress, CalibrationStep, MemoryState, Precision, ResetCause, SafetyState, Vitals,
};

/// A safety state, and of a fault what it was.
pub fn state(state: SafetyState) -> String {
    match state {
        SafetyState::Disarmed => "Disarmed".to_owned(),
        SafetyState::Armed => "Armed".to_owned(),
        SafetyState::Fault(code) => format!("Fault: {code}"),
    }
}

/// Why the firmware started.
pub fn reset(cause: ResetCause) -> &'static str {
    match cause {
        ResetCause::PowerOn => "power on",
        ResetCause::Pin => "the reset button or a debug probe",
        ResetCause::Software => "the firmware asked for it",
        ResetCause::Watchdog => "the watchdog was not fed",
        ResetCause::BrownOut => "the supply sagged",
        ResetCause::Panic => "the firmware panicked",
        ResetCause::HardFault => "the core took a fault",
    }
}

fn memory(state: MemoryState) -> &'static str {
    match state {
        MemoryState::Absent => "it has no memory, or the memory does not answer",
        MemoryState::Empty => "its memory is empty: it started with the defaults",
        MemoryState::Loaded => "it started with the parameters and calibration in its memory",
        MemoryState::Unreadable => {
            "its memory could not be read, or is another version's: it started with the defaults"
        }
    }
}

fn precision(precision: Precision) -> &'static str {
    match precision {
        Precision::F64 => "f64",
        Precision::F32 => "f32",
        Precision::Fixed => "fixed point",
    }
}

/// Version of the firmware, as people write it.
pub fn version(firmware: [u8; 3]) -> String {
    firmware.map(|n| n.to_string()).join(".")
}

/// Who a robot is, one fact a line.
pub fn identity(identity: &Identity) -> Vec<String> {
    vec![
        format!("firmware {}, brain in {}", version(identity.firmware), precision(identity.precision)),
        format!("last start: {}; {}", reset(identity.reset), memory(identity.memory)),
        state(identity.state),
    ]
}

/// How a robot is, one fact a line.
pub fn vitals(v: &Vitals) -> Vec<String> {
    let sensors = if v.simulated_sensors { "its sensors are a host's simulation" } else { "it uses its own sensors" };
    let homed = if v.homed { "the middle of its axes is known" } else { "its axes are not homed" };
    vec![
        format!("running for {} s; {sensors}; {homed}", v.ticks / 1000),
        format!(
            "core awake {:.2} % of the time; servo tick at most {} µs, with the brain {} µs; jitter {:.1} µs",
            f64::from(v.load) / 100.0,
            v.servo_ns / 1000,
            v.brain_ns / 1000,
            f64::from(v.jitter_ns) / 1000.0
        ),
        format!(
            "{} late ticks, {} without a reading of the inertial sensor; battery {:.1} V",
            v.overruns,
            v.imu_missed,
            f64::from(v.battery_mv) / 1000.0
        ),
        format!("encoders at {} and {} counts since its start", v.encoder[0], v.encoder[1]),
        format!("on this line {} frames found no room, {} arrived garbled", v.unsent, v.garbled),
    ]
}

/// How far a calibration is, after `step` or when nothing but that was asked.
pub fn calibration(progress: CalibrationProgress, step: CalibrationStep) -> String {
    let missing: Vec<&str> = AXES
        .iter()
        .enumerate()
        .filter(|(bit, _)| progress.attitudes & (1 << bit) == 0)
        .map(|(_, (name, _))| *name)
        .collect();
    let attitudes = match missing.as_slice() {
        [] => "all six attitudes are known".to_owned(),
        missing => format!("attitudes still to come: {}", missing.join(" ")),
    };
    match (progress.phase, step) {
        (CalibrationPhase::Idle, _) => format!("no step was taken yet; {attitudes}"),
        (CalibrationPhase::Averaging, _) => "averaging: keep the barrel at rest for two seconds".to_owned(),
        (CalibrationPhase::Taken, _) => format!("taken; {attitudes}"),
        (CalibrationPhase::Applied, CalibrationStep::Still) => {
            "the gyroscope's bias is found and in use; `save` keeps it".to_owned()
        }
        (CalibrationPhase::Applied, CalibrationStep::Up(_)) => {
            "the accelerometer and its mounting are calibrated, and that is in use; `save` keeps it".to_owned()
        }
        (CalibrationPhase::Applied, _) => format!("the last step is in use; {attitudes}"),
        (CalibrationPhase::Moved, _) => "the barrel moved: let it rest and do this step again".to_owned(),
        (CalibrationPhase::Inconsistent, _) => {
            format!("the attitudes do not fit together: one was not what it was said to be; do it again; {attitudes}")
        }
    }
}
