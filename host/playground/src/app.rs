//! The window: what it knows, and what it does in a frame.

mod farewell;
mod files;
mod layout;
mod notices;
mod stage;
mod top;

use crate::channel::Frame;
use crate::drawer::Drawer;
use crate::film::Film;
use crate::guide::{self, Guide, Stage};
use crate::history::History;
use crate::keys::{self, Action, speed};
use crate::knobs::{self, Held, Knobs};
use crate::order::{Order, Start};
use crate::picture;
use crate::plots::Plots;
use crate::recording::{Loading, Recording};
use crate::scene::{Mode, Shape};
use crate::session::{Desk, LinkState, Said, Session, Status};
use crate::theme::Desktop;
use crate::{help, matrix, plots};
use barrel::cli::PlayArgs;
use barrel::session::Pace;
use eframe::egui;
use egui::{Context, Panel, Ui};
use files::Files;
use layout::{Layout, Left};
use notices::Notices;
use protocol::Values;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::JoinHandle;

/// Control steps that the window remembers of a session: two simulated hours. The log has them all.
const REMEMBERED: usize = 360_000;

/// A window that is narrower is laid out more closely, points.
const NARROW: f32 = 1110.0;
/// The scene is at least so wide, points: however narrow the window is, the barrel is seen.
const SCENE: f32 = 180.0;

/// The window.
pub struct App {
    session: Session,
    status: Status,
    /// What the session has told so far.
    live: Show,
    /// A recording that is shown instead.
    recording: Option<Playback>,
    loading: Option<Loading>,
    layout: Layout,
    knobs: Knobs,
    drawer: Drawer,
    guide: Guide,
    files: Files,
    notices: Notices,
    film: Option<Film>,
    /// Films that are being written to their end.
    films: Vec<JoinHandle<()>>,
    help: bool,
    /// Where the scene was in the last frame.
    scene: egui::Rect,
    /// A hand pulled in the last frame.
    hand: bool,
    leaving: bool,
    /// Somebody pressed Ctrl-C in the terminal.
    interrupted: Arc<AtomicBool>,
    /// The last line of the console is one whose answer is to be seen: a file was written or read.
    answers_matter: bool,
    desktop: Desktop,
}

/// What is shown, and which instant of it.
struct Show {
    history: History,
    shape: Shape,
    /// The instant that somebody looks at, s; the newest if it is not said.
    cursor: Option<f64>,
    /// The instant of the scene, s: it runs smoothly from one control step to the next.
    clock: f64,
}

/// A recording that is played.
struct Playback {
    recording: Recording,
    show: Show,
    playing: bool,
    /// Recorded seconds a second.
    speed: f64,
}

impl App {
    /// A window on what the command line asks for, laid out as it was left. `typed` is the file that keeps the console's lines.
    pub fn new(
        args: &PlayArgs,
        typed: Option<PathBuf>,
        storage: Option<&dyn eframe::Storage>,
        context: &Context,
    ) -> Self {
        let layout = storage.and_then(Layout::load).unwrap_or_default();
        let wake = context.clone();
        let session = Session::begin(args, move || wake.request_repaint());
        let setup = &args.setup;
        let start =
            Start { experiment: setup.experiment, body: setup.body.into(), seed: setup.seed, sets: setup.sets.clone() };
        let mut app = App {
            session,
            status: Status::default(),
            live: Show::new(History::new(REMEMBERED), shape(&start, &layout::preset(&start))),
            recording: None,
            loading: None,
            layout,
            knobs: Knobs::default(),
            drawer: Drawer::new(typed),
            guide: Guide::of(&start),
            files: Files::default(),
            notices: Notices::default(),
            film: None,
            films: Vec::new(),
            help: false,
            scene: egui::Rect::NOTHING,
            hand: false,
            leaving: false,
            interrupted: Arc::default(),
            answers_matter: false,
            desktop: Desktop::default(),
        };
        if let Some(path) = &args.open {
            app.open(path.clone(), context);
        }
        app
    }

