//! How a parameter's slider is divided, and how its number is written.

use super::group::is_state;
use protocol::Id;
use std::borrow::Cow;

/// How a slider is divided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scale {
    /// Evenly.
    Linear,
    /// By decades, on both sides of 0 where the range has both; what is smaller than this is 0.
    Decades(f64),
}

impl Scale {
    /// The scale of a parameter.
    pub(super) const fn of(id: Id) -> Scale {
        use Id::*;
        match id {
            Rule | DerivativeOnMeasurement | Phaseshift | Amplitude | Tilt0 => Scale::Linear,
            Ridge | GainFloor | PivotFloor => Scale::Decades(1e-15),
            LambdaA | LambdaB | LambdaC | LambdaH => Scale::Decades(1e-5),
            EpsA | EpsC => Scale::Decades(1e-4),
            C11 | C12 | C21 | C22 | H1 | H2 | A11 | A12 | A21 | A22 | B1 | B2 | Coupling1 | Coupling2 => Scale::Linear,
            Phi0 | Omega0 => Scale::Decades(0.05),
            Color | Kp | MaxForce => Scale::Decades(0.1),
            Ki | Mu => Scale::Decades(0.01),
            ClipA | ClipC | ClipH | ClipZeta | ClipV | Period | Noise | Range | Kd | Radius | Length | ShellMass
            | WeightMass | AxesShift | Friction | RollingResistance | Gravity | SensorNoise | SensorNoiseTau => {
                Scale::Decades(1e-3)
            }
        }
    }
}

/// Entries of matrices and biases are seldom larger than what a random controller is drawn from.
const USUAL: f64 = 5.0;

/// From where to where a slider goes: over the parameter's range, or, where that is much wider than what is usual, over that, and
/// as far as the value now.
pub(super) fn reach(id: Id, now: f64) -> (f64, f64) {
    let p = id.parameter();
    let far = if is_state(id) && now.is_finite() { USUAL.max(now.abs().ceil()) } else { f64::INFINITY };
    (p.min.max(-far), p.max.min(far))
}

/// What the values of a switch mean, from 0 on; `None` for what is a number.
pub(super) const fn words(id: Id) -> Option<&'static [&'static str]> {
    match id {
        Id::Rule => {
            Some(&["0  open loop", "1  fixed controller", "2  homeostatic (Eq. 9)", "3  homeokinetic (Eq. 12)"])
        }
        Id::DerivativeOnMeasurement => Some(&["0  of the error, set-point steps included", "1  of the position alone"]),
        _ => None,
    }
}

/// A value as it is written: four decimals for the brain's state, so that it stands still while it is learned; six
/// significant digits for the rest.
pub(super) fn text(id: Id, value: f64) -> String {
    if is_state(id) {
        return format!("{value:.4}");
    }
    let value = rounded(value);
    if value != 0.0 && !(1e-4..1e6).contains(&value.abs()) { format!("{value:e}") } else { value.to_string() }
}

/// To six significant digits.
pub(super) fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// A number as people type it: with a point or a comma, and any minus sign.
pub(super) fn number(text: &str) -> Option<f64> {
    let text: Cow<str> = if text.contains('.') { text.into() } else { text.replacen(',', ".", 1).into() };
    let text: String = text.chars().filter(|c| !c.is_whitespace()).map(|c| if c == '−' { '-' } else { c }).collect();
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

/// How far a number moves when it is dragged by a point: a hundredth of its decade.
pub(super) fn speed(id: Id, value: f64) -> f64 {
    let least = match Scale::of(id) {
        Scale::Linear => 0.1,
        Scale::Decades(least) => least,
    };
    10_f64.powf(value.abs().max(least).log10().floor()) / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_short_and_read_as_people_type_them() {
        assert_eq!(text(Id::Ridge, 1e-8), "1e-8");
        assert_eq!(text(Id::EpsA, 0.1), "0.1");
        assert_eq!(text(Id::Phi0, core::f64::consts::FRAC_PI_4), "0.785398");
        assert_eq!(text(Id::C11, 0.877_582_5), "0.8776");
        assert_eq!(text(Id::ClipA, 0.0), "0");
        assert_eq!(number(" 1e-8"), Some(1e-8));
        assert_eq!(number("0,25"), Some(0.25));
        assert_eq!(number("−2"), Some(-2.0));
        assert_eq!((number("two"), number("inf")), (None, None));
    }

    #[test]
    fn the_words_of_a_switch_are_as_many_as_its_values() {
        for &id in Id::ALL {
            let p = id.parameter();
            let count = words(id).map_or(0, <[_]>::len);
            assert!(count == 0 || (p.min == 0.0 && p.max == (count - 1) as f64), "{}", p.name);
            assert_eq!(p.kind == protocol::parameter::Kind::Whole, count > 0, "{} has no words", p.name);
        }
    }

    #[test]
    fn every_scale_reaches_the_parameters_default() {
        for &id in Id::ALL {
            if let Scale::Decades(least) = Scale::of(id) {
                let default = id.parameter().default.abs();
                assert!(default == 0.0 || default >= least, "{}", id.name());
                assert!(least > 0.0 && least < id.parameter().max, "{}", id.name());
            }
        }
    }
}
