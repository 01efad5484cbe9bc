//! A stretch of a run as it is written behind a measure: `:FROM:TO`, in s.

use super::MeasureError;
use core::fmt;

/// From and to, s; the end is infinite where none is given.
///
/// # Errors
/// What is no stretch.
pub fn parse(parts: &[&str]) -> Result<(f64, f64), MeasureError> {
    let wrong = || MeasureError::Stretch(parts.join(":"));
    let bounds: Vec<f64> = parts
        .iter()
        .map(|part| part.parse().ok().filter(|t: &f64| t.is_finite() && *t >= 0.0))
        .collect::<Option<_>>()
        .ok_or_else(wrong)?;
    match bounds[..] {
        [] => Ok((0.0, f64::INFINITY)),
        [from] => Ok((from, f64::INFINITY)),
        [from, to] if to > from => Ok((from, to)),
        _ => Err(wrong()),
    }
}

/// Writes it as it is parsed; nothing for the whole run.
pub fn write(f: &mut fmt::Formatter<'_>, from: f64, to: f64) -> fmt::Result {
    match (from, to) {
        (0.0, f64::INFINITY) => Ok(()),
        (from, f64::INFINITY) => write!(f, ":{from}"),
        (from, to) => write!(f, ":{from}:{to}"),
    }
}
