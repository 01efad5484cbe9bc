//! Deadlines, jitter and load, from a counter of the core's cycles.
//!
//! A servo tick has met its deadline if its outputs were there within one [`crate::timing::SERVO_PERIOD`] of when it was due. The
//! first tick is when it comes, and every further one a period after the one before. A tick that comes before it is due
//! shows that those before it were late, and the schedule starts from it. After a missed deadline the next tick starts
//! it anew.
//!
//! The counter has 32 bits and wraps. It must go on while the core sleeps, or every sleep would look like a tick that
//! came too early, and it must run off the same clock as the timer of the servo. Times of half its range and more (12 s
//! at 168 MHz) cannot be told from their complement.

use protocol::message::Vitals;

use crate::timing::SERVO_HZ;

/// Watches the servo ticks and sums up what a second cost.
#[derive(Clone, Debug)]
pub struct LoadMeter {
    cycles_per_second: u32,
    period: u32,
    /// When the next tick is due, and when the last one began.
    due: Option<u32>,
    last_start: Option<u32>,
    ticks: u32,
    overruns: u32,
    imu_missed: u32,
    second: Second,
}

/// Figures of the second that is running, cycles.
#[derive(Clone, Copy, Debug, Default)]
struct Second {
    awake: u32,
    servo: u32,
    brain: u32,
    jitter: u32,
}

impl LoadMeter {
    /// A meter for a counter of this frequency, Hz, a whole number of kHz.
    pub fn new(cycles_per_second: u32) -> Self {
        LoadMeter {
            cycles_per_second: cycles_per_second.max(1),
            period: cycles_per_second / SERVO_HZ,
            due: None,
            last_start: None,
            ticks: 0,
            overruns: 0,
            imu_missed: 0,
            second: Second::default(),
        }
    }

    /// Notes a servo tick: the counter at its start and when its outputs were there, and whether it took a control
    /// step. Returns whether it met its deadline.
    pub fn tick(&mut self, start: u32, end: u32, with_brain: bool) -> bool {
        self.ticks = self.ticks.wrapping_add(1);
        let longest = if with_brain { &mut self.second.brain } else { &mut self.second.servo };
        *longest = (*longest).max(end.wrapping_sub(start));
        if let Some(last) = self.last_start.replace(start) {
            let jitter = start.wrapping_sub(last).abs_diff(self.period);
            self.second.jitter = self.second.jitter.max(jitter);
        }

        let due = self.due.filter(|due| !is_before(start, *due)).unwrap_or(start);
        let met = end.wrapping_sub(due) <= self.period;
        self.due = met.then(|| due.wrapping_add(self.period));
        if !met {
            self.overruns = self.overruns.wrapping_add(1);
        }
        met
    }

    /// Notes a tick of the simulation, as [`LoadMeter::tick`]. It comes when the host wants it and has no deadline.
    pub fn simulated_tick(&mut self, start: u32, end: u32) {
        self.second.brain = self.second.brain.max(end.wrapping_sub(start));
    }

    /// Notes that the core was awake for so many cycles.
    pub fn awake(&mut self, cycles: u32) {
        self.second.awake = self.second.awake.saturating_add(cycles);
    }

    /// Notes a servo tick without a new reading of the inertial sensor.
    pub fn imu_missed(&mut self) {
        self.imu_missed = self.imu_missed.wrapping_add(1);
    }

    /// Ends a second: its figures, and the counts since the start. What a meter cannot know is left at its default.
    pub fn second(&mut self) -> Vitals {
        let second = core::mem::take(&mut self.second);
        Vitals {
            ticks: self.ticks,
            load: self.share(second.awake, 10_000).min(10_000) as u16,
            servo_ns: self.share(second.servo, 1_000_000_000),
            brain_ns: self.share(second.brain, 1_000_000_000),
            jitter_ns: self.share(second.jitter, 1_000_000_000),
            overruns: self.overruns,
            imu_missed: self.imu_missed,
            ..Vitals::default()
        }
    }

    /// Cycles as a part of a second, in parts of `whole`.
    fn share(&self, cycles: u32, whole: u32) -> u32 {
        let parts = u64::from(cycles) * u64::from(whole) / u64::from(self.cycles_per_second);
        parts.min(u64::from(u32::MAX)) as u32
    }
}

/// Whether a count comes before another, for counts less than half the range apart.
fn is_before(count: u32, other: u32) -> bool {
    other.wrapping_sub(count).wrapping_sub(1) < 1 << 31
}
