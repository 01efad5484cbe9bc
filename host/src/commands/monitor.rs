//! `barrel monitor`: finds a robot, shows how it is, and records everything it says.
//!
//! It asks a robot who it is and what its parameters are, and from then on it listens. A robot never waits for it: what the
//! line cannot take, the robot drops.

use crate::cli::{Address, MonitorArgs};
use crate::failure::Failure;
use crate::interrupt;
use crate::journal::{Journal, News, parameters};
use crate::reach::{Finder, Found};
use crate::recorder::Places;
use crate::words;
use hil_sim::link::{Identity, Line, LinkError, Serial, hello};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use protocol::RobotMessage;
use protocol::message::SafetyState;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between two looks for a robot that is not there.
const LOOK: Duration = Duration::from_millis(500);
/// How long the line is listened to before the figures and the end are looked at.
const MOMENT: Duration = Duration::from_millis(50);
/// A robot that says nothing for so many moments in a row is asked. They are counted: a clock goes on while this process is
/// held up, and what the robot said meanwhile is still to be read.
const SILENCE: u32 = 20;
/// A robot that does not even answer for so long is looked for elsewhere.
const DESERTED: Duration = Duration::from_secs(5);

/// Watches until Ctrl-C, or for as long as was asked for.
///
/// # Errors
/// A named port without a robot; a log that cannot be written; no robot until the end.
pub fn monitor(args: &MonitorArgs) -> Result<(), Failure> {
    // What is wrong with the log's place is said before a robot is looked for.
    match &args.log {
        Some(log) => Places::new(None, Some(log.clone()), None).check()?,
        None => Places::check_run_folder()?,
    }
    let stop = interrupt::flag()?;
    let mut watch = Watch {
        args,
        journal: Journal::new(),
        screen: Screen::new(),
        stop,
        end: args.duration.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds)),
        robots: 0,
    };
    let ended = watch.go_on();
    watch.screen.clear();
    let robots = watch.robots;
    let (steps, lost, garbled) = (watch.journal.steps(), watch.journal.lost(), watch.journal.garbled());
    let log = watch.journal.finish()?;
    ended?;
    let Some(log) = log else {
        return Err(Failure::broken(match robots {
            0 => "no robot was found",
            _ => "the robot was gone before its parameters were known: there is no log",
        }));
    };
    say!("{steps} control steps; {lost} frames lost, {garbled} garbled");
    say!("Written:\n  {}", log.display());
    Ok(())
}

/// Why a robot is no longer listened to.
enum Left {
    /// It is over.
    End,
    /// It is not there any more; a sentence for people.
    Gone(String),
}

struct Watch<'a> {
    args: &'a MonitorArgs,
    journal: Journal,
    screen: Screen,
    stop: Arc<AtomicBool>,
    end: Option<Instant>,
    /// How often a robot was found.
    robots: u32,
}