    /// Closes the window in order as soon as this flag is set.
    pub fn until(self, interrupted: Arc<AtomicBool>) -> Self {
        App { interrupted, ..self }
    }

    /// Is light or dark as the desktop is, unless somebody has chosen one of them.
    pub fn as_light_as(self, desktop: Desktop) -> Self {
        App { desktop, ..self }
    }

    /// Asks the session for something.
    pub fn order(&self, order: Order) {
        self.session.order(order);
    }

    /// How the session stands.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// The control steps of what is shown, session or recording.
    pub fn history(&self) -> &History {
        &self.show().history
    }

    /// The control step that is looked at.
    pub fn frame(&self) -> Option<Frame> {
        self.show().frame()
    }

    /// Whether a recording is shown.
    pub fn is_recording_shown(&self) -> bool {
        self.recording.is_some()
    }

    /// Whether the help is shown.
    pub fn is_help_shown(&self) -> bool {
        self.help
    }

    /// The plots.
    pub fn plots(&self) -> &Plots {
        &self.layout.plots
    }

    /// The plots, to choose others.
    pub fn plots_mut(&mut self) -> &mut Plots {
        &mut self.layout.plots
    }

    /// Begins to read a recording.
    fn open(&mut self, path: PathBuf, context: &Context) {
        let wake = context.clone();
        self.loading = Some(Loading::begin(path, move || wake.request_repaint()));
    }

    /// What is shown.
    fn show(&self) -> &Show {
        self.recording.as_ref().map_or(&self.live, |playback| &playback.show)
    }

    fn show_mut(&mut self) -> &mut Show {
        self.recording.as_mut().map_or(&mut self.live, |playback| &mut playback.show)
    }

    /// Where pictures and films go: beside the recording that is shown or made.
    fn folder(&self) -> PathBuf {
        let log = match &self.recording {
            Some(playback) => Some(playback.recording.path.as_path()),
            None => self.status.log.as_deref(),
        };
        log.and_then(Path::parent).map_or_else(PathBuf::new, Path::to_path_buf)
    }

    /// Takes what is new from the session and from files that are being read.
    fn take_news(&mut self) {
        let Desk { frames, said, status } = self.session.look();
        if status.session != self.status.session {
            self.live.begin();
            if let Some(start) = &status.start {
                self.guide = Guide::of(start);
                self.knobs.pending.clear();
            }
        }
        let changed = status.revision != self.status.revision || status.session != self.status.session;
        self.status = status;
        if changed {
            self.reshape();
        }
        self.live.history.extend(&frames);
        for sentence in said {
            match sentence {
                Said::Typed(line) => {
                    self.answers_matter = ["store", "load"].iter().any(|word| line.trim_start().starts_with(word));
                    self.drawer.typed(&line);
                }
                Said::Told(text) => {
                    if self.answers_matter && !self.layout.console {
                        self.notices.tell(&text);
                    }
                    self.drawer.said(&text);
                }
                Said::Failed(text) => {
                    if !self.layout.console {
                        self.notices.warn(&text);
                    }
                    self.drawer.failed(&text);
                }
            }
        }
        if let Some(result) = self.loading.as_ref().and_then(Loading::done) {
            self.loading = None;
            match result {
                Ok(recording) => self.play(recording),
                Err(why) => self.notices.warn(&why),
            }
        }
        while let Some(done) = self.notices.arrived() {
            self.drawer.said(&done);
        }
        if self.film.as_ref().is_some_and(Film::is_over) {
            self.end_film();
        }
    }

    /// The barrel may have got other measures.
    fn reshape(&mut self) {
        let (Some(values), Some(start)) = (&self.status.values, &self.status.start) else { return };
        self.live.shape = shape(start, values);
    }

