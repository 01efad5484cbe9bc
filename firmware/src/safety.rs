//! Safety: the one place that decides whether the motors get anything at all.
//!
//! ```text
//!            Arm                    any fault, EmergencyStop
//! Disarmed ───────► Armed ─────────────────────────────────► Fault(code)
//!     ▲  ◄─────────── │                                       │    ▲
//!     │     Disarm                                            │    │ any fault, EmergencyStop, from Disarmed too
//!     └───────────────────────────────── ClearFault ──────────┘
//! ```
//!
//! An [`Outputs`] that is not zero can be made in one way only: by [`Armed::drive`]. An [`Armed`] exists only inside the
//! tick in which [`Safety::tick`] has found the robot armed and everything in order; it borrows the [`Safety`], can be
//! neither stored beyond the next tick nor copied, and is used up by driving. The power stage takes [`Outputs`] by value,
//! so no other code has to be right for "zero unless Armed" to hold:
//!
//! ```compile_fail,E0451
//! let forged = firmware::safety::Outputs::<2> { duty: [1.0, 1.0] }; // the field is private
//! ```
//! ```compile_fail,E0382
//! fn twice<const S: usize>(armed: firmware::safety::Armed<'_, S>) {
//!     let first = armed.drive([0.1, 0.1]);
//!     let second = armed.drive([0.1, 0.1]); // used up
//! }
//! ```
//! ```compile_fail,E0499
//! fn kept(safety: &mut firmware::safety::Safety<1>, health: &firmware::safety::Health<1>) {
//!     let old = safety.tick(health);
//!     let new = safety.tick(health); // `old` still holds the Safety
//!     old.map(|armed| armed.drive([1.0]));
//! }
//! ```
//!
//! The state machine is the whole of it: no clock, no pin, no allocation. `tests/safety.rs` walks through every state
//! that can be reached.

use protocol::message::{FaultCode, Refusal, SafetyState};

/// Every fault code, in the order in which a tick looks for them: the first one found is the one that is shown.
pub const FAULT_CODES: [FaultCode; 11] = [
    FaultCode::EmergencyStop,
    FaultCode::Watchdog,
    FaultCode::Panic,
    FaultCode::HardFault,
    FaultCode::BrownOut,
    FaultCode::MissedDeadline,
    FaultCode::StaleSensor,
    FaultCode::ImpossibleSensor,
    FaultCode::NonFinite,
    FaultCode::StalledAxis,
    FaultCode::Homing,
];

/// A set of fault codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults(u16);

impl Faults {
    /// No fault.
    pub const NONE: Faults = Faults(0);

    /// The set with `code` in it.
    #[must_use]
    pub const fn with(self, code: FaultCode) -> Faults {
        Faults(self.0 | 1 << bit(code))
    }

    /// The set with `code` in it if `condition` holds.
    #[must_use]
    pub const fn with_if(self, code: FaultCode, condition: bool) -> Faults {
        if condition { self.with(code) } else { self }
    }

    /// Whether `code` is in the set.
    pub const fn contains(self, code: FaultCode) -> bool {
        self.0 & 1 << bit(code) != 0
    }

    /// Whether there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The codes in the set, in the order of [`FAULT_CODES`].
    pub fn iter(self) -> impl Iterator<Item = FaultCode> {
        FAULT_CODES.into_iter().filter(move |code| self.contains(*code))
    }
}

/// Without a catch-all arm: a new code does not compile until it has its place here (and in [`FAULT_CODES`]).
const fn bit(code: FaultCode) -> u16 {
    match code {
        FaultCode::EmergencyStop => 0,
        FaultCode::Watchdog => 1,
        FaultCode::Panic => 2,
        FaultCode::BrownOut => 3,
        FaultCode::MissedDeadline => 4,
        FaultCode::StaleSensor => 5,
        FaultCode::ImpossibleSensor => 6,
        FaultCode::NonFinite => 7,
        FaultCode::StalledAxis => 8,
        FaultCode::HardFault => 9,
        FaultCode::Homing => 10,
    }
}

/// What happens to the robot from outside a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Lets the brain move the weights, from the next tick on. Refused in Fault.
    Arm,
    /// Outputs to zero. Does not clear a fault.
    Disarm,
    /// The host, or a button, says stop: Fault, from any state.
    EmergencyStop,
    /// From Fault to Disarmed. A cause that persists brings the fault back in the next tick.
    ClearFault,
    /// A part of the robot found something wrong: Fault, from any state.
    Fault(FaultCode),
}

/// What one servo tick found, with one entry for each of `S` sensors. There is no default: who calls has looked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Health<const S: usize> {
    /// Whether each sensor was read since the last tick.
    pub fresh: [bool; S],
    /// What the parts of the robot found wrong in this tick: impossible sensor, stalled axis, non-finite brain, missed
    /// deadline, the emergency stop's button.
    ///
    /// [`FaultCode::StalledAxis`] counts only while Armed: an axis that gets no power cannot follow.
    pub faults: Faults,
}

/// The state machine, for a robot with `S` sensors.
///
/// A sensor that was not read for more than its limit of servo ticks is stale. The counters run in every state, so
/// nobody arms a robot that cannot see.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Safety<const S: usize> {
    state: Inner,
    /// Ticks without a reading that each sensor is allowed.
    limits: [u16; S],
    /// Ticks since each sensor was read.
    ages: [u32; S],
}

