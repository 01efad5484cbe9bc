//! `barrel console --link serial:PORT`: a robot as it stands there, with its own sensors and motors.

use crate::cli::{Address, ConsoleArgs};
use crate::commands::run::About;
use crate::console::{Console, Input, history};
use crate::failure::Failure;
use crate::journal::{Journal, parameters};
use crate::reach::reach;
use crate::recorder::Places;
use crate::session::Attached;
use crate::words;
use hil_sim::link::Serial;
use protocol::message::SafetyState;
use std::time::Instant;

/// Carries out every line that is typed, and shows what the robot does by itself, until `quit`.
///
/// # Errors
/// A robot that cannot be reached, or whose line goes away; options that only a simulated run has.
pub fn robot_console(args: &ConsoleArgs, address: &Address) -> Result<(), Failure> {
    let of_a_run =
        !args.setup.sets.is_empty() || !args.setup.pushes.is_empty() || args.csv.is_some() || args.speed != 1.0;
    if of_a_run {
        return Err(Failure::bad(
            "--set, --push, --csv and --speed are for a simulated run: set parameters in the console, or add --simulate",
        ));
    }
    // What is wrong with its place is said before the robot hears of it.
    let places = Places::new(None, args.log.clone(), None);
    places.check()?;
    let (mut line, identity) = reach(address)?;
    About::checked(&identity, args.setup.precision)?;
    let mut journal = Journal::new();
    journal.connected(&line, &identity);
    if args.log.is_some() {
        let (link, command) = (args.setup.link.to_string(), format!("barrel console --link {}", args.setup.link));
        let values = parameters(&mut line).map_err(Failure::broken)?;
        journal.begin_log(&places, &command, &link, &identity, &values)?;
    }
    let mut console = Console::start(history().as_deref());
    console.print(&format!("the robot on {address}; help explains, quit ends"));
    console.print(&words::identity(&identity).join("\n"));
    let mut session = Attached::new(line, journal);
    let duration = args.duration.unwrap_or(f64::INFINITY);
    let ended = session.own_sensors(&mut console).and_then(|()| go_on(&mut session, &mut console, duration));
    if ended.is_ok() && session.state() == Some(SafetyState::Armed) {
        console.print("the robot stays Armed");
    }
    // The last that was heard belongs into the log, however it ended.
    if let Some(log) = session.finish()? {
        console.print(&format!("written: {}", log.display()));
    }
    ended
}

/// Listens to the robot and to the person, until the end or `quit`.
fn go_on(session: &mut Attached<Serial>, console: &mut Console, duration: f64) -> Result<(), Failure> {
    let start = Instant::now();
    let mut listening = true;
    while !session.is_over() && start.elapsed().as_secs_f64() < duration {
        // Waits for the robot, for a moment at most: this is the pace of the loop.
        session.turn(console)?;
        while let Some(input) = console.poll() {
            match input {
                Input::Line(line) => session.offer(line, console.is_person(), console)?,
                Input::End => listening = false,
            }
        }
        // A script ends when everything in it has been done.
        if !listening && session.is_idle() && !duration.is_finite() {
            session.quit();
        }
    }
    Ok(())
}
