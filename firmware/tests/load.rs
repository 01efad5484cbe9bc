//! Deadlines, jitter and load against ticks that are made up.

use firmware::load::LoadMeter;
use proptest::prelude::*;
use protocol::message::Vitals;

const CYCLES: u32 = 168_000_000;
const PERIOD: u32 = CYCLES / 1000;

#[test]
fn a_second_of_steady_ticks_across_the_counters_wrap() {
    let mut meter = LoadMeter::new(CYCLES);
    let first = u32::MAX - 500 * PERIOD;
    for tick in 0..1000u32 {
        let start = first.wrapping_add(tick * PERIOD);
        let brain = tick % 20 == 0;
        let took = if brain { 16_800 } else { 1_680 };
        assert!(meter.tick(start, start.wrapping_add(took), brain), "tick {tick}");
        meter.awake(took);
    }
    let vitals = meter.second();
    assert_eq!(
        vitals,
        Vitals { ticks: 1000, load: 145, servo_ns: 10_000, brain_ns: 100_000, ..Vitals::default() },
        "50 · 16 800 + 950 · 1 680 cycles of 168 000 000 are 1.45 %"
    );
}

#[test]
fn figures_are_the_seconds_and_counts_the_starts() {
    let mut meter = LoadMeter::new(CYCLES);
    meter.tick(0, 1000, true);
    meter.tick(PERIOD + 84, PERIOD + 200_000, false);
    meter.imu_missed();
    meter.awake(CYCLES / 2);
    let first = meter.second();
    assert_eq!((first.ticks, first.overruns, first.imu_missed), (2, 1, 1));
    assert_eq!((first.load, first.jitter_ns, first.servo_ns), (5000, 500, 1_189_976));
    meter.tick(2 * PERIOD + 84, 2 * PERIOD + 252, false);
    let second = meter.second();
    assert_eq!(
        second,
        Vitals { ticks: 3, overruns: 1, imu_missed: 1, servo_ns: 1000, ..Vitals::default() },
        "what was of the first second is gone"
    );
}

#[test]
fn a_tick_that_ends_a_period_after_it_was_due_is_in_time_and_one_cycle_more_is_not() {
    for (late, took) in [(0, PERIOD), (PERIOD / 2, PERIOD / 2), (PERIOD, 0)] {
        for more in [0, 1] {
            let mut meter = LoadMeter::new(CYCLES);
            assert!(meter.tick(0, 100, false));
            let start = PERIOD + late;
            assert_eq!(meter.tick(start, start + took + more, false), more == 0, "{late} late, {took} long");
            assert_eq!(meter.second().overruns, more);
        }
    }
}

#[test]
fn a_backlog_is_one_overrun_and_the_schedule_starts_anew() {
    let mut meter = LoadMeter::new(CYCLES);
    assert!(meter.tick(0, 100, false));
    // The next one hangs for five and a half periods; the ones after it come from then on.
    assert!(!meter.tick(PERIOD, PERIOD + 11 * PERIOD / 2, false));
    for tick in 7..100 {
        let start = tick * PERIOD + PERIOD / 2;
        assert!(meter.tick(start, start + 100, false), "tick {tick}");
    }
    assert_eq!(meter.second().overruns, 1);
}

#[test]
fn ticks_that_were_left_out_are_an_overrun() {
    let mut meter = LoadMeter::new(CYCLES);
    assert!(meter.tick(0, 100, false));
    assert!(!meter.tick(3 * PERIOD, 3 * PERIOD + 100, false));
    assert!(meter.tick(4 * PERIOD, 4 * PERIOD + 100, false));
    assert_eq!(meter.second().jitter_ns, 2_000_000);
}

#[test]
fn a_late_first_tick_makes_no_later_deadline_easier() {
    let mut meter = LoadMeter::new(CYCLES);
    let late = PERIOD / 4;
    assert!(meter.tick(late, late + 100, false));
    assert!(meter.tick(PERIOD, PERIOD + 100, false), "early as it seems, it is the schedule");
    assert!(!meter.tick(2 * PERIOD + 1, 3 * PERIOD + 1, false));
}

#[test]
fn a_core_that_never_sleeps_is_loaded_to_the_full_and_no_more() {
    let mut meter = LoadMeter::new(CYCLES);
    for _ in 0..40 {
        meter.awake(CYCLES);
    }
    assert_eq!(meter.second().load, 10_000);
    assert_eq!(meter.second().load, 0);
}

proptest! {
    #[test]
    fn ticks_on_time_are_never_an_overrun_and_their_jitter_is_seen(
        first: u32, lates in proptest::collection::vec(0..PERIOD / 2, 2..200), took in 0..PERIOD / 2,
    ) {
        let mut meter = LoadMeter::new(CYCLES);
        let start = |i: usize| first.wrapping_add(i as u32 * PERIOD).wrapping_add(lates[i]);
        for i in 0..lates.len() {
            prop_assert!(meter.tick(start(i), start(i).wrapping_add(took), false));
        }
        let jitter = lates.windows(2).map(|pair| pair[0].abs_diff(pair[1])).max().unwrap_or(0);
        let vitals = meter.second();
        prop_assert_eq!(vitals.overruns, 0);
        prop_assert_eq!(vitals.jitter_ns, (u64::from(jitter) * 1_000_000_000 / u64::from(CYCLES)) as u32);
    }

    #[test]
    fn a_tick_that_ends_too_late_is_always_seen(
        first: u32, before in 1..50u32, late in 0..PERIOD, longer in 1..100 * PERIOD,
    ) {
        let mut meter = LoadMeter::new(CYCLES);
        for i in 0..before {
            let start = first.wrapping_add(i * PERIOD);
            prop_assert!(meter.tick(start, start.wrapping_add(10), false));
        }
        let start = first.wrapping_add(before * PERIOD).wrapping_add(late);
        prop_assert!(!meter.tick(start, start.wrapping_add(PERIOD - late + longer), false));
        prop_assert_eq!(meter.second().overruns, 1);
    }

    #[test]
    fn any_counts_are_taken(
        ticks in proptest::collection::vec((any::<u32>(), any::<u32>(), any::<bool>()), 0..50), rate: u32,
    ) {
        let mut meter = LoadMeter::new(rate);
        for (start, end, brain) in &ticks {
            meter.tick(*start, *end, *brain);
        }
        prop_assert_eq!(meter.second().ticks, ticks.len() as u32);
    }
}
