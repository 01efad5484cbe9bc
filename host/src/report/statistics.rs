//! What is said of many runs in one number.

/// The numbers that are numbers, in order.
fn sorted(numbers: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut numbers: Vec<f64> = numbers.into_iter().filter(|n| n.is_finite()).collect();
    numbers.sort_by(f64::total_cmp);
    numbers
}

/// The number below which this share of them lies; NaN of none.
pub fn quantile(numbers: impl IntoIterator<Item = f64>, share: f64) -> f64 {
    let numbers = sorted(numbers);
    let place = share * numbers.len().saturating_sub(1) as f64;
    match (numbers.get(place.floor() as usize), numbers.get(place.ceil() as usize)) {
        (Some(below), Some(above)) => below + (above - below) * place.fract(),
        _ => f64::NAN,
    }
}

/// The one in the middle; NaN of none.
pub fn median(numbers: impl IntoIterator<Item = f64>) -> f64 {
    quantile(numbers, 0.5)
}

/// The largest; NaN of none.
pub fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    sorted(numbers).last().copied().unwrap_or(f64::NAN)
}

/// The smallest; NaN of none.
pub fn smallest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    sorted(numbers).first().copied().unwrap_or(f64::NAN)
}

/// The mean; NaN of none.
pub fn mean(numbers: impl IntoIterator<Item = f64>) -> f64 {
    let numbers = sorted(numbers);
    numbers.iter().sum::<f64>() / numbers.len() as f64
}

/// Which share of them is so; NaN of none.
pub fn share<T>(items: impl IntoIterator<Item = T>, is_so: impl Fn(T) -> bool) -> f64 {
    let (all, so) = items.into_iter().fold((0_u32, 0_u32), |(all, so), item| (all + 1, so + u32::from(is_so(item))));
    f64::from(so) / f64::from(all)
}

/// Bars of a histogram: left edge, right edge, how many.
pub fn histogram(numbers: impl IntoIterator<Item = f64>, low: f64, high: f64, bins: usize) -> Vec<[f64; 3]> {
    let width = (high - low) / bins as f64;
    let mut bars: Vec<[f64; 3]> =
        (0..bins).map(|i| [low + i as f64 * width, low + (i + 1) as f64 * width, 0.0]).collect();
    for number in sorted(numbers) {
        // What lies outside is counted at the edge: nothing is left out.
        let bin = ((number - low) / width).floor().clamp(0.0, bins as f64 - 1.0) as usize;
        bars[bin][2] += 1.0;
    }
    bars
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_the_numbers_and_leave_out_what_is_none() {
        let numbers = [3.0, f64::NAN, 1.0, 2.0, 4.0];
        assert_eq!(median(numbers), 2.5);
        assert_eq!(quantile(numbers, 1.0), 4.0);
        assert!(median([]).is_nan() && median([f64::NAN]).is_nan());
        assert_eq!((smallest(numbers), largest(numbers), mean(numbers)), (1.0, 4.0, 2.5));
        assert_eq!(share(numbers, |n| n > 2.0), 0.4);
    }

    #[test]
    fn a_histogram_counts_every_number_once() {
        let bars = histogram([-5.0, 0.1, 0.9, 1.5, 99.0], 0.0, 2.0, 2);
        assert_eq!(bars, [[0.0, 1.0, 3.0], [1.0, 2.0, 2.0]]);
    }
}