impl Watch<'_> {
    fn go_on(&mut self) -> Result<(), Failure> {
        let mut finder = Finder::new(self.args.port.clone());
        let mut told = BTreeSet::new();
        while !self.is_over() {
            match finder.look(Instant::now()) {
                Ok(found) => {
                    let address = found.address.clone();
                    if let Left::Gone(why) = self.listen_to(found)? {
                        self.tell("gone", &format!("{why}; looking for the robot"))?;
                        self.journal.flush()?;
                    }
                    finder.lost(&address);
                }
                Err(why) if self.robots == 0 && self.args.port.is_some() => return Err(Failure::bad(why.join("; "))),
                Err(why) => {
                    // Ports come and go, and may be in use every other moment: each thing is said once.
                    let news: Vec<String> = why.into_iter().filter(|why| told.insert(why.clone())).collect();
                    if self.robots == 0 && !news.is_empty() {
                        self.screen.notice(&format!("{}; looking on, Ctrl-C ends", news.join("\n")));
                    }
                    self.nap(LOOK);
                }
            }
        }
        Ok(())
    }

    fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.end.is_some_and(|end| Instant::now() >= end)
    }

    fn nap(&self, length: Duration) {
        let until = Instant::now() + length;
        while Instant::now() < until && !self.is_over() {
            std::thread::sleep(MOMENT);
        }
    }

    /// Says and writes that something happened.
    fn tell(&mut self, kind: &str, text: &str) -> Result<(), Failure> {
        self.screen.notice(text);
        self.journal.event(kind, text)
    }

    /// Follows a robot until it is gone or the time is up.
    fn listen_to(&mut self, found: Found) -> Result<Left, Failure> {
        let Found { mut line, identity, address } = found;
        self.robots += 1;
        if let Err(error) = line.transport_mut().set_patience(MOMENT) {
            return Ok(Left::Gone(error.to_string()));
        }
        self.journal.connected(&line, &identity);
        let left = self.attend(&mut line, &identity, &address)?;
        // What it said while it was asked something is the last that is known of it.
        while let Some(message) = line.overheard() {
            self.heard(&message, &mut line)?;
        }
        self.journal.rest(&mut line)?;
        Ok(left)
    }

    /// Begins the log, if there is none yet, and listens.
    fn attend(&mut self, line: &mut Line<Serial>, identity: &Identity, address: &Address) -> Result<Left, Failure> {
        if !self.journal.has_log() {
            let values = match parameters(line) {
                Ok(values) => values,
                Err(error) => return Ok(Left::Gone(error.to_string())),
            };
            let mut command = format!("barrel monitor --port {address}");
            if let Some(duration) = self.args.duration {
                command += &format!(" --duration {duration}");
            }
            let link = format!("serial:{address}");
            let places = match &self.args.log {
                Some(log) => Places::new(None, Some(log.clone()), None),
                None => Places::log_folder("monitor")?,
            };
            self.journal.begin_log(&places, &command, &link, identity, &values)?;
        }
        let back = if self.robots > 1 { " again" } else { "" };
        let who = words::identity(identity).join("; ");
        self.tell("connected", &format!("found the robot on {address}{back}: {who}"))?;
        let mut heard = Instant::now();
        let mut quiet = 0;
        let mut silent = false;
        while !self.is_over() {
            match line.listen() {
                Ok(Some(message)) => {
                    (heard, quiet, silent) = (Instant::now(), 0, false);
                    self.heard(&message, line)?;
                }
                Ok(None) => {
                    quiet += 1;
                    self.journal.rest(line)?;
                }
                Err(error) => return Ok(Left::Gone(error.to_string())),
            }
            if quiet >= SILENCE {
                match hello(line) {
                    // It has nothing to say, as with the sensors of a simulation on its other line.
                    Ok(_) => (heard, quiet) = (Instant::now(), 0),
                    Err(LinkError::Broken(why)) => return Ok(Left::Gone(why)),
                    Err(_) if heard.elapsed() >= DESERTED && self.args.port.is_none() => {
                        return Ok(Left::Gone(format!("the robot on {address} does not answer")));
                    }
                    Err(error) if !silent => {
                        silent = true;
                        self.tell("silent", &error.to_string())?;
                        self.journal.flush()?;
                    }
                    Err(_) => {}
                }
            }
            self.screen.show(&self.journal);
        }
        Ok(Left::End)
    }

    fn heard(&mut self, message: &RobotMessage, line: &mut Line<Serial>) -> Result<(), Failure> {
        for news in self.journal.heard(message, line)? {
            self.news(news, line)?;
        }
        Ok(())
    }

    fn news(&mut self, news: News, line: &mut Line<Serial>) -> Result<(), Failure> {
        match news {
            News::State(state) => self.screen.notice(&format!("{:.2} s: {}", self.journal.now(), words::state(state))),
            News::Restarted => self.screen.notice("its brain began anew"),
            News::Reset => {
                let why = match hello(line) {
                    Ok(identity) => words::reset(identity.reset).to_owned(),
                    // If it is gone, the next look at the line says so.
                    Err(error) => error.to_string(),
                };
                self.tell("reset", &format!("the robot was reset: {why}"))?;
            }
            News::Vitals => {}
        }
        Ok(())
    }
}

