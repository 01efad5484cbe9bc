//! The one table of parameters: what the console, the command line, the wire and the recorder know about each of them.
//!
//! A parameter is known by its [`Id`], which is also its index on the wire. [`TABLE`] holds its name, unit, range,
//! default and help; [`Values`] holds one number for each.

/// Who acts on a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// The brain: learning rule, rates, precautions, and the matrices themselves.
    Brain,
    /// The stimulus that drives the motors in the open loop.
    Stimulus,
    /// The position servo of the two weights: the robot's on a real body, the body's own on `chapter`.
    Servo,
    /// The simulated barrel and the ground it lies on.
    Plant,
    /// Noise on the inclinations: of the simulated sensors on `chapter`, added by the robot on a real body.
    Sensor,
}

impl Scope {
    /// Whether the robot holds this parameter (and not only the simulator around it).
    pub const fn is_robot(self) -> bool {
        !matches!(self, Scope::Plant)
    }
}

/// Which numbers a parameter takes, within its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Any number.
    Real,
    /// Whole numbers only.
    Whole,
}

/// One row of [`TABLE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// The name, as typed in the console and on the command line. Case matters.
    pub name: &'static str,
    /// The unit, empty for a pure number.
    pub unit: &'static str,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// Value of a `chapter` barrel under homeokinetic control, before an experiment's preset.
    pub default: f64,
    /// Real or whole.
    pub kind: Kind,
    /// Who acts on it.
    pub scope: Scope,
    /// What it does, in one sentence.
    pub help: &'static str,
}

/// Why a value was not taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueError {
    /// NaN or infinite.
    NotFinite,
    /// Outside the parameter's range.
    OutOfRange,
    /// The parameter takes whole numbers only.
    NotWhole,
}

/// What a robot needs of a row of [`TABLE`]: all but the words, which are the larger part of it and would take 4 KiB of flash.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// As [`Parameter::min`].
    pub min: f64,
    /// As [`Parameter::max`].
    pub max: f64,
    /// As [`Parameter::default`].
    pub default: f64,
    /// As [`Parameter::kind`].
    pub kind: Kind,
    /// As [`Parameter::scope`].
    pub scope: Scope,
}

impl Parameter {
    /// Accepts `value` if it is finite, within the range, and whole where it must be.
    pub fn check(&self, value: f64) -> Result<(), ValueError> {
        let Parameter { min, max, default, kind, scope, .. } = *self;
        Bounds { min, max, default, kind, scope }.check(value)
    }
}

impl Bounds {
    /// Accepts `value` if it is finite, within the range, and whole where it must be.
    pub fn check(&self, value: f64) -> Result<(), ValueError> {
        if !value.is_finite() {
            Err(ValueError::NotFinite)
        } else if value < self.min || value > self.max {
            Err(ValueError::OutOfRange)
        } else if self.kind == Kind::Whole && value != (value as i32) as f64 {
            Err(ValueError::NotWhole)
        } else {
            Ok(())
        }
    }
}

macro_rules! parameters {
    ($($id:ident $name:literal [$unit:literal] $min:literal .. $max:expr, $default:expr, $kind:ident, $scope:ident, $help:literal;)*) => {
        /// Every parameter; the discriminant is its index in [`TABLE`] and on the wire.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        pub enum Id { $(#[doc = $help] $id,)* }

        /// Every parameter, in the order of [`Id`].
        pub const TABLE: &[Parameter] = &[$(Parameter {
            name: $name, unit: $unit, min: $min, max: $max, default: $default,
            kind: Kind::$kind, scope: Scope::$scope, help: $help,
        },)*];

        /// The rows of [`TABLE`] without their words.
        pub const BOUNDS: &[Bounds] = &[$(Bounds {
            min: $min, max: $max, default: $default, kind: Kind::$kind, scope: Scope::$scope,
        },)*];

        impl Id {
            /// Every parameter, in the order of the table.
            pub const ALL: &'static [Id] = &[$(Id::$id,)*];
        }
    };
}

