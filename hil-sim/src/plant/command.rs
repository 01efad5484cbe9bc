//! What a plant is told from outside: commands, pushes, and changes of what it is made of.

use super::drive::{Axis, Drive, SETPOINT_SPREAD, Setpoint, Sliders, clip};
use super::dynamics::Inertia;
use super::rolling::Line;
use super::{Body, BodyError, Ground, LOAD_LIMIT, Load, Motion, Plant, about};
use nalgebra::Vector3;

impl Plant {
    /// Puts the weights somewhere, m, at rest, with their servo's target there and its memory empty.
    pub fn place_weights(&mut self, s: [f64; 2]) {
        // Adding zero takes the sign off a negative one.
        let s = s.map(|s| if s.is_finite() { clip(s, self.body.stop) + 0.0 } else { 0.0 });
        *self.sliders_mut() = Sliders { s, ..Sliders::default() };
        self.rate_left = 0.0;
        if matches!(self.body.drive, Drive::Servo(_)) {
            self.told = Setpoint { value: s.map(|s| clip(s, self.body.range)), rate: [0.0; 2] };
        }
    }

    /// Lets φ count from `phi`, rad, on a barrel that does not lie and so has no roll of its own.
    pub fn count_roll_from(&mut self, phi: f64) {
        if let Motion::Free(free) = &mut self.motion {
            free.phi = phi;
        }
    }

    /// What the drives shall do from now on, both in ±1 (more is clipped, NaN is 0): the motor commands y of the theory for a
    /// servo, y > 0 towards the negative end of the axis, or duties for motors, positive towards the positive end.
    pub fn set_command(&mut self, command: [f64; 2]) {
        let command = command.map(|y| if y.is_nan() { 0.0 } else { clip(y, 1.0) });
        match &self.body.drive {
            Drive::Motor(_) => self.told.value = command,
            Drive::Servo(servo) => {
                let target = command.map(|y| -self.body.range * y);
                if target != self.told.value {
                    if !servo.derivative_on_measurement {
                        // What is left of the last set-point step is not lost.
                        for (i, target) in target.iter().enumerate() {
                            let pending = self.told.rate[i] * self.rate_left;
                            let step = servo.seen(target - self.told.value[i]);
                            self.told.rate[i] = (step + pending) / SETPOINT_SPREAD;
                        }
                        self.rate_left = SETPOINT_SPREAD;
                    }
                    self.told.value = target;
                }
            }
        }
    }

    /// Turns the barrel on by hand for `dt` seconds, or back where that is negative: evenly, about its own axis, and
    /// nothing else moves.
    pub fn carry_on(&mut self, dt: f64) {
        let angle = self.omega() * dt;
        match &mut self.motion {
            Motion::Rolling(line) => line.loose.roll.angle += angle,
            Motion::Free(free) => {
                free.orientation *= about(Vector3::y(), angle);
                free.phi += angle;
            }
        }
    }

    /// Sets the pushes from outside.
    pub fn set_load(&mut self, load: Load) {
        let sane = |x: f64| if x.is_nan() { 0.0 } else { clip(x, LOAD_LIMIT) };
        self.load = Load {
            axis_torque: sane(load.axis_torque),
            force_world: load.force_world.map(sane),
            torque_world: load.torque_world.map(sane),
        };
    }

    /// Sets the supply's voltage of a motor drive, V; nothing for a servo.
    pub fn set_supply_voltage(&mut self, volts: f64) {
        if let Drive::Motor(motor) = &mut self.body.drive {
            motor.supply_voltage = if volts.is_finite() { volts.clamp(0.0, 1000.0) } else { 0.0 };
            self.axis = Axis::new(&self.body.drive, self.body.weight_mass, self.body.stop);
        }
    }

    /// Changes what the barrel and its ground are made of while it moves: frictions, gravity, the drive's gains. Sizes stay
    /// those it was made with.
    ///
    /// # Errors
    /// What [`Body::validate`] finds; nothing is then changed.
    pub fn set_body(&mut self, body: Body) -> Result<(), BodyError> {
        let body = Body { radius: self.body.radius, length: self.body.length, ..body };
        body.validate()?;
        self.line = Line::of(&body);
        self.body = body;
        self.couple_drive();
        // After the masses, by which the ground's stiffness is chosen.
        self.ground = Ground::new(&self.body, &self.inertia);
        Ok(())
    }

    /// Switches the drive on or off; off, it exerts no force and the weights slide freely. On at the start.
    pub fn set_drive(&mut self, on: bool) {
        if on != self.drive_on {
            self.drive_on = on;
            self.couple_drive();
        }
    }

    /// Takes over what the drive and the masses are now.
    fn couple_drive(&mut self) {
        let mut drive = self.body.drive.clone();
        if let (Drive::Servo(servo), false) = (&mut drive, self.drive_on) {
            servo.max_force = 0.0;
            // Nor does its integral wind up meanwhile.
            servo.ki = 0.0;
        }
        self.axis = Axis::new(&drive, self.body.weight_mass, self.body.stop);
        self.inertia = Inertia::new(&self.body, &self.axis);
    }

    /// Keeps all freedoms in play even where rolling on the line would do: slower, to compare the two.
    pub fn set_always_free(&mut self, on: bool) {
        self.always_free = on;
        if on && let Motion::Rolling(line) = self.motion {
            self.leave_line(&line, self.body.step);
        }
    }
}
