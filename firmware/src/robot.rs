//! The robot: the one place where attitude, brain, servo and safety meet, and the handler of every message.
//!
//! * [`Robot::control_step`], 50 times a second: inclinations in, act, learn.
//! * [`Robot::servo_tick`], 1000 times a second: what the board senses in, duties out; every 20th tick takes a control step
//!   first.
//! * [`Robot::handle`]: a message of the host in, answers out.
//!
//! None of them waits, allocates or panics. Whatever goes wrong ends in Fault with zero outputs ([`crate::safety`]).

mod parameters;

pub use parameters::settings;

use nalgebra::SVector;
use protocol::message::{CalibrationStep, MemoryState, Refusal, ResetCause, SafetyState, Telemetry, Transducers};
use protocol::{FaultCode, HostMessage, Id, RobotMessage, Values};

use crate::attitude::ImuCalibration;
use crate::axes::{Axes, ImuCounts, SERVO_PARAMETERS};
use crate::brain::{Brain, Controller, Model};
use crate::calibration::Calibrator;
use crate::homing::{Homing, HomingStep};
use crate::noise::InclinationNoise;
use crate::safety::{Event, Faults, Health, Outputs, Safety};
use crate::scalar::Scalar;
use crate::storage::Record;
use crate::timing::SERVO_TICKS;

/// What can go stale: inertial sensor and encoders.
const SENSORS: usize = 2;
/// Servo ticks that each may miss in a row.
const STALE_AFTER: [u16; SENSORS] = [5, 0];

/// Supply below which the motors are not to be driven, mV: three lithium cells at 3 V each.
pub const BATTERY_LOW: u16 = 9000;
/// Measurements in a row below [`BATTERY_LOW`] that are a fault: one is, when both motors start at once.
const BATTERY_PATIENCE: u8 = 3;

/// Version of the firmware: major, minor, patch.
pub const VERSION: [u8; 3] = [0, 1, 0];

/// The barrel's robot, its brain in `S`.
#[derive(Clone, Debug)]
pub struct Robot<S: Scalar> {
    /// Every parameter as it was set; where the brain has learned since, the brain knows better.
    values: Values<S::Wide>,
    brain: Brain<S, 2, 2>,
    /// The last control step, and the safety state in which it was taken.
    state: State<S>,
    stepped_in: SafetyState,
    /// Control steps since the start.
    tick: u32,
    /// Servo ticks until the next control step.
    until_control: u8,
    axes: Axes,
    noise: InclinationNoise,
    safety: Safety<SENSORS>,
    /// What is put aside while the sensors are the host's; they are the robot's own without it.
    own: Option<Own<S>>,
    /// Encoder counts of the middle of each axis; `None` until they are found.
    middle: Option<[i32; 2]>,
    /// Looking for the middle of the axes; the brain then waits.
    homing: Option<Homing>,
    calibrator: Calibrator,
    /// Measurements in a row of a supply that is too low.
    battery_low: u8,
    reset: ResetCause,
    memory: MemoryState,
    errand: Option<Errand>,
}

/// The real robot, put aside while its firmware plays in a simulation: a body of other size and strength must leave nothing
/// behind.
#[derive(Clone, Debug)]
struct Own<S: Scalar> {
    values: Values<S::Wide>,
    brain: Brain<S, 2, 2>,
    calibration: ImuCalibration,
}

/// What a robot finds when it starts.
#[derive(Clone, Debug, Default)]
pub struct Boot {
    /// Why it starts. A start after a crash begins in Fault.
    pub reset: ResetCause,
    /// What its memory holds.
    pub memory: MemoryState,
    /// The record in it.
    pub record: Option<Record>,
}

/// What the board senses in one servo tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Senses {
    /// A new reading of the inertial sensor, if there is one.
    pub imu: Option<ImuCounts>,
    /// Encoder counts of the two axes since the start.
    pub encoder: [i32; 2],
    /// The stop button on the board is pressed.
    pub stop_button: bool,
    /// The stop loop is open.
    pub stop_loop_open: bool,
    /// Supply of the motors, mV, if it was measured since the last tick.
    pub battery_mv: Option<u16>,
    /// The microcontroller's own supply sags.
    pub supply_low: bool,
    /// The tick before this one did not end in time.
    pub deadline_missed: bool,
}

