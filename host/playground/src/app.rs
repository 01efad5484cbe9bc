//! The window: what it knows, and what it does in a frame.

mod acts;
mod farewell;
mod files;
mod layout;
mod news;
mod notices;
mod sides;
mod stage;
mod top;

use crate::channel::Frame;
use crate::drawer::Drawer;
use crate::film::Film;
use crate::guide::Guide;
use crate::help;
use crate::history::History;
use crate::keys::{self, Action};
use crate::knobs::Knobs;
use crate::order::{Order, Start};
use crate::plots::Plots;
use crate::recording::{Loading, Recording};
use crate::scene::Shape;
use crate::session::{Session, Status};
use crate::theme::Desktop;
use barrel::cli::PlayArgs;
use eframe::egui;
use egui::{Color32, Context, Panel, Theme, Ui};
use files::Files;
use layout::Layout;
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
        // Pure red on nearly black is hard to read.
        context.style_mut_of(Theme::Dark, |style| style.visuals.error_fg_color = Color32::from_rgb(0xff, 0x6b, 0x6b));
        let layout = storage.and_then(Layout::load).unwrap_or_default();
        let wake = context.clone();
        let session = Session::begin(args, move || wake.request_repaint());
        let start = Start::from(&args.setup);
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

/// The measures of a barrel with these parameters.
fn shape(start: &Start, values: &Values<f64>) -> Shape {
    Shape::from(&layout::setup(start, values).plant_body())
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
