//! The servo's clock.

use core::future::poll_fn;
use core::task::Poll;

use embassy_time::{Duration, Instant};

/// Ticks at a fixed distance: after one that came late the next ones come at once until the clock is met again, or
/// [`Pace::begin_anew`] gives that up.
///
/// As `embassy_time::Ticker`, but it sets its alarm once in a tick, however often it is asked: that saves a tenth of the
/// tick. So nothing else in the same task may wait for a time, as a task has one alarm.
pub struct Pace {
    period: Duration,
    due: Instant,
    alarm_is_set: bool,
}

impl Pace {
    /// The first tick comes a period from now.
    pub fn every(period: Duration) -> Self {
        Pace { period, due: Instant::now() + period, alarm_is_set: false }
    }

    /// Leaves out what is late: the next tick comes a period from now.
    pub fn begin_anew(&mut self) {
        *self = Pace::every(self.period);
    }

    /// Waits for the next tick. May be dropped and asked again: no tick is lost.
    pub async fn tick(&mut self) {
        poll_fn(|context| {
            if Instant::now() >= self.due {
                self.due += self.period;
                self.alarm_is_set = false;
                return Poll::Ready(());
            }
            if !self.alarm_is_set {
                self.alarm_is_set = true;
                embassy_time_driver::schedule_wake(self.due.as_ticks(), context.waker());
            }
            Poll::Pending
        })
        .await;
    }
}
