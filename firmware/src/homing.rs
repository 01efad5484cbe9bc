//! Homing: finds the middle of both axes, whose encoders only count and do not know where they started.
//!
//! A weight is moved to the negative end of its axis until it no longer follows, then to the positive end, then to the
//! middle between the two. The set point goes ahead at [`SPEED`], at most [`LEAD`] from the weight, and the ordinary
//! [`Servo`] follows it with a limited force; its own detection of a stall is what finds the ends. How far they are
//! apart is known from the body, and nothing else is believed: a jam, an encoder that is dead or the wrong way round, a
//! motor without power, a stop that has come off all give another distance.
//!
//! One axis after the other, and the other weight is held where it is: first where it lay, then in the middle. A weight
//! at the end of its axis turns a barrel that lies on a table by its weight times 65 mm; two of them at once would turn
//! it by √2 as much, twice as fast, and a weight left to itself would slide and bump as the barrel rolls. It also loads
//! the supply with the stall of one motor only. The price is time, some 4 s for each axis.
//!
//! What cannot be told: a jam within [`STOP_TOLERANCE`] of an end. It shifts the middle by half of that.

use crate::axes::{AXIS, SERVO_PARAMETERS};
use crate::servo::{Axis, Servo, ServoError, ServoSettings, Stall};
use crate::timing::SERVO_PERIOD;

/// Distance of the two end blocks of an axis, m: they stand at ±65 mm.
pub const STOP_DISTANCE: f32 = 0.130;

/// How far that distance may be off, m.
pub const STOP_TOLERANCE: f32 = 0.004;

/// Speed at which the set point moves, m/s.
pub const SPEED: f32 = 0.1;

/// Largest force, N: half of what the servo may use otherwise, and twice what a weight and its friction ask for.
pub const FORCE: f32 = 12.0;

/// Largest duty.
pub const DUTY_LIMIT: f32 = 0.5;

/// Farthest that the set point goes ahead of the weight, m: a little more than the servo needs to reach [`FORCE`].
pub const LEAD: f32 = 0.022;

/// Farthest that a weight may be on the wrong side of where it was or belongs, m. Gravity alone pulls it 11 mm.
pub const BACKWARDS: f32 = 0.025;

/// Nearest to the middle that counts as there, m.
const ARRIVED: f32 = 0.008;

/// Servo ticks for one axis; it takes 4500 with the whole way to go at first.
pub const AXIS_TICKS: u16 = 6000;

/// The axis as homing sees it, from where the weight was at the start: it may be anywhere, so that there is twice as
/// much way to either side.
const SEARCHED: Axis = Axis {
    travel: 1.5 * STOP_DISTANCE,
    duty_limit: DUTY_LIMIT,
    // At FORCE the duty is 0.4; the slowest ramp moves a weight by 15 mm in this time.
    stall: Stall { duty: 0.36, movement: 0.001, ticks: 150 },
    ..AXIS
};

/// What homing wants in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HomingStep {
    /// Go on with these duties, within ±[`DUTY_LIMIT`].
    Drive([f32; 2]),
    /// Done: the raw encoder count of the middle of each axis.
    Done([i32; 2]),
    /// The ends of an axis are not where they should be; see [`protocol::FaultCode::Homing`]. Nothing more is driven.
    Failed,
}

/// Homing of both axes, begun with the first tick.
#[derive(Clone, Debug)]
pub struct Homing {
    servos: [Servo; 2],
    /// Raw counts at the first tick, from which all else is counted.
    origin: Option<[i32; 2]>,
    /// Set points, m.
    references: [f32; 2],
    /// The axis that is looked at, and how far it is.
    axis: usize,
    leg: Leg,
    /// Where this leg began, m.
    began: f32,
    /// Servo ticks on this axis.
    ticks: u16,
    /// The middles found so far, counts from the origin.
    middle: [i32; 2],
    failed: bool,
}

/// Where the weight is being moved to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Leg {
    NegativeStop,
    PositiveStop {
        /// Count at the negative stop, from the origin.
        from: i32,
    },
    Middle,
}