/// What comes of one servo tick.
#[derive(Debug)]
pub struct Tick {
    /// What the power stage is given.
    pub outputs: Outputs<2>,
    /// Whether the power stage may be switched on.
    pub powered: bool,
    /// Whether the brain took a step, which [`Robot::telemetry`] shows.
    pub stepped: bool,
}

/// Something that takes longer than a servo tick may, for the board to see to. It answers the host when it is done, with
/// [`RobotMessage::Stored`], or why not.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "there is no heap to put a record on")]
pub enum Errand {
    /// Write this to the memory.
    Store(Record),
    /// Empty the memory.
    Forget,
}

/// The brain after a control step, in its own number format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<S> {
    /// Inclinations.
    pub x: [S; 2],
    /// Motor values, −1…1.
    pub y: [S; 2],
    /// Controller matrix, row by row.
    pub c: [S; 4],
    /// Controller bias.
    pub h: [S; 2],
    /// Model matrix, row by row.
    pub a: [S; 4],
    /// Model bias.
    pub b: [S; 2],
    /// Prediction error ξ.
    pub xi: [S; 2],
    /// E = ξᵀξ.
    pub error: S,
    /// Time loop error vᵀv.
    pub time_loop_error: S,
}

impl<S: Scalar> Default for Robot<S> {
    /// Disarmed, every parameter at its default, using its own sensors, without a memory.
    fn default() -> Self {
        Robot::new(&Boot::default())
    }
}

impl<S: Scalar> Robot<S> {
    /// A robot that has just started, using its own sensors: Disarmed, or in Fault if its last run ended in a crash.
    pub fn new(boot: &Boot) -> Self {
        let cause = match boot.reset {
            ResetCause::PowerOn | ResetCause::Pin | ResetCause::Software => None,
            ResetCause::Watchdog => Some(FaultCode::Watchdog),
            ResetCause::BrownOut => Some(FaultCode::BrownOut),
            ResetCause::Panic => Some(FaultCode::Panic),
            ResetCause::HardFault => Some(FaultCode::HardFault),
        };
        let mut robot = Robot {
            values: Values::defaults(S::Wide::from_f64),
            brain: Brain::default(),
            state: State {
                x: [S::zero(); 2],
                y: [S::zero(); 2],
                c: [S::zero(); 4],
                h: [S::zero(); 2],
                a: [S::zero(); 4],
                b: [S::zero(); 2],
                xi: [S::zero(); 2],
                error: S::zero(),
                time_loop_error: S::zero(),
            },
            stepped_in: SafetyState::Disarmed,
            tick: 0,
            until_control: 0,
            axes: Axes::default(),
            noise: InclinationNoise::default(),
            safety: Safety::new(STALE_AFTER, cause),
            own: None,
            middle: None,
            homing: None,
            calibrator: Calibrator::default(),
            battery_low: 0,
            reset: boot.reset,
            memory: boot.memory,
            errand: None,
        };
        for (id, value) in SERVO_PARAMETERS {
            robot.values.set(id, S::Wide::from_f64(value));
        }
        robot.apply_settings();
        robot.apply_drive();
        robot.apply_gains();
        robot.apply_noise();
        if let Some(record) = &boot.record {
            for &id in Id::ALL.iter().filter(|id| id.coupled().is_none()) {
                // The simulator's parameters are in the record, too, and are not the robot's to take.
                let _ = robot.set(id, f64::from(record.parameters[usize::from(id.index())]));
            }
            robot.axes.calibrate(record.calibration);
        }
        robot.restart(0);
        robot
    }

