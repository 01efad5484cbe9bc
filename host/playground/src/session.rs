//! The session behind the window: a barrel that goes on in a thread of its own, so that the window never waits for it.
//!
//! The window hands over [`Order`]s and finds what has become of them in the [`Desk`]: control steps as [`Frame`]s, sentences
//! for the console, and how things stand.

mod robot;
mod simulated;
mod status;

pub use status::{LinkState, Status};

use crate::channel::Frame;
use crate::order::{Order, Start};
use barrel::cli::{Link, PlayArgs, SetupArgs};
use barrel::session::Audience;
use protocol::RobotMessage;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Control steps that are kept for a window that does not look, as while it is minimised: the log has them all.
const KEPT: usize = 100_000;

/// What lies between session and window.
#[derive(Debug, Default)]
pub struct Desk {
    /// Control steps that the window has not taken yet.
    pub frames: Vec<Frame>,
    /// Sentences that the window has not taken yet.
    pub said: Vec<Said>,
    /// How things stand.
    pub status: Status,
}

/// A sentence of the console.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Said {
    /// A line that was given.
    Typed(String),
    /// What there is to say.
    Told(String),
    /// What could not be done, and why.
    Failed(String),
}

/// A session, as the window holds it. Dropping it ends the session in order: robot disarmed where it was in a simulation, log
/// complete.
pub struct Session {
    orders: Option<Sender<Order>>,
    desk: Arc<Mutex<Desk>>,
    thread: Option<JoinHandle<()>>,
    /// Whether there is a robot that can be touched at the other end.
    is_robot: bool,
}

impl Session {
    /// Begins what the command line asks for. `wake` is called when there is something to see.
    pub fn begin(args: &PlayArgs, wake: impl Fn() + Send + 'static) -> Self {
        let (send, orders) = mpsc::channel();
        let desk = Arc::new(Mutex::new(Desk::default()));
        let port = Port { orders, desk: desk.clone(), wake: Box::new(wake), fresh: Vec::new(), waiting: Vec::new() };
        let is_robot = matches!(args.setup.link, Link::Serial(_)) && !args.simulate;
        let args = args.clone();
        let thread = std::thread::spawn(move || match &args.setup.link {
            Link::Serial(address) if !args.simulate => robot::watch(&args.setup, address, port),
            _ => simulated::play(args.setup, port),
        });
        Session { orders: Some(send), desk, thread: Some(thread), is_robot }
    }

    /// Whether there is a robot that can be touched at the other end, and no simulated barrel.
    pub fn is_robot(&self) -> bool {
        self.is_robot
    }

    /// Asks for something.
    pub fn order(&self, order: Order) {
        // A session that is over has said so in its status.
        let _ = self.orders.as_ref().map(|orders| orders.send(order));
    }

    /// Takes what is new.
    pub fn look(&self) -> Desk {
        let mut desk = lock(&self.desk);
        let status = desk.status.clone();
        Desk { frames: std::mem::take(&mut desk.frames), said: std::mem::take(&mut desk.said), status }
    }

    /// Ends the session and waits until its files are complete. One that is still waiting for its robot, as for an image that is
    /// being built, has none, and is left behind.
    pub fn end(&mut self) {
        self.orders = None;
        let Some(thread) = self.thread.take() else { return };
        while !thread.is_finished() && !matches!(lock(&self.desk).status.link, LinkState::Connecting(_)) {
            std::thread::sleep(Duration::from_millis(5));
        }
        if thread.is_finished() {
            // Its panic has been told on standard error already.
            let _ = thread.join();
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.end();
    }
}

/// A panic in a session leaves sentences and numbers behind that are still true.
fn lock(desk: &Mutex<Desk>) -> MutexGuard<'_, Desk> {
    desk.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The session's end of what lies between it and the window.
struct Port {
    orders: Receiver<Order>,
    desk: Arc<Mutex<Desk>>,
    wake: Box<dyn Fn() + Send>,
    /// Control steps that are not on the desk yet.
    fresh: Vec<Frame>,
    /// Orders that were looked at and left for later.
    waiting: Vec<Order>,
}

/// What comes to a session.
enum Asked {
    /// Something to do.
    Order(Order),
    /// Nothing, for now.
    Nothing,
    /// The window is gone.
    Gone,
}

impl Port {
    /// Waits for an order, for so long at most.
    fn wait(&mut self, time: Duration) -> Asked {
        let asked = if !self.waiting.is_empty() {
            Ok(self.waiting.remove(0))
        } else if time.is_zero() {
            match self.orders.try_recv() {
                Err(mpsc::TryRecvError::Disconnected) => Err(RecvTimeoutError::Disconnected),
                asked => asked.map_err(|_| RecvTimeoutError::Timeout),
            }
        } else {
            self.orders.recv_timeout(time)
        };
        match asked {
            // A knob that turns asks for more than a robot can take over a radio: the last word counts.
            Ok(Order::Set(id, value)) => Asked::Order(self.last_of(Order::Set(id, value))),
            Ok(order) => Asked::Order(order),
            Err(RecvTimeoutError::Timeout) => Asked::Nothing,
            Err(RecvTimeoutError::Disconnected) => Asked::Gone,
        }
    }