    /// Shows a recording.
    fn play(&mut self, mut recording: Recording) {
        if let Some(problem) = &recording.problem {
            self.notices.warn(&format!("{}: {problem}", recording.path.display()));
        }
        let start = Start { experiment: self.guide.chosen, body: recording.body, seed: 1, sets: Vec::new() };
        let shape = shape(&start, &recording.values);
        let mut show = Show::new(std::mem::take(&mut recording.history), shape);
        if let Some((begin, _)) = show.history.span() {
            show.look_at(begin);
        }
        self.layout.plots.show_all();
        self.recording = Some(Playback { recording, show, playing: false, speed: 1.0 });
        self.layout.view.recentre();
    }

    /// Goes back from a recording to the session.
    fn back_to_live(&mut self) {
        self.recording = None;
        self.layout.plots.follow();
        self.layout.view.recentre();
    }

    fn end_film(&mut self) {
        if let Some(film) = self.film.take() {
            let sender = self.notices.sender();
            self.films.retain(|film| !film.is_finished());
            self.films.push(film.finish(move |said| sender.tell(said)));
        }
    }

    /// Does what was asked for by a key or a button.
    fn act(&mut self, action: Action, context: &Context, orders: &mut Vec<Order>) {
        match action {
            Action::Lines(["step"]) => self.step(orders),
            Action::Lines(lines) => {
                let body = self.status.start.as_ref().map_or(self.guide.body, |start| start.body);
                orders.extend(lines.iter().map(|line| Order::sized(line, body)));
            }
            Action::PauseOrGo => self.pause_or_go(orders),
            Action::Faster => self.set_speed(speed::faster(self.speed()), orders),
            Action::Slower => self.set_speed(speed::slower(self.speed()), orders),
            Action::StartAgain => self.start_again(orders),
            Action::Follow => {
                let mode = &mut self.layout.view.mode;
                *mode = if *mode == Mode::Follow { Mode::Orbit } else { Mode::Follow };
            }
            Action::Help => self.help = !self.help,
            Action::Plots => self.layout.plots_shown = !self.layout.plots_shown,
            Action::Console => {
                self.layout.console = !self.layout.console;
                if self.layout.console {
                    self.drawer.focus();
                }
            }
            Action::Open => self.files.choose(),
            Action::SaveSet => {
                self.layout.left = Left::Knobs;
                self.knobs.save_set();
            }
            Action::Picture => {
                let (place, sender) = (self.folder(), self.notices.sender());
                picture::take(context, place, move |said| sender.tell(said));
            }
            Action::Film => match self.film {
                Some(_) => self.end_film(),
                None => match Film::begin(&self.folder(), self.layout.film) {
                    Ok(film) => self.film = Some(film),
                    Err(why) => self.notices.warn(&why),
                },
            },
        }
    }

    /// Passes on what steers the session. While a recording hides it, it is only stopped, or begun anew and shown.
    fn steer(&mut self, steering: Vec<Order>, orders: &mut Vec<Order>) {
        for order in steering {
            let is_start = matches!(order, Order::Start(_));
            let is_safe = matches!(&order, Order::Line(line) if line == "stop" || line == "disarm");
            if self.recording.is_some() && is_start {
                self.back_to_live();
            }
            if self.recording.is_none() || is_safe {
                orders.push(order);
            } else {
                self.notices.warn("A recording is shown: go back to live first.");
            }
        }
    }

    fn speed(&self) -> f64 {
        self.recording.as_ref().map_or(self.status.speed, |playback| playback.speed)
    }

    fn set_speed(&mut self, speed: f64, orders: &mut Vec<Order>) {
        match &mut self.recording {
            // Nothing is to be computed: there is no such thing as "as fast as it goes".
            Some(playback) => playback.speed = if speed.is_finite() { speed } else { playback.speed },
            None if speed.is_finite() => orders.push(Order::Line(format!("speed {speed}"))),
            None => orders.push(Order::Line("speed max".to_owned())),
        }
    }

