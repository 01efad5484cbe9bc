//! The channels: everything that is known of a barrel in one control step, a number each, in one table.

use hil_sim::record::{BrainRecord, PlantRecord};
use protocol::message::{Transducers, Vitals};

/// Raw readings of the inertial sensor for 1 m/s² and for 1 rad/s: ±4 g and ±2000 °/s over 16 bits.
const ACCELERATION: f32 = 8192.0 / 9.806_65;
const RATE: f32 = 16.4 * 180.0 / core::f32::consts::PI;

/// A branch of the tree in which channels are picked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Group {
    /// x: the inclinations of the two axes.
    Sensors,
    /// y: what the controller wants of the motors.
    Motors,
    /// C and h.
    Controller,
    /// A and b.
    Model,
    /// ξ, E and the time loop error.
    Errors,
    /// How the barrel moves.
    Motion,
    /// The weights and what drives them.
    Servo,
    /// What an inertial sensor feels.
    Imu,
    /// What pushes the barrel from outside.
    Load,
    /// How the microcontroller and its board are.
    Board,
    /// The barrel's attitude, for the scene.
    Attitude,
}

impl Group {
    /// Every group, in the tree's order.
    pub const ALL: [Group; 11] = [
        Group::Sensors,
        Group::Motors,
        Group::Controller,
        Group::Model,
        Group::Errors,
        Group::Motion,
        Group::Servo,
        Group::Imu,
        Group::Load,
        Group::Board,
        Group::Attitude,
    ];

    /// Its name in the tree.
    pub const fn name(self) -> &'static str {
        match self {
            Group::Sensors => "Sensors x",
            Group::Motors => "Motors y",
            Group::Controller => "Controller C, h",
            Group::Model => "Self-model A, b",
            Group::Errors => "Errors ξ, E, E_tle",
            Group::Motion => "Motion",
            Group::Servo => "Servo",
            Group::Imu => "IMU",
            Group::Load => "Load",
            Group::Board => "Board",
            Group::Attitude => "Attitude",
        }
    }
}

/// One row of [`TABLE`].
#[derive(Debug, PartialEq)]
pub struct Channel {
    /// Its name, as in the recordings where it is in them.
    pub name: &'static str,
    /// Its branch.
    pub group: Group,
    /// Its unit, empty for a pure number.
    pub unit: &'static str,
    /// What it is, in one line.
    pub help: &'static str,
}

macro_rules! channels {
    ($($id:ident $name:literal $group:ident [$unit:literal] $help:literal;)*) => {
        /// A channel; the discriminant is its row in [`TABLE`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum Id { $(#[doc = $help] $id,)* }

        impl Id {
            /// Every channel, in the table's order.
            pub const ALL: &'static [Id] = &[$(Id::$id,)*];
        }

        /// Every channel.
        pub const TABLE: &[Channel] = &[$(Channel { name: $name, group: Group::$group, unit: $unit, help: $help },)*];
    };
}

channels! {
    X1 "x1" Sensors [""] "inclination of axis 1: the vertical component of its direction";
    X2 "x2" Sensors [""] "inclination of axis 2: the vertical component of its direction";
    Y1 "y1" Motors [""] "motor value 1, -1 to 1; positive drives the weight to the negative end";
    Y2 "y2" Motors [""] "motor value 2, -1 to 1; positive drives the weight to the negative end";
    C11 "C11" Controller [""] "weight from x1 to motor 1";
    C12 "C12" Controller [""] "weight from x2 to motor 1";
    C21 "C21" Controller [""] "weight from x1 to motor 2";
    C22 "C22" Controller [""] "weight from x2 to motor 2";
    H1 "h1" Controller [""] "bias of motor 1";
    H2 "h2" Controller [""] "bias of motor 2";
    A11 "A11" Model [""] "effect of motor 1 on x1";
    A12 "A12" Model [""] "effect of motor 2 on x1";
    A21 "A21" Model [""] "effect of motor 1 on x2";
    A22 "A22" Model [""] "effect of motor 2 on x2";
    B1 "b1" Model [""] "bias of x1";
    B2 "b2" Model [""] "bias of x2";
    Xi1 "xi1" Errors [""] "prediction error of x1";
    Xi2 "xi2" Errors [""] "prediction error of x2";
    E "E" Errors [""] "prediction error, xi squared";
    Etle "E_tle" Errors [""] "time loop error, v squared; 0 in the open loop";
    NormC "|C|" Controller [""] "size of the controller: the root of the sum of its squares";
    NormA "|A|" Model [""] "size of the self-model: the root of the sum of its squares";
    Omega "omega" Motion ["rad/s"] "angular velocity about the cylinder axis";
    Phi "phi" Motion ["rad"] "rotation about the cylinder axis: the integral of omega";
    Tilt "tilt" Motion ["rad"] "tilt of the cylinder axis from the horizontal";
    Px "px" Motion ["m"] "centre of the cylinder, along the ground";
    Py "py" Motion ["m"] "centre of the cylinder, along the ground";
    Pz "pz" Motion ["m"] "centre of the cylinder, height";
    S1 "s1" Servo ["m"] "position of weight 1 on its axis";
    S2 "s2" Servo ["m"] "position of weight 2 on its axis";
    Rate1 "rate1" Servo ["m/s"] "speed of weight 1 along its axis";
    Rate2 "rate2" Servo ["m/s"] "speed of weight 2 along its axis";
    Target1 "target1" Servo ["m"] "where the servo wants weight 1";
    Target2 "target2" Servo ["m"] "where the servo wants weight 2";
    Duty1 "duty1" Servo [""] "duty of motor 1, -1 to 1";
    Duty2 "duty2" Servo [""] "duty of motor 2, -1 to 1";
    Acc1 "acc1" Imu ["m/s²"] "specific force along axis 1";
    AccC "accC" Imu ["m/s²"] "specific force along the cylinder axis";
    Acc2 "acc2" Imu ["m/s²"] "specific force along axis 2";
    Gyro1 "gyro1" Imu ["rad/s"] "angular velocity about axis 1";
    GyroC "gyroC" Imu ["rad/s"] "angular velocity about the cylinder axis";
    Gyro2 "gyro2" Imu ["rad/s"] "angular velocity about axis 2";
    Torque "torque" Load ["N·m"] "pushing torque about the cylinder axis";
    ForceX "forceX" Load ["N"] "pushing force along the ground's X";
    ForceY "forceY" Load ["N"] "pushing force along the ground's Y";
    ForceZ "forceZ" Load ["N"] "pushing force upwards";
    Awake "awake" Board ["%"] "part of the time that the core is awake";
    ServoTime "servoTime" Board ["µs"] "longest servo tick without a control step";
    BrainTime "brainTime" Board ["µs"] "longest servo tick with a control step";
    Jitter "jitter" Board ["µs"] "largest deviation of a servo tick from its period";
    Battery "battery" Board ["V"] "supply of the motors";
    Qw "qw" Attitude [""] "quaternion from body to world axes, real part";
    Qx "qx" Attitude [""] "quaternion from body to world axes, X";
    Qy "qy" Attitude [""] "quaternion from body to world axes, Y";
    Qz "qz" Attitude [""] "quaternion from body to world axes, Z";
}

