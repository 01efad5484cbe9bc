//! The chapter's experiments: each is a row of one table, a preset of parameters and nothing more.

use protocol::Id;

/// One of the chapter's experiments.
#[derive(Debug, PartialEq)]
pub struct Experiment {
    /// Name on the command line.
    pub name: &'static str,
    /// Where it stands in the chapter.
    pub section: &'static str,
    /// What happens, in one sentence.
    pub summary: &'static str,
    /// The parameters that differ from the table's defaults.
    pub preset: &'static [(Id, f64)],
}

/// cos 0.5 and −sin 0.5: C = U(0.5).
const U_05: [f64; 2] = [0.877_582_561_890_372_8, -0.479_425_538_604_203];
/// cos 0.3 and sin 0.3: A = U(−0.3), whose inverse U(0.3) rolls.
const U_03: [f64; 2] = [0.955_336_489_125_606, 0.295_520_206_661_339_6];

/// Every experiment, in the chapter's order.
pub const EXPERIMENTS: &[Experiment] = &[
    Experiment {
        name: "open-loop",
        section: "Experiment 1.1",
        summary: "a sine drives both weights a quarter period apart; slow drives lock the rolling, fast ones lose it",
        preset: &[(Id::Rule, 0.0), (Id::EpsA, 0.0), (Id::LambdaA, 0.0), (Id::LambdaB, 0.0), (Id::SensorNoise, 0.0)],
    },
    Experiment {
        name: "closed-loop",
        section: "Experiment 1.2",
        summary: "a fixed rotation C = U(0.5) feeds the inclinations back; the barrel rolls by itself",
        preset: &[
            (Id::Rule, 1.0),
            (Id::EpsA, 0.0),
            (Id::LambdaA, 0.0),
            (Id::LambdaB, 0.0),
            (Id::SensorNoise, 0.0),
            (Id::Coupling1, U_05[0]),
            (Id::Coupling2, U_05[1]),
        ],
    },
    Experiment {
        name: "learn-controller",
        section: "Experiment 2.1",
        summary: "the controller learns from a given self-model A = U(-0.3) and finds the rolling that fits it",
        preset: &[
            (Id::Rule, 2.0),
            (Id::EpsA, 0.0),
            (Id::LambdaA, 0.0),
            (Id::LambdaB, 0.0),
            (Id::LambdaC, 0.001),
            (Id::LambdaH, 0.001),
            (Id::A11, U_03[0]),
            (Id::A12, U_03[1]),
            (Id::A21, -U_03[1]),
            (Id::A22, U_03[0]),
        ],
    },
    Experiment {
        name: "homeostatic",
        section: "Experiment 2.2",
        summary: "controller and self-model learn from the prediction error; calm, until a kick starts a sweep",
        preset: &[(Id::Rule, 2.0), (Id::SensorNoise, 0.01)],
    },
    Experiment {
        name: "homeokinetic",
        section: "Experiment 3.1",
        summary: "controller and self-model learn from the time loop error; rest is left, the barrel sweeps through its speeds",
        preset: &[(Id::Rule, 3.0)],
    },
    Experiment {
        name: "upright",
        section: "Experiment 3.1, upright",
        summary: "the barrel stands on its end and learns; noise is amplified until the weights act together",
        preset: &[
            (Id::Rule, 3.0),
            (Id::Tilt0, core::f64::consts::FRAC_PI_2),
            (Id::Phi0, 0.0),
            (Id::Mu, 1.0),
            (Id::EpsC, 0.5),
            (Id::ClipZeta, 5.0),
            (Id::Kd, 0.05),
            (Id::SensorNoiseTau, 1.0),
        ],
    },
];

impl Experiment {
    /// The experiment with this name.
    pub fn find(name: &str) -> Option<&'static Experiment> {
        EXPERIMENTS.iter().find(|e| e.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_within_range_and_every_name_is_unique() {
        for e in EXPERIMENTS {
            assert_eq!(Experiment::find(e.name), Some(e));
            for (id, value) in e.preset {
                assert_eq!(id.parameter().check(*value), Ok(()), "{} of {}", id.name(), e.name);
            }
        }
    }
}
