//! Plots that belong together, by one click.

use super::panel::Panel;
use super::scale::Scale;
use crate::channel::Id;

/// A name in the menu, and the plots that it adds.
pub(super) struct Preset {
    pub(super) name: &'static str,
    plots: &'static [(Scale, &'static [Id])],
}

impl Preset {
    pub(super) fn panels(&self) -> impl Iterator<Item = Panel> + use<'_> {
        self.plots.iter().map(|&(scale, channels)| Panel::new(channels, scale))
    }
}

use Scale::{Auto, Log};

const X: &[Id] = &[Id::X1, Id::X2];
const Y: &[Id] = &[Id::Y1, Id::Y2];
const C: &[Id] = &[Id::C11, Id::C12, Id::C21, Id::C22];
const A: &[Id] = &[Id::A11, Id::A12, Id::A21, Id::A22];
const ERRORS: &[Id] = &[Id::Etle, Id::E];

/// What a new window shows.
pub(super) const DEFAULT: Preset =
    Preset { name: "Default plots", plots: &[(Auto, X), (Auto, Y), (Auto, C), (Log, ERRORS), (Auto, &[Id::Omega])] };

/// The menu.
pub(super) const ALL: [Preset; 8] = [
    Preset { name: "x and y", plots: &[(Auto, X), (Auto, Y)] },
    Preset { name: "C and h", plots: &[(Auto, C), (Auto, &[Id::H1, Id::H2])] },
    Preset { name: "A and b", plots: &[(Auto, A), (Auto, &[Id::B1, Id::B2])] },
    Preset { name: "Errors", plots: &[(Log, ERRORS), (Auto, &[Id::Xi1, Id::Xi2])] },
    Preset { name: "Motion", plots: &[(Auto, &[Id::Omega]), (Auto, &[Id::Tilt]), (Auto, &[Id::Px, Id::Py])] },
    Preset {
        name: "Servo",
        plots: &[
            (Auto, &[Id::S1, Id::S2, Id::Target1, Id::Target2]),
            (Auto, &[Id::Rate1, Id::Rate2]),
            (Auto, &[Id::Duty1, Id::Duty2]),
        ],
    },
    Preset {
        name: "IMU",
        plots: &[(Auto, &[Id::Acc1, Id::Acc2, Id::AccC]), (Auto, &[Id::Gyro1, Id::Gyro2, Id::GyroC])],
    },
    Preset { name: "Load", plots: &[(Auto, &[Id::Torque]), (Auto, &[Id::ForceX, Id::ForceY, Id::ForceZ])] },
];