/// Live figures: a few lines that are drawn again and again, or, where there is no terminal, one line a second.
struct Screen {
    bar: ProgressBar,
    next: Instant,
    /// When rates were last computed, from how many control steps and bytes, and what they were.
    rates: (Instant, u64, u64),
    rate: [f64; 2],
}

impl Screen {
    fn new() -> Self {
        let bar = ProgressBar::no_length();
        bar.set_draw_target(ProgressDrawTarget::stdout());
        // The template is a constant: whoever runs the command tests it.
        if let Ok(style) = ProgressStyle::with_template("{msg}") {
            bar.set_style(style);
        }
        Screen { bar, next: Instant::now(), rates: (Instant::now(), 0, 0), rate: [0.0; 2] }
    }

    /// Says something that stays.
    fn notice(&self, text: &str) {
        if self.bar.is_hidden() {
            say!("{text}");
        } else {
            self.bar.println(text);
        }
    }

    fn clear(&self) {
        self.bar.finish_and_clear();
    }

    fn show(&mut self, journal: &Journal) {
        let now = Instant::now();
        let (since, steps, bytes) = self.rates;
        let passed = now.duration_since(since).as_secs_f64();
        if passed >= 1.0 {
            let per_second = |now: u64, before: u64| now.saturating_sub(before) as f64 / passed;
            self.rate = [per_second(journal.steps(), steps), per_second(journal.bytes(), bytes)];
            self.rates = (now, journal.steps(), journal.bytes());
        }
        if now < self.next {
            return;
        }
        let terminal = !self.bar.is_hidden();
        self.next = now + Duration::from_millis(if terminal { 100 } else { 1000 });
        let lines = figures(journal, self.rate);
        if terminal {
            self.bar.set_message(lines.join("\n"));
            self.bar.tick();
        } else {
            say!("{}", lines.join("; "));
        }
    }
}

/// The figures, a line for the brain, one for the board, one for the line.
fn figures(journal: &Journal, [steps, bytes]: [f64; 2]) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(t) = journal.telemetry() {
        let state = match t.state {
            SafetyState::Disarmed => "Disarmed",
            SafetyState::Armed => "Armed",
            SafetyState::Fault(_) => "Fault",
        };
        lines.push(format!(
            "{state}  tick {}  x {:+.3} {:+.3}  y {:+.3} {:+.3}  E_tle {:.2e}",
            t.tick, t.x[0], t.x[1], t.y[0], t.y[1], t.time_loop_error
        ));
    }
    if let Some(v) = journal.vitals() {
        lines.push(format!(
            "awake {:.1} %  servo {} µs  brain {} µs  jitter {:.1} µs  late {}  IMU missed {}  battery {:.1} V  encoders {} {}{}{}",
            f64::from(v.load) / 100.0,
            v.servo_ns / 1000,
            v.brain_ns / 1000,
            f64::from(v.jitter_ns) / 1000.0,
            v.overruns,
            v.imu_missed,
            f64::from(v.battery_mv) / 1000.0,
            v.encoder[0],
            v.encoder[1],
            if v.homed { "" } else { "  not homed" },
            if v.simulated_sensors { "  simulated sensors" } else { "" }
        ));
    }
    let unsent = journal.vitals().map_or(0, |v| v.unsent);
    lines.push(format!(
        "{steps:.0} steps/s  {:.1} kB/s  lost {}  garbled {}  unsent {unsent}",
        bytes / 1000.0,
        journal.lost(),
        journal.garbled()
    ));
    lines
}