/// How many channels there are.
pub const COUNT: usize = Id::ALL.len();

impl Id {
    /// Its row of the table.
    pub fn channel(self) -> &'static Channel {
        &TABLE[self as usize]
    }

    /// The channel of this name.
    pub fn from_name(name: &str) -> Option<Id> {
        Id::ALL.iter().copied().find(|id| id.channel().name == name)
    }
}

/// One control step: a number for each channel, NaN where it is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Time, s.
    pub t: f64,
    /// By [`Id`].
    pub values: [f32; COUNT],
}

impl Frame {
    /// Nothing but the time is known, s.
    pub fn at(t: f64) -> Self {
        Frame { t, values: [f32::NAN; COUNT] }
    }

    /// A number of it.
    pub fn get(&self, id: Id) -> f32 {
        self.values[id as usize]
    }

    /// Sets a number of it.
    pub fn set(&mut self, id: Id, value: f32) {
        self.values[id as usize] = value;
    }

    /// Sets consecutive numbers of it, from `first` on.
    pub fn set_all(&mut self, first: Id, values: &[f32]) {
        self.values[first as usize..][..values.len()].copy_from_slice(values);
    }

    /// Takes what is known of the brain.
    pub fn set_brain(&mut self, brain: &BrainRecord) {
        self.set_all(Id::X1, &barrel::csv::brain_row(brain));
        self.derive();
    }

    /// Computes what follows from the numbers of the brain.
    pub fn derive(&mut self) {
        for (norm, first) in [(Id::NormC, Id::C11), (Id::NormA, Id::A11)] {
            let entries = &self.values[first as usize..][..4];
            self.set(norm, entries.iter().map(|entry| entry * entry).sum::<f32>().sqrt());
        }
    }

    /// Takes what is known of the simulated barrel.
    pub fn set_plant(&mut self, plant: &PlantRecord) {
        let PlantRecord { omega, phi, weights, position, tilt, orientation } = *plant;
        self.set_all(Id::Omega, &[omega, phi, tilt].map(|number| number as f32));
        self.set_all(Id::Px, &position.map(|number| number as f32));
        self.set_all(Id::S1, &weights.map(|number| number as f32));
        self.set_all(Id::Qw, &orientation.map(|number| number as f32));
    }

    /// Takes what the inertial sensor reads.
    pub fn set_transducers(&mut self, read: &Transducers) {
        self.set_all(Id::Acc1, &read.accelerometer.map(|raw| f32::from(raw) / ACCELERATION));
        self.set_all(Id::Gyro1, &read.gyroscope.map(|raw| f32::from(raw) / RATE));
    }

    /// Takes what a board says of itself.
    pub fn set_vitals(&mut self, vitals: &Vitals) {
        self.set(Id::Awake, f32::from(vitals.load) / 100.0);
        self.set(Id::ServoTime, vitals.servo_ns as f32 / 1000.0);
        self.set(Id::BrainTime, vitals.brain_ns as f32 / 1000.0);
        self.set(Id::Jitter, vitals.jitter_ns as f32 / 1000.0);
        self.set(Id::Battery, f32::from(vitals.battery_mv) / 1000.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_recorded_column_is_a_channel_of_the_same_name_and_place() {
        let brain = barrel::csv::BRAIN_COLUMNS[1..].iter().map(|column| column.name);
        assert!(brain.eq(TABLE[..20].iter().map(|channel| channel.name)));
        for column in barrel::csv::PLANT_COLUMNS {
            assert!(Id::from_name(column.name).is_some(), "{}", column.name);
        }
    }

    #[test]
    fn names_are_unique() {
        for &id in Id::ALL {
            assert_eq!(Id::from_name(id.channel().name), Some(id));
        }
    }
}
