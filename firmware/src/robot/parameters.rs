//! The robot's parameters: what they are now, and what follows when one is set.

use protocol::message::Refusal;
use protocol::parameter::{COUNT, Scope, Sign};
use protocol::{Id, RobotMessage, Values};

use super::Robot;
use crate::brain::{Drive, Entry, Rule, Settings};
use crate::scalar::Scalar;
use crate::storage::Record;

impl<S: Scalar> Robot<S> {
    /// The value of a parameter now: of the matrices, what the brain has learned.
    pub fn get(&self, id: Id) -> f64 {
        let held = |id| entry(id).and_then(|entry| self.brain.get(entry)).unwrap_or_else(S::zero);
        let half = S::from_f64(0.5);
        match id {
            Id::Coupling1 => (half * (held(Id::C11) + held(Id::C22))).to_f64(),
            Id::Coupling2 => (half * (held(Id::C12) - held(Id::C21))).to_f64(),
            _ if entry(id).is_some() => held(id).to_f64(),
            _ => self.values.get(id).to_f64(),
        }
    }

    /// Sets a parameter, from the next step on.
    ///
    /// # Errors
    /// [`Refusal::BadValue`] or [`Refusal::NotTheRobots`]; nothing is then changed.
    pub fn set(&mut self, id: Id, value: f64) -> Result<(), Refusal> {
        let parameter = id.bounds();
        if !parameter.scope.is_robot() {
            return Err(Refusal::NotTheRobots);
        }
        parameter.check(value).map_err(|_| Refusal::BadValue)?;
        let value = S::Wide::from_f64(value);
        self.values.set(id, value);
        if let Some(entries) = id.coupled() {
            for (entry, sign) in entries {
                self.set_entry(entry, if sign == Sign::Same { value } else { -value });
            }
            return Ok(());
        }
        match parameter.scope {
            Scope::Brain => {
                self.set_entry(id, value);
                self.apply_settings();
            }
            Scope::Stimulus => self.apply_drive(),
            Scope::Sensor => self.apply_noise(),
            Scope::Servo | Scope::Plant => self.apply_gains(),
        }
        Ok(())
    }

    /// Everything that is worth keeping over a power cut.
    pub(super) fn record(&self) -> Record {
        let mut parameters = [0.0; COUNT];
        for &id in Id::ALL {
            parameters[usize::from(id.index())] = self.get(id) as f32;
        }
        Record { parameters, calibration: *self.axes.calibration() }
    }

    pub(super) fn answer_parameter(
        &mut self,
        index: u8,
        act: impl FnOnce(&mut Self, Id) -> Result<(), Refusal>,
    ) -> RobotMessage {
        let Some(id) = Id::from_index(index) else { return RobotMessage::Refused(Refusal::UnknownParameter) };
        if !id.bounds().scope.is_robot() {
            return RobotMessage::Refused(Refusal::NotTheRobots);
        }
        match act(self, id) {
            Ok(()) => RobotMessage::Parameter { index, value: self.get(id) as f32 },
            Err(refusal) => RobotMessage::Refused(refusal),
        }
    }

    /// Puts a value into the brain's matrices, if it is one of theirs.
    fn set_entry(&mut self, id: Id, value: S::Wide) {
        let Some(entry) = entry(id) else { return };
        self.values.set(id, value);
        // The value is finite and the entry exists: nothing to refuse.
        let _ = self.brain.set(entry, S::narrow(value));
        self.note_matrices();
    }

    pub(super) fn apply_settings(&mut self) {
        // The table's ranges lie within those of the settings: a test says so.
        let _ = self.brain.set_settings(settings(&self.values));
    }

    pub(super) fn apply_drive(&mut self) {
        let get = |id| self.values.get(id);
        let drive = Drive {
            period: get(Id::Period),
            phaseshift: get(Id::Phaseshift),
            amplitude: get(Id::Amplitude),
            noise: get(Id::Noise),
            color: get(Id::Color),
        };
        let _ = self.brain.stimulus_mut().set_drive(drive);
    }

    pub(super) fn apply_gains(&mut self) {
        self.axes.retune(&self.values, S::Wide::to_f32);
    }

    pub(super) fn apply_noise(&mut self) {
        let get = |id| self.values.get(id).to_f32();
        self.noise.set(get(Id::SensorNoise), get(Id::SensorNoiseTau));
    }
}

/// The entry of the brain's matrices that a parameter is, if it is one.
fn entry(id: Id) -> Option<Entry> {
    use Entry::{A, B, C, H};
    Some(match id {
        Id::C11 => C(0, 0),
        Id::C12 => C(0, 1),
        Id::C21 => C(1, 0),
        Id::C22 => C(1, 1),
        Id::H1 => H(0),
        Id::H2 => H(1),
        Id::A11 => A(0, 0),
        Id::A12 => A(0, 1),
        Id::A21 => A(1, 0),
        Id::A22 => A(1, 1),
        Id::B1 => B(0),
        Id::B2 => B(1),
        _ => return None,
    })
}

/// The brain's settings that these parameters stand for.
pub fn settings<W: Scalar>(values: &Values<W>) -> Settings<W> {
    let get = |id| values.get(id);
    Settings {
        rule: Rule::from_number(get(Id::Rule).to_f32() as u8).unwrap_or_default(),
        eps_a: get(Id::EpsA),
        eps_c: get(Id::EpsC),
        lambda_a: get(Id::LambdaA),
        lambda_b: get(Id::LambdaB),
        lambda_c: get(Id::LambdaC),
        lambda_h: get(Id::LambdaH),
        clip_a: get(Id::ClipA),
        clip_c: get(Id::ClipC),
        clip_h: get(Id::ClipH),
        clip_zeta: get(Id::ClipZeta),
        clip_v: get(Id::ClipV),
        ridge: get(Id::Ridge),
        gain_floor: get(Id::GainFloor),
        pivot_floor: get(Id::PivotFloor),
    }
}