impl Homing {
    /// About to begin.
    pub fn new() -> Self {
        let body = |id| SERVO_PARAMETERS.iter().find(|(i, _)| *i == id).map_or(0.0, |(_, value)| *value as f32);
        // A weight is moved once: the integral is to be quick enough to bring it to the middle against gravity.
        let settings = ServoSettings { max_force: FORCE, ki: 2.0, ..ServoSettings::from_parameters(body) };
        let servo = Servo::new(settings, SEARCHED);
        Homing {
            servos: [servo.clone(), servo],
            origin: None,
            references: [0.0; 2],
            axis: 0,
            leg: Leg::NegativeStop,
            began: 0.0,
            ticks: 0,
            middle: [0; 2],
            failed: false,
        }
    }

    /// One servo tick, with the raw encoder counts of both axes.
    pub fn tick(&mut self, counts: [i32; 2]) -> HomingStep {
        if self.failed {
            return HomingStep::Failed;
        }
        let step = self.advance(counts).unwrap_or(HomingStep::Failed);
        self.failed = step == HomingStep::Failed;
        step
    }

    /// `None` if homing has failed.
    fn advance(&mut self, counts: [i32; 2]) -> Option<HomingStep> {
        let origin = *self.origin.get_or_insert(counts);
        let travelled: [i32; 2] = core::array::from_fn(|i| counts[i].wrapping_sub(origin[i]));
        let mut duty = [0.0; 2];
        let mut stalled = false;
        for i in 0..2 {
            let position = AXIS.position(travelled[i]);
            match self.servos[i].update(self.references[i], position, SERVO_PERIOD as f32) {
                Ok(drive) => duty[i] = drive.duty,
                Err(ServoError::Stalled) if i == self.axis => stalled = true,
                Err(_) => return None,
            }
            if i != self.axis && (position - self.references[i]).abs() > BACKWARDS {
                return None;
            }
        }
        self.ticks += 1;
        if self.ticks > AXIS_TICKS {
            return None;
        }
        let count = travelled[self.axis];
        let position = AXIS.position(count);
        match self.leg {
            Leg::NegativeStop => {
                self.lead(position, -1.0)?;
                if stalled {
                    self.begin(Leg::PositiveStop { from: count }, position);
                }
            }
            Leg::PositiveStop { from } => {
                self.lead(position, 1.0)?;
                if stalled {
                    if (position - self.began - STOP_DISTANCE).abs() > STOP_TOLERANCE {
                        return None;
                    }
                    self.middle[self.axis] = from + (count - from) / 2;
                    self.begin(Leg::Middle, position);
                }
            }
            Leg::Middle => {
                if stalled {
                    return None;
                }
                let middle = AXIS.position(self.middle[self.axis]);
                let reference = &mut self.references[self.axis];
                *reference = (*reference - SPEED * SERVO_PERIOD as f32).max(middle);
                if *reference == middle && (position - middle).abs() < ARRIVED {
                    if self.axis == 1 {
                        return Some(HomingStep::Done(core::array::from_fn(|i| {
                            origin[i].wrapping_add(self.middle[i])
                        })));
                    }
                    self.axis = 1;
                    self.ticks = 0;
                    self.begin(Leg::NegativeStop, AXIS.position(travelled[1]));
                }
            }
        }
        Some(HomingStep::Drive(duty))
    }

    /// Takes the set point of the axis ahead; `None` if the weight went the wrong way, or past where the stop should
    /// be.
    fn lead(&mut self, position: f32, direction: f32) -> Option<()> {
        let gone = direction * (position - self.began);
        if !(-BACKWARDS..=STOP_DISTANCE + STOP_TOLERANCE).contains(&gone) {
            return None;
        }
        let reference = &mut self.references[self.axis];
        let next = *reference + direction * SPEED * SERVO_PERIOD as f32;
        *reference = next.clamp(position - LEAD, position + LEAD);
        Some(())
    }

    /// Turns round without a bump: from where the weight is, and without the past.
    fn begin(&mut self, leg: Leg, position: f32) {
        self.leg = leg;
        self.began = position;
        self.references[self.axis] = position;
        self.servos[self.axis].reset();
    }
}

impl Default for Homing {
    fn default() -> Self {
        Homing::new()
    }
}
