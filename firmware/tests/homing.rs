//! Homing against a simulated axis: motor, friction, end blocks, gravity; sound ones and broken ones.

use firmware::axes::COUNTS_PER_METRE;
use firmware::homing::{AXIS_TICKS, BACKWARDS, DUTY_LIMIT, Homing, HomingStep};
use proptest::prelude::*;

/// Steps of the simulation in a servo tick.
const STEPS: usize = 20;
const STOP: f64 = 0.065;
/// Weight and rotor, kg.
const MASS: f64 = 0.65;

/// One axis: the motor of `tabletop` on a supply of 12 V times `supply`, and what is wrong with it.
#[derive(Clone, Debug)]
struct Rail {
    position: f64,
    velocity: f64,
    /// Force along the axis, N.
    gravity: f64,
    supply: f64,
    coulomb: f64,
    /// Places of the end blocks, m.
    stops: [f64; 2],
    encoder: Encoder,
    /// Count at position 0, which the robot does not know.
    zero: i32,
    fastest: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Encoder {
    Sound,
    Reversed,
    Dead,
}

impl Default for Rail {
    fn default() -> Self {
        Rail {
            position: 0.0,
            velocity: 0.0,
            gravity: 0.0,
            supply: 1.0,
            coulomb: 1.0,
            stops: [-STOP, STOP],
            encoder: Encoder::Sound,
            zero: 0,
            fastest: 0.0,
        }
    }
}

impl Rail {
    fn count(&self) -> i32 {
        let moved = (self.position * f64::from(COUNTS_PER_METRE)).floor() as i32;
        self.zero.wrapping_add(match self.encoder {
            Encoder::Sound => moved,
            Encoder::Reversed => -moved,
            Encoder::Dead => 0,
        })
    }

