//! Whether the desktop is light or dark, where the window's own library cannot tell: on Linux it is asked over D-Bus.

use eframe::egui::{Context, Theme};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// The desktop's theme, as it is now.
#[derive(Clone, Debug, Default)]
pub struct Desktop(Arc<AtomicU8>);

/// What is in it until the desktop has told something else.
const UNKNOWN: u8 = 0;
const LIGHT: u8 = 1;
const DARK: u8 = 2;

impl Desktop {
    /// Watches the desktop in a thread of its own, as it may take its time to answer; `context` draws itself anew when the theme
    /// changes.
    pub fn watch(context: &Context) -> Self {
        let desktop = Desktop::default();
        #[cfg(target_os = "linux")]
        {
            let (desktop, context) = (desktop.clone(), context.clone());
            std::thread::spawn(move || follow(&desktop, &context));
        }
        #[cfg(not(target_os = "linux"))]
        let _ = context;
        desktop
    }

    /// The theme, if the desktop has told it.
    pub fn theme(&self) -> Option<Theme> {
        match self.0.load(Ordering::Relaxed) {
            LIGHT => Some(Theme::Light),
            DARK => Some(Theme::Dark),
            _ => None,
        }
    }
}

/// Notes the theme now and whenever it changes. A desktop that does not tell leaves it unknown.
#[cfg(target_os = "linux")]
fn follow(desktop: &Desktop, context: &Context) {
    let note = |mode| {
        let theme = match mode {
            dark_light::Mode::Light => LIGHT,
            dark_light::Mode::Dark => DARK,
            dark_light::Mode::Unspecified => UNKNOWN,
        };
        desktop.0.store(theme, Ordering::Relaxed);
        context.request_repaint();
    };
    if let Ok(mode) = dark_light::detect() {
        note(mode);
    }
    if let Ok(changes) = dark_light::subscribe() {
        changes.iter().for_each(note);
    }
}
