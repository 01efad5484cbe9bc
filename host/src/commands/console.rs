//! `barrel console`: a barrel that rolls while its parameters are shown, set, stored and loaded.

use crate::cli::{ConsoleArgs, Link};
use crate::commands::robot_console::robot_console;
use crate::commands::run::{About, OverLink, description, over_link, title};
use crate::console::{Console, Input, history};
use crate::failure::Failure;
use crate::recorded::Recorded;
use crate::recorder::Places;
use crate::session::{Audience, Simulated};
use hil_sim::coupling::Coupling;
use hil_sim::measure::Measures;
use hil_sim::setup::BodyKind;

/// Runs the experiment at the speed asked for and carries out every line that is typed, until `quit`; or talks to a robot on
/// a serial line as it stands there.
///
/// # Errors
/// As `barrel run`.
pub fn console(args: &ConsoleArgs) -> Result<(), Failure> {
    match &args.setup.link {
        Link::Serial(address) if !args.simulate => robot_console(args, address),
        _ => {
            let places = Places::new(args.csv.clone(), args.log.clone(), None);
            // What is wrong with the places is said before a robot hears of the run.
            places.check()?;
            over_link(&args.setup, Session { args, places })
        }
    }
}

struct Session<'a> {
    args: &'a ConsoleArgs,
    places: Places,
}

impl OverLink for Session<'_> {
    fn over(self, link: impl Coupling, robot: &About) -> Result<(), Failure> {
        let Session { args, places } = self;
        let setup = args.setup.setup()?;
        let about = description(&args.setup, &setup, robot, args.duration);
        let recorded = Recorded::start(setup, link, || Ok(places), &about, title(&args.setup, 0.0))?;
        let mut barrel = Simulated::new(recorded, args.speed);
        let mut console = Console::start(history().as_deref());
        console.print(&format!(
            "{} on the {} body, seed {}; help explains, quit ends",
            args.setup.experiment.name,
            BodyKind::from(args.setup.body).name(),
            args.setup.seed
        ));
        let mut measures = Measures::default();
        let ended = go_on(&mut barrel, &mut console, &mut measures, args.duration.unwrap_or(f64::INFINITY));
        let files = barrel.finish(ended)?;
        for line in measures.summary() {
            console.print(&line);
        }
        for file in files {
            console.print(&format!("written: {}", file.display()));
        }
        Ok(())
    }
}

/// Steps in pace with the clock, and carries out lines in between, until the end or `quit`.
fn go_on<L: Coupling>(
    barrel: &mut Simulated<L>,
    console: &mut Console,
    measures: &mut Measures,
    end: f64,
) -> Result<(), Failure> {
    let mut listening = true;
    while !barrel.is_over() && barrel.time() < end {
        let nap = barrel.nap();
        let input = if !listening {
            std::thread::sleep(nap);
            None
        } else if nap.is_zero() {
            console.poll()
        } else {
            console.wait(nap)
        };
        let carried_out = match input {
            Some(Input::Line(line)) => barrel.offer(line, console.is_person(), console)?,
            // A script ends; the run goes on to its own end, if it has one.
            Some(Input::End) => {
                listening = false;
                barrel.go();
                true
            }
            None => false,
        };
        if carried_out || barrel.carry_on(console)? {
            continue;
        }
        if barrel.is_idle() && !listening && !end.is_finite() {
            break;
        }
        if barrel.is_due() {
            measures.add(&barrel.step(console)?.record);
        }
    }
    Ok(())
}

impl Audience for Console {
    fn say(&mut self, text: &str) {
        self.print(text);
    }
}
