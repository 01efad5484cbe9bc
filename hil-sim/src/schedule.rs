//! What is done to a barrel while it rolls, and when: a parameter set, the controller scattered or drawn anew.

use core::fmt;
use firmware::timing::CONTROL_PERIOD;
use protocol::Id;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Something done to a running barrel from outside; pushes aside, which act on the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// A parameter takes a value.
    Set(Id, f64),
    /// Every entry of C is moved by a random amount, uniform in ±this (the chapter's keys s and S).
    Scatter(f64),
    /// Every entry of C is drawn anew, uniform in ±this (the chapter's key r).
    RandomC(f64),
    /// Both entries of h are drawn anew, uniform in ±this (with the entries of C, the chapter's key R).
    RandomH(f64),
}

/// The entries of C, row by row.
pub const C: [Id; 4] = [Id::C11, Id::C12, Id::C21, Id::C22];
/// The entries of h.
pub const H: [Id; 2] = [Id::H1, Id::H2];

impl Action {
    /// The entries that it changes at random, if it does.
    pub fn random_entries(&self) -> &'static [Id] {
        match self {
            Action::Set(..) => &[],
            Action::Scatter(_) | Action::RandomC(_) => &C,
            Action::RandomH(_) => &H,
        }
    }

    /// The value that it draws for one of these entries, whose value is `now`. One that would leave its range ends at its bound.
    pub fn drawn(&self, id: Id, now: f64, random: &mut Schedule) -> f64 {
        let value = match *self {
            Action::Scatter(by) => now + random.random(by),
            Action::RandomC(within) | Action::RandomH(within) => random.random(within),
            Action::Set(_, value) => value,
        };
        let p = id.parameter();
        value.clamp(p.min, p.max)
    }
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Action::Set(id, value) => write!(f, "{}={value}", id.name()),
            Action::Scatter(by) => write!(f, "scatter={by}"),
            Action::RandomC(within) => write!(f, "randomC={within}"),
            Action::RandomH(within) => write!(f, "randomH={within}"),
        }
    }
}

/// An action at a time, or again and again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// When, s: before the first control step at or after it.
    pub at: f64,
    /// Again after each of these, s.
    pub every: Option<f64>,
    /// What.
    pub action: Action,
}

impl Event {
    /// An action once, at `at`, s.
    pub const fn once(at: f64, action: Action) -> Self {
        Event { at, every: None, action }
    }

    /// The control step before which it is due, and after how many it is due again.
    fn steps(&self) -> (u64, Option<u64>) {
        let steps = |seconds: f64| (seconds / CONTROL_PERIOD - 1e-6).ceil().max(0.0) as u64;
        (steps(self.at), self.every.map(|every| steps(every).max(1)))
    }
}

impl fmt::Display for Event {
    /// As it is written on the command line: `60:scatter=0.2`, `0/90:randomC=5`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.at)?;
        if let Some(every) = self.every {
            write!(f, "/{every}")?;
        }
        write!(f, ":{}", self.action)
    }
}

/// What is still to be done in a run, and the random numbers for it.
#[derive(Clone, Debug)]
pub struct Schedule {
    /// Each with the control step before which it is due next.
    waiting: Vec<(u64, Event)>,
    /// The earliest of them.
    next: u64,
    random: Pcg32,
}

impl Schedule {
    /// These events, their random numbers from the run's seed.
    pub fn new(events: &[Event], seed: u64) -> Self {
        let waiting: Vec<(u64, Event)> = events.iter().map(|event| (event.steps().0, *event)).collect();
        // Another stream than the sensors' noise, which starts from the same seed.
        let random = Pcg32::seed_from_u64(seed ^ 0x5ca7_7e12_ed15_c0de);
        Schedule { next: earliest(&waiting), waiting, random }
    }

    /// What is due before this control step, one action at a time; at the same time, in the order in which they were given.
    pub fn due(&mut self, step: u64) -> Option<Action> {
        if step < self.next {
            return None;
        }
        let (i, &(at, event)) =
            self.waiting.iter().enumerate().filter(|(_, (at, _))| *at <= step).min_by_key(|(_, w)| w.0)?;
        match event.steps().1 {
            Some(every) => self.waiting[i].0 = at + every,
            None => drop(self.waiting.remove(i)),
        }
        self.next = earliest(&self.waiting);
        Some(event.action)
    }

    /// A number uniform in ±`within`.
    pub fn random(&mut self, within: f64) -> f64 {
        within * (f64::from(self.random.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0)
    }
}

fn earliest(waiting: &[(u64, Event)]) -> u64 {
    waiting.iter().map(|(at, _)| *at).min().unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn carried_out(events: &[Event], steps: u64) -> Vec<(u64, Action)> {
        let mut schedule = Schedule::new(events, 1);
        let mut done = Vec::new();
        for step in 0..steps {
            while let Some(action) = schedule.due(step) {
                done.push((step, action));
            }
        }
        done
    }

    #[test]
    fn every_event_comes_in_its_time_and_in_the_order_given() {
        let (a, b, c) = (Action::Scatter(0.2), Action::Set(Id::EpsC, 0.5), Action::RandomC(5.0));
        let events = [Event::once(0.06, a), Event::once(0.06, b), Event { at: 0.0, every: Some(0.1), action: c }];
        assert_eq!(carried_out(&events, 11), [(0, c), (3, a), (3, b), (5, c), (10, c)]);
    }

    #[test]
    fn an_event_between_two_control_steps_comes_before_the_later_one() {
        assert_eq!(carried_out(&[Event::once(0.03, Action::RandomH(1.0))], 5), [(2, Action::RandomH(1.0))]);
    }

    #[test]
    fn random_numbers_fill_their_range_and_depend_on_the_seed() {
        let drawn = |seed| -> Vec<f64> {
            let mut schedule = Schedule::new(&[], seed);
            (0..1000).map(|_| schedule.random(5.0)).collect()
        };
        let numbers = drawn(1);
        let (low, high) = numbers.iter().fold((0.0_f64, 0.0_f64), |(low, high), &n| (low.min(n), high.max(n)));
        assert!((-5.0..-4.9).contains(&low) && (4.9..=5.0).contains(&high), "{low} to {high}");
        assert_eq!(numbers, drawn(1));
        assert_ne!(numbers, drawn(2));
    }
}
