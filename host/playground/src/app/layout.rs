//! How the window is laid out: what is remembered from one to the next.

use crate::film::Kind;
use crate::order::Start;
use crate::plots::Plots;
use crate::scene::View;
use hil_sim::setup::Setup;
use protocol::Values;
use serde::{Deserialize, Serialize};

/// What is remembered.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Layout {
    /// The camera.
    pub view: View,
    /// The plots and their channels.
    pub plots: Plots,
    /// Whether they are shown.
    pub plots_shown: bool,
    /// Whether the console is shown.
    pub console: bool,
    /// What is shown on the left.
    pub left: Left,
    /// What a film is written as.
    pub film: Kind,
}

/// What is shown on the left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Left {
    /// The chapter's experiments.
    #[default]
    Guide,
    /// The parameters.
    Knobs,
}

impl Left {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Left::Guide => "Experiments",
            Left::Knobs => "Parameters",
        }
    }
}

impl Default for Layout {
    fn default() -> Self {
        Layout {
            view: View::default(),
            plots: Plots::default(),
            plots_shown: true,
            console: false,
            left: Left::Guide,
            film: Kind::default(),
        }
    }
}

impl Layout {
    /// The layout that was left, if there is one that can be read.
    pub fn load(storage: &dyn eframe::Storage) -> Option<Layout> {
        eframe::get_value(storage, eframe::APP_KEY)
    }

    /// Keeps the layout.
    pub fn store(&self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, eframe::APP_KEY, self);
    }
}

/// The experiment's own parameters on its body.
pub(super) fn preset(start: &Start) -> Values<f64> {
    Setup::new(start.experiment, start.body).values
}

/// The setup of a session that holds these values.
pub(super) fn setup(start: &Start, values: &Values<f64>) -> Setup {
    Setup { values: values.clone(), ..Setup::new(start.experiment, start.body) }
}