parameters! {
    Rule "rule" [""] 0.0 .. 3.0, 3.0, Whole, Brain, "learning rule: 0 open loop, 1 fixed controller, 2 homeostatic (Eq. 9), 3 homeokinetic (Eq. 12)";
    EpsA "epsA" ["1/step"] 0.0 .. 10.0, 0.1, Real, Brain, "learning rate of the self-model A, b (Eq. 7, 8); works under every rule";
    EpsC "epsC" ["1/step"] 0.0 .. 10.0, 0.1, Real, Brain, "learning rate of the controller C, h (Eq. 9, 10, 12)";
    LambdaA "lambdaA" ["1/step"] 0.0 .. 1.0, 0.003, Real, Brain, "decay of A per control step; 0 keeps what is not learned";
    LambdaB "lambdaB" ["1/step"] 0.0 .. 1.0, 0.001, Real, Brain, "decay of b per control step; 0 keeps what is not learned";
    LambdaC "lambdaC" ["1/step"] 0.0 .. 1.0, 0.0, Real, Brain, "decay of C per control step";
    LambdaH "lambdaH" ["1/step"] 0.0 .. 1.0, 0.0, Real, Brain, "decay of h per control step";
    ClipA "clipA" [""] 0.0 .. 1000.0, 0.1, Real, Brain, "largest change of an entry of A or b in one step (0 = none)";
    ClipC "clipC" [""] 0.0 .. 1000.0, 0.05, Real, Brain, "largest change of an entry of C in one step (0 = none)";
    ClipH "clipH" [""] 0.0 .. 1000.0, 0.1, Real, Brain, "largest change of an entry of h in one step (0 = none)";
    ClipZeta "clipZeta" [""] 0.0 .. 1000.0, 1.0, Real, Brain, "largest |zeta|, the error seen from the membrane potential, in Eq. 11 (0 = none)";
    ClipV "clipV" [""] 0.0 .. 1000.0, 1.0, Real, Brain, "largest |v|, the reconstructed sensor error, in Eq. 11 (0 = none)";
    Ridge "ridge" [""] 0.0 .. 1.0, 1e-8, Real, Brain, "added to the diagonal of C C' before it is inverted in Eq. 11";
    GainFloor "gainFloor" [""] 0.0 .. 1.0, 1e-12, Real, Brain, "smallest slope g' of the neuron that zeta is divided by in Eq. 11";
    PivotFloor "pivotFloor" [""] 0.0 .. 1.0, 1e-12, Real, Brain, "smallest pivot, in magnitude, when A or C C' is inverted in Eq. 11";
    C11 "C11" [""] -100.0 .. 100.0, 1.0, Real, Brain, "controller: weight from x1 to motor 1";
    C12 "C12" [""] -100.0 .. 100.0, 0.0, Real, Brain, "controller: weight from x2 to motor 1";
    C21 "C21" [""] -100.0 .. 100.0, 0.0, Real, Brain, "controller: weight from x1 to motor 2";
    C22 "C22" [""] -100.0 .. 100.0, 1.0, Real, Brain, "controller: weight from x2 to motor 2";
    H1 "h1" [""] -100.0 .. 100.0, 0.0, Real, Brain, "controller: bias of motor 1";
    H2 "h2" [""] -100.0 .. 100.0, 0.0, Real, Brain, "controller: bias of motor 2";
    A11 "A11" [""] -100.0 .. 100.0, 1.0, Real, Brain, "self-model: effect of motor 1 on x1";
    A12 "A12" [""] -100.0 .. 100.0, 0.0, Real, Brain, "self-model: effect of motor 2 on x1";
    A21 "A21" [""] -100.0 .. 100.0, 0.0, Real, Brain, "self-model: effect of motor 1 on x2";
    A22 "A22" [""] -100.0 .. 100.0, 1.0, Real, Brain, "self-model: effect of motor 2 on x2";
    B1 "b1" [""] -100.0 .. 100.0, 0.0, Real, Brain, "self-model: bias of x1";
    B2 "b2" [""] -100.0 .. 100.0, 0.0, Real, Brain, "self-model: bias of x2";
    Coupling1 "coupling1" [""] -100.0 .. 100.0, 1.0, Real, Brain, "c1 of C = [[c1, c2], [-c2, c1]]: setting it sets C11 and C22";
    Coupling2 "coupling2" [""] -100.0 .. 100.0, 0.0, Real, Brain, "c2 of C = [[c1, c2], [-c2, c1]]: setting it sets C12 and C21 = -c2";
    Period "period" ["steps"] 2.0 .. 30000.0, 200.0, Real, Stimulus, "period of the sine drive, in control steps of 20 ms";
    Phaseshift "phaseshift" ["pi/2"] -4.0 .. 4.0, 1.0, Real, Stimulus, "phase of motor 2 ahead of motor 1, in quarter periods";
    Amplitude "amplitude" [""] 0.0 .. 1.0, 1.0, Real, Stimulus, "amplitude of the sine drive";
    Noise "noise" [""] 0.0 .. 10.0, 0.0, Real, Stimulus, "standard deviation of the coloured noise added to the drive";
    Color "color" ["steps"] 0.0 .. 30000.0, 10.0, Real, Stimulus, "correlation time of that noise, in control steps (0 = white)";
    Range "range" ["m"] 0.001 .. 10.0, 0.3, Real, Servo, "weight position commanded by a motor value of 1";
    Kp "KP" ["N/m"] 0.0 .. 2000.0, 200.0, Real, Servo, "servo: force per metre of position error";
    Ki "KI" ["1/s"] 0.0 .. 100.0, 0.5, Real, Servo, "servo: rate of the error's integral, relative to KP";
    Kd "KD" ["s"] 0.0 .. 1.0, 0.1, Real, Servo, "servo: derivative time, relative to KP";
    DerivativeOnMeasurement "derivativeOnMeasurement" [""] 0.0 .. 1.0, 0.0, Whole, Servo, "servo: 1 takes the derivative of the position, 0 of the error, set-point steps included";
    MaxForce "maxForce" ["N"] 0.0 .. 10000.0, 200.0, Real, Servo, "servo: largest force on a weight";
    Radius "radius" ["m"] 0.01 .. 10.0, 0.5, Real, Plant, "radius of the cylinder";
    Length "length" ["m"] 0.01 .. 10.0, 1.0, Real, Plant, "length of the cylinder";
    ShellMass "shellMass" ["kg"] 0.01 .. 1000.0, 1.0, Real, Plant, "mass of the cylinder without its weights";
    WeightMass "weightMass" ["kg"] 0.001 .. 100.0, 1.0, Real, Plant, "mass of each sliding weight";
    AxesShift "axesShift" ["m"] 0.0 .. 10.0, 0.0, Real, Plant, "distance of the two sliding axes along the cylinder axis";
    Friction "friction" ["N m s"] 0.0 .. 100.0, 0.1, Real, Plant, "viscous rolling friction: torque against the rotation, per rad/s";
    RollingResistance "rollingResistance" ["N m"] 0.0 .. 100.0, 0.0, Real, Plant, "Coulomb rolling resistance: torque that must be overcome to roll";
    Mu "mu" [""] 0.0 .. 10.0, 0.64, Real, Plant, "coefficient of friction between rim and ground";
    Gravity "gravity" ["m/s2"] 0.01 .. 100.0, 9.81, Real, Plant, "acceleration of gravity";
    Phi0 "phi0" ["rad"] -1000.0 .. 1000.0, core::f64::consts::FRAC_PI_4, Real, Plant, "rotation about the cylinder axis at the start; pi/4 is the rest pose of C = I";
    Omega0 "omega0" ["rad/s"] -100.0 .. 100.0, 0.0, Real, Plant, "angular velocity about the cylinder axis at the start";
    Tilt0 "tilt0" ["rad"] 0.0 .. 1.571, 0.0, Real, Plant, "tilt of the cylinder axis from the horizontal at the start; pi/2 is upright";
    SensorNoise "sensorNoise" [""] 0.0 .. 10.0, 0.1, Real, Sensor, "strength s of the inclination noise n <- n + sqrt(tau) U(-1,1) s - tau n per control step";
    SensorNoiseTau "sensorNoiseTau" [""] 0.001 .. 1.0, 0.05, Real, Sensor, "tau of the inclination noise: 0.05 coloured as in the original, 1 white";
}