    fn is_going(&self) -> bool {
        match &self.recording {
            Some(playback) => playback.playing,
            None => self.status.link.is_up() && self.status.pace != Pace::Paused,
        }
    }

    fn pause_or_go(&mut self, orders: &mut Vec<Order>) {
        match &mut self.recording {
            Some(playback) => playback.toggle(),
            None => {
                self.live.cursor = None;
                let line = if self.status.pace == Pace::Paused { "go" } else { "pause" };
                orders.push(Order::Line(line.to_owned()));
            }
        }
    }

    fn step(&mut self, orders: &mut Vec<Order>) {
        match &mut self.recording {
            Some(playback) => playback.step(1),
            None => orders.push(Order::Line("step".to_owned())),
        }
    }

    /// Shows the parameters.
    fn knobs(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        let Some((held, knobs)) = self.held() else {
            ui.weak("The parameters are shown as soon as the robot has told them.");
            return;
        };
        knobs::show(ui, knobs, &held.of(), orders);
    }

    fn start_again(&mut self, orders: &mut Vec<Order>) {
        let again = self.held().and_then(|(held, knobs)| knobs.start_again(&held.of()));
        orders.extend(again.map(Order::Start));
    }

    /// What the knobs are to show, and they themselves.
    fn held(&mut self) -> Option<(Holding<'_>, &mut Knobs)> {
        let start = self.status.start.as_ref()?;
        let (values, live, enabled) = match &self.recording {
            Some(playback) => (&playback.recording.values, playback.show.frame(), false),
            None => (self.status.values.as_ref()?, self.live.history.frame_at(None), self.status.link.is_up()),
        };
        let robot_only = self.session.is_robot() && self.recording.is_none();
        Some((Holding { values, preset: layout::preset(start), live, start, robot_only, enabled }, &mut self.knobs))
    }

    fn left(&mut self, ui: &mut Ui, orders: &mut Vec<Order>) {
        ui.horizontal(|ui| {
            for left in [Left::Guide, Left::Knobs] {
                ui.selectable_value(&mut self.layout.left, left, left.name());
            }
        });
        ui.separator();
        match self.layout.left {
            Left::Guide => {
                self.guide.stage = match (&self.recording, self.session.is_robot()) {
                    (Some(_), _) => Stage::Idle,
                    (None, true) => Stage::Robot,
                    (None, false) if matches!(self.status.link, LinkState::Over(_)) => Stage::Idle,
                    (None, false) => Stage::Simulation,
                };
                if let Some(start) = &self.status.start {
                    guide::show(ui, &mut self.guide, start, orders);
                }
            }
            Left::Knobs => self.knobs(ui, orders),
        }
    }

    fn right(&mut self, ui: &mut Ui) {
        let frame = self.show().frame();
        // In a low window, too, there is room for plots.
        let half = 0.5 * ui.available_height();
        egui::CollapsingHeader::new("Matrices").default_open(true).show(ui, |ui| {
            let area = egui::ScrollArea::vertical().id_salt("matrices").max_height(half);
            area.show(ui, |ui| matrix::show(ui, frame.as_ref()));
        });
        let show = self.recording.as_ref().map_or(&self.live, |playback| &playback.show);
        let output = plots::show(ui, &mut self.layout.plots, &show.history, show.cursor);
        if output.live && self.recording.is_none() {
            self.live.cursor = None;
        }
        if let Some(t) = output.scrub {
            self.show_mut().look_at(t);
            if let Some(playback) = &mut self.recording {
                playback.playing = false;
            }
        }
    }
}

/// What the knobs are to show.
struct Holding<'a> {
    values: &'a Values<f64>,
    preset: Values<f64>,
    live: Option<Frame>,
    start: &'a Start,
    robot_only: bool,
    enabled: bool,
}

