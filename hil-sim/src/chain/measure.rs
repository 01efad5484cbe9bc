//! What a stretch of a chain's run was, in numbers. Each takes the records of that stretch, one a control step, without
//! gaps; of none it says 0, or that it never happened.

use super::ChainRecord;
use core::f64::consts::TAU;
use firmware::timing::CONTROL_PERIOD;

/// A chain is at rest while no pendulum is further than this from hanging down, rad: at C = unity noise alone lifts
/// them to 0.5.
pub const REST: f64 = 0.6;

/// A motor value beyond this is saturated, where the slope of tanh is a tenth.
pub const SATURATED: f64 = 0.95;

/// How fast the pendulums are, rad/s: root mean square over pendulums and steps.
pub fn speed(records: &[ChainRecord]) -> f64 {
    let squares = records.iter().flat_map(|record| &record.rates).map(|rate| rate * rate);
    let count = records.iter().map(|record| record.rates.len()).sum::<usize>();
    (squares.sum::<f64>() / count.max(1) as f64).sqrt()
}

/// When a pendulum was first beyond [`REST`], s.
pub fn left_rest(records: &[ChainRecord]) -> Option<f64> {
    records.iter().find(|record| record.angles.iter().any(|angle| angle.abs() > REST)).map(|record| record.t)
}

/// The lowest speed of any whole window of so many seconds, one after the other, rad/s.
pub fn slowest(records: &[ChainRecord], seconds: f64) -> f64 {
    windows(records, seconds).map(speed).reduce(f64::min).unwrap_or(0.0)
}

/// How far the angle is from rest at most, rad.
pub fn reach(records: &[ChainRecord]) -> f64 {
    largest(records, |record| &record.angles)
}

/// The part of the kinetic energy that is in the common motion of all pendulums, 0 to 1: 1 if they move as one, one
/// over their number if independently, 0 if against each other.
pub fn in_phase(records: &[ChainRecord]) -> f64 {
    let common = |rates: &Vec<f64>| rates.iter().sum::<f64>().powi(2) / rates.len() as f64;
    let all = |rates: &Vec<f64>| rates.iter().map(|rate| rate * rate).sum::<f64>();
    let sum = |of: &dyn Fn(&Vec<f64>) -> f64| records.iter().map(|record| of(&record.rates)).sum::<f64>();
    ratio(sum(&common), sum(&all))
}

/// How far two pendulums circle, −1 to 1: 1 if both swing alike and `second` a quarter of a period behind `first`, −1
/// if it is ahead, 0 if they swing with or against each other. To be taken of a few periods: the sense can change.
pub fn circulation(records: &[ChainRecord], first: usize, second: usize) -> f64 {
    let n = records.len().max(1) as f64;
    let mean = |i: usize| records.iter().map(|record| record.angles[i]).sum::<f64>() / n;
    let middle = [first, second].map(mean);
    let (mut turned, mut angles, mut rates) = (0.0, 0.0, 0.0);
    for record in records {
        let [a, b] = [record.angles[first] - middle[0], record.angles[second] - middle[1]];
        let [va, vb] = [record.rates[first], record.rates[second]];
        turned += a * vb - b * va;
        angles += a * a + b * b;
        rates += va * va + vb * vb;
    }
    ratio(turned, (angles * rates).sqrt())
}

/// The strongest wave along the chain, 0 to 1: the mean size of the [`circulation`] over windows of five seconds, of
/// the two neighbours where it is largest.
pub fn wave(records: &[ChainRecord]) -> f64 {
    let pendulums = records.first().map_or(0, |record| record.angles.len());
    let mean = |i: usize| {
        let (count, sum) = windows(records, 5.0)
            .map(|window| circulation(window, i, i + 1).abs())
            .fold((0.0, 0.0), |(count, sum), size| (count + 1.0, sum + size));
        ratio(sum, count)
    };
    (0..pendulums.saturating_sub(1)).map(mean).fold(0.0, f64::max)
}

/// The frequency with most of the kinetic energy, Hz, in steps of 0.1 Hz up to the 25 that control steps can show: from
/// the spectra of windows of ten seconds, added up over windows and pendulums.
pub fn dominant_frequency(records: &[ChainRecord]) -> f64 {
    let power = |tenths: u32| -> f64 {
        let omega = TAU * 0.1 * f64::from(tenths);
        windows(records, 10.0).map(|window| spectral_power(window, omega)).sum()
    };
    let strongest = (1..=250).map(|tenths| (power(tenths), tenths)).max_by(|a, b| a.0.total_cmp(&b.0));
    strongest.map_or(0.0, |(power, tenths)| if power > 0.0 { 0.1 * f64::from(tenths) } else { 0.0 })
}

/// How much of a motor value is left after a control step, −1 to 1: the correlation of each motor value with the one
/// before, over all motors. Near 1 where the motors swing slowly, near −1 where they rattle, from one step to the next
/// and back.
pub fn persistence(records: &[ChainRecord]) -> f64 {
    let motors = records.first().map_or(0, |record| record.y.len());
    let n = records.len().max(1) as f64;
    let (mut both, mut each) = (0.0, 0.0);
    for i in 0..motors {
        let mean = records.iter().map(|record| record.y[i]).sum::<f64>() / n;
        each += records.iter().map(|record| (record.y[i] - mean).powi(2)).sum::<f64>();
        both += records.windows(2).map(|pair| (pair[0].y[i] - mean) * (pair[1].y[i] - mean)).sum::<f64>();
    }
    ratio(both, each)
}