/// How many parameters there are.
pub const COUNT: usize = TABLE.len();

/// Hash over the names of every parameter, in order: whoever keeps values by their index can tell by it whether an index
/// still means the same parameter. The compiler reckons it, so that the names stay out of a robot's image.
pub const LAYOUT: u64 = layout(TABLE);

/// FNV-1a, 64 bits, over every name with a line feed after it.
const fn layout(table: &[Parameter]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325;
    let mut i = 0;
    while i < table.len() {
        let name = table[i].name.as_bytes();
        let mut j = 0;
        while j <= name.len() {
            let byte = if j < name.len() { name[j] } else { b'\n' };
            hash = (hash ^ byte as u64).wrapping_mul(0x0000_0100_0000_01b3);
            j += 1;
        }
        i += 1;
    }
    hash
}

impl Id {
    /// The parameter with this index on the wire.
    pub fn from_index(index: u8) -> Option<Id> {
        Id::ALL.get(usize::from(index)).copied()
    }

    /// The parameter with this name; case matters.
    pub fn from_name(name: &str) -> Option<Id> {
        Id::ALL.iter().copied().find(|id| id.parameter().name == name)
    }

    /// Index in the table and on the wire.
    pub const fn index(self) -> u8 {
        self as u8
    }

    /// The parameter's row in the table.
    pub const fn parameter(self) -> &'static Parameter {
        &TABLE[self as usize]
    }

    /// The parameter's row in the table, without its words.
    pub const fn bounds(self) -> &'static Bounds {
        &BOUNDS[self as usize]
    }

    /// The entries of C that a coupling parameter stands for, each with the sign it takes: C = [[c1, c2], [−c2, c1]].
    /// `None` for every other parameter.
    pub const fn coupled(self) -> Option<[(Id, Sign); 2]> {
        match self {
            Id::Coupling1 => Some([(Id::C11, Sign::Same), (Id::C22, Sign::Same)]),
            Id::Coupling2 => Some([(Id::C12, Sign::Same), (Id::C21, Sign::Opposite)]),
            _ => None,
        }
    }

    /// The parameter's name.
    pub const fn name(self) -> &'static str {
        self.parameter().name
    }
}