    /// The last of the orders for the same parameter that wait in a row.
    fn last_of(&mut self, mut order: Order) -> Order {
        while let Ok(next) = self.orders.try_recv() {
            match (&order, next) {
                (Order::Set(id, _), Order::Set(same, value)) if *id == same => order = Order::Set(same, value),
                (_, other) => {
                    self.waiting.push(other);
                    break;
                }
            }
        }
        order
    }

    /// Adds a control step; the window sees it at the next [`Port::publish`].
    fn frame(&mut self, frame: Frame) {
        self.fresh.push(frame);
    }

    /// Lays everything new on the desk and says how things stand.
    fn publish(&mut self, change: impl FnOnce(&mut Status)) {
        let mut desk = lock(&self.desk);
        let is_new = !self.fresh.is_empty();
        desk.frames.append(&mut self.fresh);
        // Not one by one: what is behind them moves up.
        if desk.frames.len() > KEPT + KEPT / 4 {
            let surplus = desk.frames.len() - KEPT;
            desk.frames.drain(..surplus);
        }
        let (before, session) = (desk.status.shown(), desk.status.session);
        change(&mut desk.status);
        if desk.status.session != session {
            // The time begins anew: nobody could tell the last session's steps from this one's.
            desk.frames.clear();
        }
        desk.status.beat = Instant::now();
        let is_new = is_new || desk.status.shown() != before;
        drop(desk);
        if is_new {
            (self.wake)();
        }
    }

    /// Notes a line that was given.
    fn typed(&mut self, line: &str) {
        self.note(Said::Typed(line.to_owned()));
    }

    fn note(&mut self, said: Said) {
        lock(&self.desk).said.push(said);
        (self.wake)();
    }

    /// Waits for what to begin next, after a session has come to its end. `None` if the window is gone.
    fn wait_for_start(&mut self) -> Option<Start> {
        loop {
            match self.wait(Duration::from_millis(100)) {
                Asked::Order(Order::Start(start)) => return Some(start),
                Asked::Order(Order::Line(line)) => {
                    self.typed(&line);
                    self.complain("nothing is running: choose an experiment and start it");
                }
                Asked::Order(_) => {}
                Asked::Nothing => self.publish(|_| {}),
                Asked::Gone => return None,
            }
        }
    }
}

impl Audience for Port {
    fn say(&mut self, text: &str) {
        if !text.is_empty() {
            self.note(Said::Told(text.to_owned()));
        }
    }

    fn complain(&mut self, text: &str) {
        self.note(Said::Failed(text.to_owned()));
    }

    fn heard(&mut self, t: f64, message: &RobotMessage) {
        robot::heard(self, t, message);
    }
}

/// The command line's setup with what is to begin now in place of what it began with.
fn with_start(setup: &SetupArgs, start: &Start) -> SetupArgs {
    SetupArgs {
        experiment: start.experiment,
        body: start.body.into(),
        seed: start.seed,
        sets: start.sets.clone(),
        pushes: Vec::new(),
        schedule: Vec::new(),
        ..setup.clone()
    }
}

#[cfg(test)]
mod tests;