    /// Handles one message of the host; every answer goes to `reply`, the last one being that of
    /// [`HostMessage::is_answered_by`]. Only what becomes an [`Errand`] is answered later.
    pub fn handle(&mut self, message: &HostMessage, reply: &mut impl FnMut(&RobotMessage)) {
        let answer = match *message {
            HostMessage::Hello { .. } => RobotMessage::Hello {
                version: protocol::VERSION,
                schema: protocol::SCHEMA,
                firmware: VERSION,
                precision: S::PRECISION,
                state: self.safety.state(),
                reset: self.reset,
                memory: self.memory,
            },
            HostMessage::Arm if !self.homed() => RobotMessage::Refused(Refusal::NotHomed),
            HostMessage::Arm => self.event(Event::Arm),
            HostMessage::Disarm => {
                self.homing = None;
                self.event(Event::Disarm)
            }
            HostMessage::EmergencyStop => self.event(Event::EmergencyStop),
            HostMessage::ClearFault => self.event(Event::ClearFault),
            HostMessage::Restart { seed } => {
                self.restart(seed);
                RobotMessage::State(self.safety.state())
            }
            HostMessage::SimulatedSensors(simulated) => self.choose_sensors(simulated),
            HostMessage::SetParameter { index, value } => {
                self.answer_parameter(index, |robot, id| robot.set(id, f64::from(value)))
            }
            HostMessage::GetParameter { index } => self.answer_parameter(index, |_, _| Ok(())),
            HostMessage::Inclination { .. } | HostMessage::Transducers(_) if !self.simulated_sensors() => {
                RobotMessage::Refused(Refusal::OwnSensors)
            }
            HostMessage::Inclination { x } => {
                self.control_step(x);
                RobotMessage::Telemetry(self.telemetry())
            }
            HostMessage::Transducers(Transducers { accelerometer, gyroscope, encoder }) => {
                let reading = ImuCounts { accelerometer, gyroscope };
                let (outputs, stepped) = self.move_weights(Some(&reading), encoder, Faults::NONE);
                if stepped {
                    reply(&RobotMessage::Telemetry(self.telemetry()));
                }
                RobotMessage::Actuators { duty: outputs.duty() }
            }
            HostMessage::Home => self.home(),
            HostMessage::Calibrate(step) => self.begin_calibration(step),
            HostMessage::Store | HostMessage::Forget if self.memory == MemoryState::Absent => {
                RobotMessage::Refused(Refusal::NoMemory)
            }
            HostMessage::Store if self.simulated_sensors() => RobotMessage::Refused(Refusal::WhileSimulated),
            HostMessage::Store => {
                self.errand = Some(Errand::Store(self.record()));
                return;
            }
            HostMessage::Forget => {
                self.errand = Some(Errand::Forget);
                return;
            }
        };
        reply(&answer);
    }

    /// What is to be seen to outside the servo tick; once.
    pub fn take_errand(&mut self) -> Option<Errand> {
        self.errand.take()
    }

    /// One servo tick, every [`crate::timing::SERVO_PERIOD`]: what the board senses in, the duty of both axes out (−1…1, zero
    /// unless Armed), and whether the brain took a step. With simulated sensors it minds the stop button and the deadline,
    /// and everything else waits for the host.
    pub fn servo_tick(&mut self, senses: &Senses) -> Tick {
        if senses.stop_button {
            self.event(Event::EmergencyStop);
        }
        if self.simulated_sensors() {
            if senses.deadline_missed {
                self.fault(FaultCode::MissedDeadline);
            }
            return Tick { outputs: Outputs::ZERO, powered: false, stepped: false };
        }
        if let Some(supply) = senses.battery_mv {
            let low = supply < BATTERY_LOW && self.armed();
            self.battery_low = if low { self.battery_low.saturating_add(1) } else { 0 };
        }
        let faults = Faults::NONE
            .with_if(FaultCode::EmergencyStop, senses.stop_loop_open)
            .with_if(FaultCode::MissedDeadline, senses.deadline_missed)
            .with_if(FaultCode::BrownOut, senses.supply_low || self.battery_low >= BATTERY_PATIENCE);
        let (outputs, stepped) = self.move_weights(senses.imu.as_ref(), senses.encoder, faults);
        Tick { outputs, powered: self.armed(), stepped }
    }