    fn step(&mut self, duty: f32) {
        let dt = 1e-3 / STEPS as f64;
        for _ in 0..STEPS {
            let mut force = 30.0 * self.supply * f64::from(duty) + self.gravity - (25.0 + 1.0) * self.velocity;
            let beyond = self.position - self.position.clamp(self.stops[0], self.stops[1]);
            force -= beyond * MASS * 1e5 * (1.0 + 0.5 * self.velocity * beyond.signum()).max(0.0);
            // Friction takes what it can of the speed that the other forces give.
            let speed = self.velocity + force / MASS * dt;
            let brake = self.coulomb / MASS * dt;
            self.velocity = if speed.abs() <= brake { 0.0 } else { speed - brake * speed.signum() };
            self.position += self.velocity * dt;
            self.fastest = self.fastest.max(self.velocity.abs());
        }
    }
}

/// Runs homing to its end; returns it with the time it took, ms.
fn home(rails: &mut [Rail; 2], gravity: impl Fn(usize) -> [f64; 2]) -> (HomingStep, usize) {
    let mut homing = Homing::new();
    for tick in 0.. {
        let step = homing.tick([rails[0].count(), rails[1].count()]);
        let HomingStep::Drive(duty) = step else { return (step, tick) };
        let pull = gravity(tick);
        for i in 0..2 {
            assert!(duty[i].abs() <= DUTY_LIMIT, "duty {}", duty[i]);
            rails[i].gravity = pull[i];
            rails[i].step(duty[i]);
        }
        assert!(tick <= 2 * usize::from(AXIS_TICKS), "homing does not end");
    }
    unreachable!("it ends or fails")
}

fn done(rails: &[Rail; 2], outcome: HomingStep) -> Result<(), TestCaseError> {
    let HomingStep::Done(middle) = outcome else {
        return Err(TestCaseError::fail(format!("{outcome:?}")));
    };
    for i in 0..2 {
        let off = f64::from(middle[i].wrapping_sub(rails[i].zero)) / f64::from(COUNTS_PER_METRE);
        let truth = (rails[i].stops[0] + rails[i].stops[1]) / 2.0;
        prop_assert!((off - truth).abs() < 4e-4, "middle of axis {i} is {:.2} mm off", 1e3 * (off - truth));
    }
    Ok(())
}

/// A rail that homes, whatever is done with it: anywhere, any supply between an empty and a full battery.
fn sound() -> impl Strategy<Value = Rail> {
    (-STOP..STOP, 0.75..1.4f64, 0.3..1.5f64, any::<i32>(), -0.0015..0.0015f64, -0.0015..0.0015f64).prop_map(
        |(position, supply, coulomb, zero, low, high)| Rail {
            position: position * 0.97,
            supply,
            coulomb,
            zero,
            stops: [-STOP + low, STOP + high],
            ..Rail::default()
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_middle_is_found_from_anywhere_with_gravity_of_either_sign(
        rails in [sound(), sound()], pull in [-6.4..6.4f64, -6.4..6.4f64],
    ) {
        let mut rails = rails;
        let (outcome, ticks) = home(&mut rails, |_| pull);
        done(&rails, outcome)?;
        prop_assert!(ticks < 2 * usize::from(AXIS_TICKS));
        prop_assert!(rails.iter().all(|rail| rail.fastest < 0.4), "{} m/s", rails[0].fastest.max(rails[1].fastest));
        for (rail, pull) in rails.iter().zip(pull) {
            prop_assert!(rail.position.abs() < 0.015, "left at {} m with {pull} N", rail.position);
        }
    }

    #[test]
    fn the_barrel_may_roll_meanwhile(rails in [sound(), sound()], rate in 0.5..6.0f64, phase in 0.0..6.3f64) {
        let mut rails = rails;
        let (outcome, _) = home(&mut rails, |tick| {
            let (sin, cos) = (phase + rate * 1e-3 * tick as f64).sin_cos();
            [3.5 * sin, 3.5 * cos]
        });
        done(&rails, outcome)?;
    }

    #[test]
    fn a_jam_anywhere_but_at_the_very_end_fails(
        rails in [sound(), sound()], axis in 0..2usize, at in -0.05..0.05f64, side in 0..2usize,
        pull in [-3.5..3.5f64, -3.5..3.5f64],
    ) {
        let mut rails = rails;
        let rail = &mut rails[axis];
        rail.stops[side] = at;
        rail.position = rail.position.clamp(rail.stops[0], rail.stops[1]);
        let (outcome, ticks) = home(&mut rails, |_| pull);
        prop_assert_eq!(outcome, HomingStep::Failed);
        prop_assert!(ticks < 2 * usize::from(AXIS_TICKS));
    }

    #[test]
    fn a_reversed_encoder_fails(rails in [sound(), sound()], axis in 0..2usize, pull in [-3.5..3.5f64, -3.5..3.5f64]) {
        let mut rails = rails;
        rails[axis].encoder = Encoder::Reversed;
        let (outcome, ticks) = home(&mut rails, |_| pull);
        prop_assert_eq!(outcome, HomingStep::Failed);
        prop_assert!(ticks < 2 * usize::from(AXIS_TICKS));
    }

    #[test]
    fn a_dead_encoder_fails_within_a_second_of_its_turn(
        rails in [sound(), sound()], axis in 0..2usize, pull in [-3.5..3.5f64, -3.5..3.5f64],
    ) {
        let mut rails = rails;
        rails[axis].encoder = Encoder::Dead;
        let (outcome, ticks) = home(&mut rails, |_| pull);
        prop_assert_eq!(outcome, HomingStep::Failed);
        prop_assert!(ticks < 1000 + axis * usize::from(AXIS_TICKS), "{} ms", ticks);
    }

    #[test]
    fn a_dead_motor_fails(rails in [sound(), sound()], axis in 0..2usize, pull in [-3.5..3.5f64, -3.5..3.5f64]) {
        let mut rails = rails;
        rails[axis].supply = 0.0;
        let (outcome, ticks) = home(&mut rails, |_| pull);
        prop_assert_eq!(outcome, HomingStep::Failed);
        prop_assert!(ticks < 2 * usize::from(AXIS_TICKS));
    }

    #[test]
    fn a_stop_that_has_come_off_fails(rails in [sound(), sound()], axis in 0..2usize, side in 0..2usize) {
        let mut rails = rails;
        rails[axis].stops[side] *= 3.0;
        prop_assert_eq!(home(&mut rails, |_| [0.0; 2]).0, HomingStep::Failed);
    }

    #[test]
    fn whatever_the_encoders_say_it_ends_and_keeps_its_limit(
        counts in proptest::collection::vec((-900..900i32, any::<i32>()), 1..50), wild in 0..20usize,
        hold in 1..400usize,
    ) {
        let mut homing = Homing::new();
        let mut ended = None;
        for tick in 0..=2 * usize::from(AXIS_TICKS) {
            let place = (tick / hold) % counts.len();
            let (near, far) = counts[place];
            match homing.tick([near, if place == wild { far } else { near / 2 }]) {
                HomingStep::Drive(duty) => {
                    prop_assert!(ended.is_none(), "it drove again after its end");
                    prop_assert!(duty.iter().all(|d| d.abs() <= DUTY_LIMIT));
                }
                step => {
                    ended = Some(step);
                    if step != HomingStep::Failed {
                        break;
                    }
                }
            }
        }
        prop_assert!(ended.is_some());
    }
}

#[test]
fn both_axes_take_less_than_ten_seconds() {
    let mut rails = [Rail { position: 0.06, ..Rail::default() }, Rail { position: 0.06, ..Rail::default() }];
    let (outcome, ticks) = home(&mut rails, |_| [3.4, -3.4]);
    done(&rails, outcome).expect("found");
    println!("homing took {ticks} ms, the weights moved at {:.3} m/s at most", rails[0].fastest);
    assert!(ticks < 10_000, "{ticks} ms");
}

#[test]
fn the_other_weight_is_held() {
    let mut homing = Homing::new();
    let mut rails = [Rail { position: 0.03, ..Rail::default() }, Rail { position: -0.02, ..Rail::default() }];
    for _ in 0..3000 {
        let HomingStep::Drive(duty) = homing.tick([rails[0].count(), rails[1].count()]) else {
            panic!("it has just begun");
        };
        for i in 0..2 {
            rails[i].gravity = -3.4;
            rails[i].step(duty[i]);
        }
        assert!((rails[1].position + 0.02).abs() < f64::from(BACKWARDS) / 2.0, "{} m", rails[1].position);
    }
    assert!(rails[0].position > 0.0, "axis 1 is on its way to the positive end");
}
