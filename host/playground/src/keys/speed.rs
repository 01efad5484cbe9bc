//! The ladder of speeds: simulated seconds per second.

/// Every speed of the ladder; infinity is as fast as it goes.
pub const SPEEDS: [f64; 14] =
    [0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0, f64::INFINITY];

/// The next speed up the ladder; the fastest stays.
pub fn faster(speed: f64) -> f64 {
    SPEEDS.into_iter().find(|step| *step > speed).unwrap_or(f64::INFINITY)
}

/// The next speed down the ladder; the slowest stays.
pub fn slower(speed: f64) -> f64 {
    SPEEDS.into_iter().rev().find(|step| *step < speed).unwrap_or(SPEEDS[0])
}

/// A speed as people say it: "1/10 x", "2 x", "as fast as it goes".
pub fn words(speed: f64) -> String {
    let parts = (1.0 / speed).round();
    if speed.is_infinite() {
        "as fast as it goes".to_owned()
    } else if speed < 1.0 && (speed * parts - 1.0).abs() < 1e-9 {
        format!("1/{parts} x")
    } else {
        format!("{speed} x")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ladder_is_climbed_rung_by_rung_and_ends_at_both_ends() {
        for pair in SPEEDS.windows(2) {
            assert_eq!((faster(pair[0]), slower(pair[1])), (pair[1], pair[0]));
        }
        assert_eq!((faster(f64::INFINITY), slower(0.02)), (f64::INFINITY, 0.02));
    }

    #[test]
    fn a_speed_between_two_rungs_goes_to_the_nearest_in_its_direction() {
        assert_eq!((faster(3.0), slower(3.0)), (5.0, 2.0));
        assert_eq!((faster(0.001), slower(5000.0)), (0.02, 1000.0));
    }

    #[test]
    fn slow_speeds_are_said_as_fractions() {
        let said: Vec<String> = SPEEDS.iter().map(|speed| words(*speed)).collect();
        assert_eq!(said[..6], ["1/50 x", "1/20 x", "1/10 x", "1/5 x", "1/2 x", "1 x"]);
        assert_eq!(said[12..], ["1000 x", "as fast as it goes"]);
        assert_eq!(words(0.3), "0.3 x");
    }
}