    /// Attitude, brain, servo and safety, in this order, on one tick's readings and on the faults found so far.
    fn move_weights(
        &mut self,
        reading: Option<&ImuCounts>,
        encoder: [i32; 2],
        mut faults: Faults,
    ) -> (Outputs<2>, bool) {
        self.axes.locate(self.centred(encoder));
        if let Err(code) = self.axes.sense(reading) {
            faults = faults.with(code);
        }
        if let Some(reading) = reading
            && let Some(calibration) =
                self.calibrator.tick(reading.accelerometer, reading.gyroscope, self.axes.calibration())
        {
            self.axes.calibrate(calibration);
        }
        let stepped = self.until_control == 0;
        if stepped {
            self.until_control = SERVO_TICKS;
            let x = self.noise.add(self.axes.inclination());
            self.control_step(x);
        }
        self.until_control -= 1;
        let mut duty = [0.0; 2];
        match self.duties(encoder) {
            Ok(wanted) => duty = wanted,
            Err(code) => faults = faults.with(code),
        }
        let outputs = match self.safety.tick(&Health { fresh: [reading.is_some(), true], faults }) {
            Some(armed) => armed.drive(duty),
            None => Outputs::ZERO,
        };
        (outputs, stepped)
    }

    /// What the axes are to be given if the robot is Armed: the brain's, or, while the middle is looked for, homing's.
    fn duties(&mut self, encoder: [i32; 2]) -> Result<[f32; 2], FaultCode> {
        if !self.armed() {
            self.homing = None;
            self.axes.rest();
            return Ok([0.0; 2]);
        }
        let Some(homing) = &mut self.homing else { return self.axes.servo(self.state.y.map(S::to_f32)) };
        match homing.tick(encoder) {
            HomingStep::Drive(duty) => Ok(duty),
            HomingStep::Done(middle) => {
                self.homing = None;
                if !self.simulated_sensors() {
                    self.middle = Some(middle);
                }
                self.event(Event::Disarm);
                Ok([0.0; 2])
            }
            HomingStep::Failed => Err(FaultCode::Homing),
        }
    }

    /// Encoder counts from the middle of each axis; those of simulated sensors are that already.
    fn centred(&self, encoder: [i32; 2]) -> [i32; 2] {
        match self.middle {
            Some(middle) if !self.simulated_sensors() => core::array::from_fn(|i| encoder[i].wrapping_sub(middle[i])),
            _ => encoder,
        }
    }

    fn armed(&self) -> bool {
        self.safety.state() == SafetyState::Armed
    }

    /// Whether the middle of both axes is known.
    pub fn homed(&self) -> bool {
        self.simulated_sensors() || self.middle.is_some()
    }

    /// Whether the sensors are the host's.
    pub fn simulated_sensors(&self) -> bool {
        self.own.is_some()
    }

    fn home(&mut self) -> RobotMessage {
        if self.armed() {
            return RobotMessage::Refused(Refusal::WhileArmed);
        }
        let answer = self.event(Event::Arm);
        if self.armed() {
            self.homing = Some(Homing::new());
            if !self.simulated_sensors() {
                self.middle = None;
            }
        }
        answer
    }

    fn begin_calibration(&mut self, step: CalibrationStep) -> RobotMessage {
        if step != CalibrationStep::Status {
            if self.armed() {
                return RobotMessage::Refused(Refusal::WhileArmed);
            }
            if self.simulated_sensors() {
                return RobotMessage::Refused(Refusal::WhileSimulated);
            }
            self.calibrator.begin(step);
        }
        RobotMessage::Calibration(self.calibrator.progress())
    }

    /// One control step, every [`crate::timing::CONTROL_PERIOD`]: act on the inclinations, then learn.
    pub fn control_step(&mut self, x: [f32; 2]) {
        if x.iter().all(|x| x.is_finite()) {
            self.think(x.map(S::from_f32));
        } else {
            self.state.y = [S::zero(); 2];
            self.tick = self.tick.wrapping_add(1);
            self.fault(FaultCode::ImpossibleSensor);
        }
        self.stepped_in = self.safety.state();
    }

    /// As [`Robot::control_step`], in the brain's own number format; the result is [`Robot::state`].
    pub fn think(&mut self, x: [S; 2]) {
        if !self.armed() || self.homing.is_some() {
            // What follows is not the consequence of these motor values: nothing is to be learned from it.
            self.brain.forget();
        }
        self.state.x = x;
        match self.brain.step(&SVector::from(x)) {
            Ok(step) => {
                self.state.y = step.y.into();
                self.state.xi = step.xi.into();
                self.state.error = step.error;
                self.state.time_loop_error = step.time_loop_error;
                self.note_matrices();
            }
            Err(_) => {
                self.state.y = [S::zero(); 2];
                self.fault(FaultCode::NonFinite);
            }
        }
        self.tick = self.tick.wrapping_add(1);
    }

