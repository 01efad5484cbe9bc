//! What the window asks of the session behind it.

use barrel::cli::SetupArgs;
use barrel::console::{Action, Command, parse};
use hil_sim::experiment::Experiment;
use hil_sim::plant::Load;
use hil_sim::setup::BodyKind;
use protocol::Id;

/// Something that the window asks for. The window never waits: what comes of it is told in the session's news.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// A line of the console; it and its answer are shown in the drawer.
    Line(String),
    /// A parameter takes a value that was checked; a knob that is being turned sends many of these.
    Set(Id, f64),
    /// A hand pulls the barrel from now on, until another order says otherwise.
    Hand(Load),
    /// The session ends, and another begins.
    Start(Start),
}

/// A session to begin.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// The experiment.
    pub experiment: &'static Experiment,
    /// The barrel.
    pub body: BodyKind,
    /// Seed of all randomness.
    pub seed: u64,
    /// What differs from the experiment's preset.
    pub sets: Vec<(Id, f64)>,
}

impl From<&SetupArgs> for Start {
    /// What the command line asks for.
    fn from(args: &SetupArgs) -> Self {
        Start { experiment: args.experiment, body: args.body.into(), seed: args.seed, sets: args.sets.clone() }
    }
}

/// How much weaker the same push is on the tabletop than on the chapter's barrel, so that it changes the rolling by as much, in
/// parts of √(g/R): a torque's by the moments of inertia, a force's by the masses.
const TABLETOP_TORQUE: f64 = 0.12;
const TABLETOP_FORCE: f64 = 0.5;

impl Order {
    /// A line of a key or a button. Its pushes are those of the chapter; on a smaller barrel they are smaller.
    pub fn sized(line: &str, body: BodyKind) -> Order {
        let sized = |number: f64| (number * 100.0).round() / 100.0;
        Order::Line(match (body, parse(line)) {
            (BodyKind::Tabletop, Ok(Command::Act(Action::Push { torque, seconds }))) => {
                format!("push {} {seconds}", sized(torque * TABLETOP_TORQUE))
            }
            (BodyKind::Tabletop, Ok(Command::Act(Action::Shove { force, seconds }))) => {
                format!("shove {} {seconds}", sized(force * TABLETOP_FORCE))
            }
            _ => line.to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_barrel_is_pushed_less_and_nothing_else_is_changed() {
        let line = |line, body| match Order::sized(line, body) {
            Order::Line(line) => line,
            other => panic!("a line stays one: {other:?}"),
        };
        assert_eq!(line("push -10 0.02", BodyKind::Tabletop), "push -1.2 0.02");
        assert_eq!(line("shove 30 0.5", BodyKind::Tabletop), "shove 15 0.5");
        for same in ["scatter 0.2", "stop", "random C 5"] {
            assert_eq!(line(same, BodyKind::Tabletop), same);
        }
        assert_eq!(line("push 10 0.02", BodyKind::Chapter), "push 10 0.02");
    }
}