/// How many motors are asleep: saturated on one side in more than nine of ten steps.
pub fn asleep(records: &[ChainRecord]) -> usize {
    let motors = records.first().map_or(0, |record| record.y.len());
    let often =
        |is: &dyn Fn(&ChainRecord) -> bool| 10 * records.iter().filter(|record| is(record)).count() > 9 * records.len();
    (0..motors).filter(|&i| often(&|r| r.y[i] > SATURATED) || often(&|r| r.y[i] < -SATURATED)).count()
}

/// The largest size of an entry, as in `largest(records, |record| &record.c)`.
pub fn largest(records: &[ChainRecord], entries: impl Fn(&ChainRecord) -> &Vec<f64>) -> f64 {
    records.iter().flat_map(entries).fold(0.0, |largest, entry| largest.max(entry.abs()))
}

/// Windows of so many seconds, one after the other; what is left over at the end is left out.
fn windows(records: &[ChainRecord], seconds: f64) -> impl Iterator<Item = &[ChainRecord]> {
    records.chunks_exact((seconds / CONTROL_PERIOD).round().max(1.0) as usize)
}

/// Power of the rates at `omega`, rad/s, under a Hann window.
fn spectral_power(window: &[ChainRecord], omega: f64) -> f64 {
    let pendulums = window.first().map_or(0, |record| record.rates.len());
    (0..pendulums)
        .map(|i| {
            let (mut cosine, mut sine) = (0.0, 0.0);
            for (k, record) in window.iter().enumerate() {
                let hann = 1.0 - libm::cos(TAU * k as f64 / window.len() as f64);
                let phase = omega * CONTROL_PERIOD * k as f64;
                cosine += hann * record.rates[i] * libm::cos(phase);
                sine += hann * record.rates[i] * libm::sin(phase);
            }
            cosine * cosine + sine * sine
        })
        .sum()
}

/// `a / b`, and 0 for 0 / 0.
fn ratio(a: f64, b: f64) -> f64 {
    if b == 0.0 { 0.0 } else { a / b }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A minute of pendulums with these angles, rad, their rates by differences.
    fn swinging<const P: usize>(angles: impl Fn(f64) -> [f64; P]) -> Vec<ChainRecord> {
        let record = |k: u32| {
            let t = f64::from(k) * CONTROL_PERIOD;
            let (before, after) = (angles(t - 1e-6), angles(t + 1e-6));
            let rates = before.iter().zip(after).map(|(before, after)| (after - before) / 2e-6).collect();
            ChainRecord { t, angles: angles(t).to_vec(), rates, y: angles(t).to_vec(), ..ChainRecord::default() }
        };
        (0..3000).map(record).collect()
    }

    #[test]
    fn a_wave_is_told_from_swinging_together_and_against_each_other() {
        let omega = TAU * 1.3;
        let together = swinging(|t| [(omega * t).sin(), (omega * t).sin()]);
        let against = swinging(|t| [(omega * t).sin(), -(omega * t).sin()]);
        let wave_along = swinging(|t| [0.0, 1.0, 2.0].map(|i| (omega * t - i * TAU / 4.0).sin()));
        for (records, share, circling) in
            [(together, 1.0, 0.0), (against, 0.0, 0.0), (wave_along, 1.0 / 3.0 / 3.0, 1.0)]
        {
            assert!((in_phase(&records) - share).abs() < 0.01, "{} for {share}", in_phase(&records));
            assert!((wave(&records) - circling).abs() < 0.01, "{} for {circling}", wave(&records));
            assert!((circulation(&records, 0, 1) - circling).abs() < 0.01);
            assert!((circulation(&records, 1, 0) + circling).abs() < 0.01);
            assert!((dominant_frequency(&records) - 1.3).abs() < 0.01, "{}", dominant_frequency(&records));
        }
    }

    #[test]
    fn speed_rest_and_sleep_are_what_they_say() {
        let records = swinging(|t| [0.05 * t * t, -0.5]);
        let left = left_rest(&records).expect("it moves");
        assert!((left - 12.0_f64.sqrt()).abs() < 0.03, "{left}");
        assert_eq!(left_rest(&records[..170]), None);
        assert!((slowest(&records, 10.0) - speed(&records[..500])).abs() < 1e-12);
        assert!((reach(&records) - 0.05 * 59.98 * 59.98).abs() < 1e-9);
        // The first motor is beyond saturation after 4.4 of 60 s.
        assert_eq!(asleep(&records), 1);
        assert_eq!(asleep(&swinging(|t| [1.2 * (TAU * t).sin(), -0.96])), 1);
        assert_eq!(asleep(&swinging(|t| [1.2 * (TAU * t).sin(), 0.9])), 0);
    }

    #[test]
    fn rattling_is_told_from_swinging() {
        let mut records = swinging(|t| [(TAU * t).sin(), 0.3]);
        assert!(persistence(&records) > 0.99, "{}", persistence(&records));
        for (k, record) in records.iter_mut().enumerate() {
            record.y = vec![if k % 2 == 0 { 0.9 } else { -0.5 }, 0.3];
            record.rates = vec![if k % 2 == 0 { 2.0 } else { -2.0 }, 0.0];
        }
        assert!(persistence(&records) < -0.99, "{}", persistence(&records));
        assert!((dominant_frequency(&records) - 25.0).abs() < 0.01);
    }

    #[test]
    fn of_no_records_there_is_nothing_to_say() {
        assert_eq!(
            (speed(&[]), left_rest(&[]), slowest(&[], 1.0), in_phase(&[]), wave(&[])),
            (0.0, None, 0.0, 0.0, 0.0)
        );
        assert_eq!(
            (dominant_frequency(&[]), asleep(&[]), circulation(&[], 0, 1), persistence(&[])),
            (0.0, 0, 0.0, 0.0)
        );
    }
}