    /// Reports a fault that was found outside: a missed deadline, a button, the supply.
    pub fn fault(&mut self, code: FaultCode) {
        self.event(Event::Fault(code));
    }

    /// The brain after the last control step.
    pub fn state(&self) -> &State<S> {
        &self.state
    }

    /// Safety state.
    pub fn safety_state(&self) -> SafetyState {
        self.safety.state()
    }

    /// Starts the brain afresh from its parameters, at tick 0, with the stimulus' noise seeded.
    pub fn restart(&mut self, seed: u64) {
        let values = &self.values;
        let get = |id| S::narrow(values.get(id));
        let controller = Controller::new(
            [[get(Id::C11), get(Id::C21)], [get(Id::C12), get(Id::C22)]].into(),
            [get(Id::H1), get(Id::H2)].into(),
        );
        let model = Model::new(
            [[get(Id::A11), get(Id::A21)], [get(Id::A12), get(Id::A22)]].into(),
            [get(Id::B1), get(Id::B2)].into(),
        );
        // Parameters are checked when they are set, so neither can be refused.
        let _ = self.brain.set_controller(controller);
        let _ = self.brain.set_model(model);
        self.brain.forget();
        self.brain.stimulus_mut().restart(seed);
        self.noise.restart(seed);
        self.tick = 0;
        self.until_control = 0;
        if !self.armed() {
            // A robot that lies or stands somewhere else from now on; one that rolls goes on from where it is.
            self.axes.restart();
        }
        self.note_matrices();
    }

    fn event(&mut self, event: Event) -> RobotMessage {
        match self.safety.handle(event) {
            Ok(state) => {
                if state == SafetyState::Armed {
                    // What moves from now on is no body at rest.
                    self.calibrator.give_up();
                }
                RobotMessage::State(state)
            }
            Err(refusal) => RobotMessage::Refused(refusal),
        }
    }

    fn choose_sensors(&mut self, simulated: bool) -> RobotMessage {
        if self.armed() {
            return RobotMessage::Refused(Refusal::WhileArmed);
        }
        self.homing = None;
        self.calibrator.give_up();
        if !simulated {
            if let Some(own) = self.own.take() {
                (self.values, self.brain) = (own.values, own.brain);
                self.apply_gains();
                self.apply_noise();
                self.note_matrices();
                self.axes.calibrate(own.calibration);
            }
        } else if self.own.is_none() {
            let calibration = *self.axes.calibration();
            self.own = Some(Own { values: self.values.clone(), brain: self.brain.clone(), calibration });
            // The host's readings are along the body's axes and without error.
            self.axes.calibrate(Axes::uncalibrated());
        }
        self.axes.restart();
        RobotMessage::State(self.safety.state())
    }

    fn note_matrices(&mut self) {
        self.state.c = rows(&self.brain.controller().c);
        self.state.h = self.brain.controller().h.into();
        self.state.a = rows(&self.brain.model().a);
        self.state.b = self.brain.model().b.into();
    }

    /// The brain after the last control step, for the host.
    pub fn telemetry(&self) -> Telemetry {
        let s = &self.state;
        Telemetry {
            tick: self.tick.wrapping_sub(1),
            state: self.stepped_in,
            x: s.x.map(S::to_f32),
            y: s.y.map(S::to_f32),
            c: s.c.map(S::to_f32),
            h: s.h.map(S::to_f32),
            a: s.a.map(S::to_f32),
            b: s.b.map(S::to_f32),
            xi: s.xi.map(S::to_f32),
            time_loop_error: s.time_loop_error.to_f32(),
        }
    }
}

/// A 2×2 matrix row by row.
fn rows<S: Scalar>(m: &nalgebra::SMatrix<S, 2, 2>) -> [S; 4] {
    [m.m11, m.m12, m.m21, m.m22]
}
