//! Every number of a run that can be measured, by name: the recorded columns and what follows from them.

use crate::measure::norm;
use crate::record::Record;
use core::f64::consts::FRAC_PI_2;
use firmware::timing::CONTROL_PERIOD;

/// One number of every control step.
#[derive(Debug)]
pub struct Quantity {
    /// Its name; that of the CSV's column, where it is one.
    pub name: &'static str,
    /// Its unit, empty for a pure number.
    pub unit: &'static str,
    /// What it is, in a few words.
    pub help: &'static str,
    of: fn(&Record) -> f64,
}

impl PartialEq for Quantity {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

macro_rules! quantities {
    ($($name:literal [$unit:literal] $help:literal: |$b:ident, $p:ident| $of:expr;)*) => {
        /// Every quantity.
        pub const QUANTITIES: &[Quantity] = &[$(Quantity {
            name: $name,
            unit: $unit,
            help: $help,
            of: |record| {
                let ($b, $p) = (&record.brain, &record.plant);
                let _ = ($b, $p);
                f64::from($of)
            },
        },)*];
    };
}

quantities! {
    "x1" [""] "inclination of sliding axis 1": |b, p| b.x[0];
    "x2" [""] "inclination of sliding axis 2": |b, p| b.x[1];
    "y1" [""] "motor value 1": |b, p| b.y[0];
    "y2" [""] "motor value 2": |b, p| b.y[1];
    "C11" [""] "controller: weight from x1 to motor 1": |b, p| b.c[0];
    "C12" [""] "controller: weight from x2 to motor 1": |b, p| b.c[1];
    "C21" [""] "controller: weight from x1 to motor 2": |b, p| b.c[2];
    "C22" [""] "controller: weight from x2 to motor 2": |b, p| b.c[3];
    "h1" [""] "controller: bias of motor 1": |b, p| b.h[0];
    "h2" [""] "controller: bias of motor 2": |b, p| b.h[1];
    "A11" [""] "self-model: effect of motor 1 on x1": |b, p| b.a[0];
    "A12" [""] "self-model: effect of motor 2 on x1": |b, p| b.a[1];
    "A21" [""] "self-model: effect of motor 1 on x2": |b, p| b.a[2];
    "A22" [""] "self-model: effect of motor 2 on x2": |b, p| b.a[3];
    "b1" [""] "self-model: bias of x1": |b, p| b.b[0];
    "b2" [""] "self-model: bias of x2": |b, p| b.b[1];
    "E" [""] "prediction error": |b, p| b.error;
    "E_tle" [""] "time loop error": |b, p| b.time_loop_error;
    "omega" ["rad/s"] "angular velocity about the cylinder axis": |b, p| p.omega;
    "phi" ["rad"] "rotation about the cylinder axis": |b, p| p.phi;
    "s1" ["m"] "position of weight 1": |b, p| p.weights[0];
    "s2" ["m"] "position of weight 2": |b, p| p.weights[1];
    "px" ["m"] "centre of the cylinder, along the ground": |b, p| p.position[0];
    "py" ["m"] "centre of the cylinder, along the ground": |b, p| p.position[1];
    "pz" ["m"] "centre of the cylinder, height": |b, p| p.position[2];
    "tilt" ["rad"] "tilt of the cylinder axis from the horizontal": |b, p| p.tilt;
    "lean" ["rad"] "tilt of the cylinder axis from the vertical": |b, p| FRAC_PI_2 - p.tilt.abs();
    "speed" ["rad/s"] "|omega|": |b, p| p.omega.abs();
    "chi" ["rad"] "rotation of the inclinations in one control step: omega times 20 ms": |b, p| p.omega * CONTROL_PERIOD;
    "activity" [""] "root mean square of the two motor values": |b, p| (0.5 * (b.y[0] * b.y[0] + b.y[1] * b.y[1])).sqrt();
    "normC" [""] "|C| (Frobenius)": |b, p| norm(&b.c);
    "normA" [""] "|A| (Frobenius)": |b, p| norm(&b.a);
    "normh" [""] "|h|": |b, p| libm::hypot(b.h[0].into(), b.h[1].into());
    "angleC" ["rad"] "rotation angle of the rotation nearest to C": |b, p| angle(&b.c);
    "angleA" ["rad"] "rotation angle of the rotation nearest to A": |b, p| angle(&b.a);
    "skewC" [""] "how far C is from c U(phi): |C - c U(phi)| / |C|": |b, p| skew(&b.c);
    "detA" [""] "determinant of A": |b, p| b.a[0] * b.a[3] - b.a[1] * b.a[2];
}

impl Quantity {
    /// The quantity with this name; case matters.
    pub fn find(name: &str) -> Option<&'static Quantity> {
        QUANTITIES.iter().find(|quantity| quantity.name == name)
    }

    /// Its number in this record.
    pub fn of(&self, record: &Record) -> f64 {
        (self.of)(record)
    }
}

/// Cosine and sine parts c (cos φ, sin φ) of the multiple of a rotation that is nearest to a matrix given row by row.
fn rotation(m: &[f32; 4]) -> (f64, f64) {
    let [m11, m12, m21, m22] = m.map(f64::from);
    ((m11 + m22) / 2.0, (m21 - m12) / 2.0)
}

fn angle(m: &[f32; 4]) -> f64 {
    let (cos, sin) = rotation(m);
    libm::atan2(sin, cos)
}

fn skew(m: &[f32; 4]) -> f64 {
    let (cos, sin) = rotation(m);
    let near = [cos, -sin, sin, cos];
    let off: f64 = m.iter().zip(near).map(|(m, near)| (f64::from(*m) - near).powi(2)).sum();
    off.sqrt() / norm(m).max(1e-12)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_rotations_are_recognised() {
        for (i, quantity) in QUANTITIES.iter().enumerate() {
            assert!(QUANTITIES[..i].iter().all(|other| other != quantity), "{}", quantity.name);
        }
        let mut record = Record::default();
        let (sin, cos) = 0.4_f32.sin_cos();
        record.brain.c = [2.0 * cos, -2.0 * sin, 2.0 * sin, 2.0 * cos];
        let value = |name| Quantity::find(name).expect("a quantity").of(&record);
        assert!((value("angleC") - 0.4).abs() < 1e-6 && value("skewC") < 1e-6, "{}", value("angleC"));
        assert!((value("normC") - 8_f64.sqrt()).abs() < 1e-6);
    }
}
