//! The groups that the parameters are shown in.

use protocol::{Id, Values};

/// A group, as its heading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Group {
    Learning,
    Precautions,
    Controller,
    Coupling,
    Model,
    Stimulus,
    Noise,
    Servo,
    Body,
    Pose,
}

impl Group {
    /// Every group, in the order in which they are shown.
    pub(super) const ALL: [Group; 10] = [
        Group::Learning,
        Group::Precautions,
        Group::Controller,
        Group::Coupling,
        Group::Model,
        Group::Stimulus,
        Group::Noise,
        Group::Servo,
        Group::Body,
        Group::Pose,
    ];

    /// Its heading.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Group::Learning => "Learning",
            Group::Precautions => "Clips and floors",
            Group::Controller => "Controller C, h",
            Group::Coupling => "Coupling: C as a rotation",
            Group::Model => "Self-model A, b",
            Group::Stimulus => "Stimulus of the open loop",
            Group::Noise => "Sensor noise",
            Group::Servo => "Servo",
            Group::Body => "Body and ground",
            Group::Pose => "Start pose",
        }
    }

    /// Where a parameter is shown.
    pub(super) const fn of(id: Id) -> Group {
        use Id::*;
        match id {
            Rule | EpsA | EpsC | LambdaA | LambdaB | LambdaC | LambdaH => Group::Learning,
            ClipA | ClipC | ClipH | ClipZeta | ClipV | Ridge | GainFloor | PivotFloor => Group::Precautions,
            C11 | C12 | C21 | C22 | H1 | H2 => Group::Controller,
            Coupling1 | Coupling2 => Group::Coupling,
            A11 | A12 | A21 | A22 | B1 | B2 => Group::Model,
            Period | Phaseshift | Amplitude | Noise | Color => Group::Stimulus,
            SensorNoise | SensorNoiseTau => Group::Noise,
            Range | Kp | Ki | Kd | DerivativeOnMeasurement | MaxForce => Group::Servo,
            Radius | Length | ShellMass | WeightMass | AxesShift | Friction | RollingResistance | Mu | Gravity => {
                Group::Body
            }
            Phi0 | Omega0 | Tilt0 => Group::Pose,
        }
    }
}

/// Whether it is the brain's state, which learning may change.
pub(super) const fn is_state(id: Id) -> bool {
    matches!(Group::of(id), Group::Controller | Group::Coupling | Group::Model)
}

/// Whether learning changes it, under these values: the controller from the homeostatic rule on, the self-model at any
/// rate.
pub(super) fn is_learned(id: Id, values: &Values<f64>) -> bool {
    match Group::of(id) {
        Group::Controller | Group::Coupling => values.get(Id::Rule) >= 2.0,
        Group::Model => values.get(Id::EpsA) > 0.0,
        _ => false,
    }
}