/// [`SafetyState`] with what belongs to each state and only to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Inner {
    Disarmed,
    Armed,
    Fault {
        /// The one that led here.
        first: FaultCode,
        /// All of them, the first included.
        all: Faults,
    },
}

impl<const S: usize> Safety<S> {
    /// A robot that has just started: Disarmed, or in Fault if its last run ended in one (`cause` from the reset
    /// flags: [`FaultCode::Watchdog`], [`FaultCode::Panic`], [`FaultCode::HardFault`], [`FaultCode::BrownOut`]).
    ///
    /// `limits` holds for each sensor how many ticks in a row may pass without a reading: 0 where every tick must
    /// have one.
    pub fn new(limits: [u16; S], cause: Option<FaultCode>) -> Self {
        let mut safety = Safety { state: Inner::Disarmed, limits, ages: [0; S] };
        if let Some(code) = cause {
            safety.fault(code);
        }
        safety
    }

    /// The state, as telemetry carries it; a fault shows the code that came first.
    pub fn state(&self) -> SafetyState {
        match self.state {
            Inner::Disarmed => SafetyState::Disarmed,
            Inner::Armed => SafetyState::Armed,
            Inner::Fault { first, .. } => SafetyState::Fault(first),
        }
    }

    /// Every fault since the last [`Event::ClearFault`], the first included.
    pub fn faults(&self) -> Faults {
        match self.state {
            Inner::Disarmed | Inner::Armed => Faults::NONE,
            Inner::Fault { all, .. } => all,
        }
    }

    /// Carries out an event and returns the state it led to; only [`Event::Arm`] can be refused, in Fault.
    pub fn handle(&mut self, event: Event) -> Result<SafetyState, Refusal> {
        match (event, self.state) {
            (Event::Arm, Inner::Fault { .. }) => return Err(Refusal::InFault),
            (Event::Arm, Inner::Disarmed | Inner::Armed) => self.state = Inner::Armed,
            (Event::Disarm, Inner::Fault { .. }) => {}
            (Event::Disarm, Inner::Disarmed | Inner::Armed) => self.state = Inner::Disarmed,
            (Event::EmergencyStop, _) => self.fault(FaultCode::EmergencyStop),
            (Event::Fault(code), _) => self.fault(code),
            (Event::ClearFault, Inner::Fault { .. }) => {
                self.state = Inner::Disarmed;
                // A sensor that was away has its full limit of ticks to come back.
                self.ages = [0; S];
            }
            (Event::ClearFault, Inner::Disarmed | Inner::Armed) => {}
        }
        Ok(self.state())
    }

    /// One servo tick, after sensors, brain and servo and before the motors. `Some` if the motors may move.
    ///
    /// A fault in `health` takes the outputs away in this very tick.
    pub fn tick(&mut self, health: &Health<S>) -> Option<Armed<'_, S>> {
        let mut faults = health.faults;
        for ((age, fresh), limit) in self.ages.iter_mut().zip(health.fresh).zip(self.limits) {
            // One more than the limit is as stale as it gets.
            let limit = u32::from(limit);
            *age = if fresh { 0 } else { (*age + 1).min(limit + 1) };
            faults = faults.with_if(FaultCode::StaleSensor, *age > limit);
        }
        // Nearly always there is none to look for.
        if !faults.is_empty() {
            let armed = self.state == Inner::Armed;
            for code in faults.iter().filter(|code| armed || *code != FaultCode::StalledAxis) {
                self.fault(code);
            }
        }
        match self.state {
            Inner::Armed => Some(Armed { safety: self }),
            Inner::Disarmed | Inner::Fault { .. } => None,
        }
    }

    fn fault(&mut self, code: FaultCode) {
        self.state = match self.state {
            Inner::Disarmed | Inner::Armed => Inner::Fault { first: code, all: Faults::NONE.with(code) },
            Inner::Fault { first, all } => Inner::Fault { first, all: all.with(code) },
        };
    }
}

/// The right to move the motors in this tick; see [`Safety::tick`].
#[derive(Debug)]
#[must_use = "without `drive` the motors get nothing"]
pub struct Armed<'a, const S: usize> {
    safety: &'a mut Safety<S>,
}

impl<const S: usize> Armed<'_, S> {
    /// Outputs with these duties, cut off at ±1. A duty that is not a number faults at once and gives zero on all axes.
    pub fn drive<const M: usize>(self, duty: [f32; M]) -> Outputs<M> {
        if duty.iter().all(|d| d.is_finite()) {
            Outputs { duty: duty.map(|d| d.clamp(-1.0, 1.0)) }
        } else {
            self.safety.fault(FaultCode::NonFinite);
            Outputs::ZERO
        }
    }
}

/// What the power stage of `M` motors is given. Not to be had with anything but zero except from [`Armed::drive`], and
/// not to be copied.
#[derive(Debug, PartialEq)]
pub struct Outputs<const M: usize> {
    duty: [f32; M],
}

impl<const M: usize> Outputs<M> {
    /// Nothing on any motor.
    pub const ZERO: Outputs<M> = Outputs { duty: [0.0; M] };

    /// Duty of each motor, −1…1.
    pub fn duty(&self) -> [f32; M] {
        self.duty
    }
}