/// Whether an entry takes a coupling's value or its opposite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// The value itself.
    Same,
    /// Its negative.
    Opposite,
}

/// One number for every parameter; `f64` on the host, the brain's own scalar in the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Values<T>([T; COUNT]);

impl<T: Copy> Values<T> {
    /// The defaults of the table, through `convert`.
    pub fn defaults(convert: impl Fn(f64) -> T) -> Self {
        Values(core::array::from_fn(|i| convert(BOUNDS[i].default)))
    }

    /// The value of one parameter.
    pub fn get(&self, id: Id) -> T {
        self.0[id as usize]
    }

    /// Replaces the value of one parameter. The caller has checked it.
    pub fn set(&mut self, id: Id, value: T) {
        self.0[id as usize] = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_consistent() {
        for (i, id) in Id::ALL.iter().enumerate() {
            let p = id.parameter();
            assert_eq!(usize::from(id.index()), i);
            assert_eq!(Id::from_index(id.index()), Some(*id));
            assert_eq!(Id::from_name(p.name), Some(*id), "{} is not unique", p.name);
            assert_eq!(p.check(p.default), Ok(()), "default of {}", p.name);
            assert!(p.min < p.max && !p.help.is_empty(), "{}", p.name);
        }
        assert_eq!(Id::from_index(COUNT as u8), None);
    }

    #[test]
    fn the_layout_changes_with_names_and_their_order_and_with_nothing_else() {
        let rows = [Id::Kp, Id::Ki, Id::Kd].map(|id| *id.parameter());
        let named = |names: [&'static str; 3]| {
            let mut rows = rows;
            rows.iter_mut().zip(names).for_each(|(row, name)| row.name = name);
            layout(&rows)
        };
        // FNV-1a of "KP\nKI\nKD\n", reckoned by another program.
        let hash = 0x3f07_65f4_a806_fccd;
        assert_eq!(layout(&rows), hash);
        for names in [["KP", "KI", "Kd"], ["KP", "KD", "KI"], ["KPK", "I", "KD"], ["KP", "", "KIKD"]] {
            assert_ne!(named(names), hash, "{names:?}");
        }
        assert_ne!(layout(&rows[..2]), hash);
        let mut rows = rows;
        (rows[1].min, rows[1].default, rows[1].kind, rows[1].help) = (-1.0, 1.0, Kind::Whole, "another");
        assert_eq!(layout(&rows), hash);
    }

    #[test]
    fn values_outside_the_range_are_refused() {
        let rule = Id::Rule.parameter();
        assert_eq!(rule.check(1.5), Err(ValueError::NotWhole));
        assert_eq!(rule.check(4.0), Err(ValueError::OutOfRange));
        assert_eq!(rule.check(f64::NAN), Err(ValueError::NotFinite));
        assert_eq!(rule.check(f64::NEG_INFINITY), Err(ValueError::NotFinite));
    }
}