impl Holding<'_> {
    fn of(&self) -> Held<'_> {
        Held {
            values: self.values,
            preset: &self.preset,
            live: self.live.as_ref(),
            running: Some(self.start),
            robot_only: self.robot_only,
            enabled: self.enabled,
        }
    }
}

/// The measures of a barrel with these parameters.
fn shape(start: &Start, values: &Values<f64>) -> Shape {
    Shape::from(&layout::setup(start, values).plant_body())
}

impl App {
    /// Shows the window, and does what was done to it.
    pub fn show_window(&mut self, ui: &mut Ui) {
        let context = ui.ctx().clone();
        // What keys and buttons on the left ask for is meant for what is shown; the rest for the session.
        let (mut steering, mut orders) = (Vec::new(), Vec::new());
        self.take_news();
        self.farewell(&context, &mut orders);
        let mut actions = keys::pressed(&context);
        // A robot that can be touched is stopped whatever dialog Esc would close.
        let is_stop = |action: &Action| *action == Action::Lines(&["stop"]);
        if self.session.is_robot()
            && context.input(|input| input.key_pressed(egui::Key::Escape))
            && !actions.iter().any(is_stop)
        {
            actions.push(Action::Lines(&["stop"]));
        }
        for action in actions {
            self.act(action, &context, &mut steering);
        }
        self.dropped(&context);
        let dt = f64::from(context.input(|input| input.stable_dt));
        let (speed, going) = (self.status.speed, self.is_going());
        match &mut self.recording {
            Some(playback) => playback.advance(dt),
            None => self.live.advance(dt, speed, going),
        }
        Panel::top("top").show(ui, |ui| self.top(ui, &mut steering, &mut orders));
        Panel::bottom("console").resizable(true).default_size(180.0).show_collapsible(
            ui,
            &mut self.layout.console,
            |ui| self.drawer.show(ui, &mut orders),
        );
        Panel::bottom("time").show(ui, |ui| self.timeline(ui, &mut orders));
        // Egui remembers how wide a panel was: what a narrow window does to one must not be left of it in a wide one.
        let (is_narrow, width) = (ui.available_width() < NARROW, ui.available_width());
        let (left, right) = if is_narrow { ("narrow left", "narrow plots") } else { ("left", "plots") };
        let sizes = if is_narrow { [335.0, 285.0] } else { [365.0, 540.0] };
        let left = Panel::left(left).resizable(true).default_size(sizes[0]).max_size(0.42 * width);
        left.show(ui, |ui| self.left(ui, &mut steering));
        let mut plots_shown = self.layout.plots_shown;
        let right = Panel::right(right).resizable(true).default_size(sizes[1]).max_size(ui.available_width() - SCENE);
        right.show_collapsible(ui, &mut plots_shown, |ui| self.right(ui));
        self.layout.plots_shown = plots_shown;
        egui::CentralPanel::no_frame().show(ui, |ui| self.stage(ui, &mut orders));
        help::show(&context, &mut self.help);
        if let Some(path) = self.files.show(&context) {
            self.open(path, &context);
        }
        // A film shows the barrel, and nothing that comes and goes over it.
        if self.film.is_none() {
            self.notices.show(&context);
        }
        self.steer(steering, &mut orders);
        for order in orders {
            self.session.order(order);
        }
        if let Some(film) = &mut self.film {
            film.tick(&context, self.scene);
        }
        // A frame is due for every one of the screen while something moves, else once in a while: a link may fall silent.
        if self.is_going() || self.film.is_some() {
            context.request_repaint();
        } else {
            context.request_repaint_after(std::time::Duration::from_millis(200));
        }
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.show_window(ui);
    }

    fn raw_input_hook(&mut self, _context: &Context, input: &mut egui::RawInput) {
        input.system_theme = self.desktop.theme().or(input.system_theme);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        self.layout.store(storage);
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        self.session.end();
        self.end_film();
        for film in self.films.drain(..) {
            // Its panic has been told on standard error already.
            let _ = film.join();
        }
    }
}
