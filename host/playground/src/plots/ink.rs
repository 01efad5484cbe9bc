//! Colours of the curves.

use crate::channel::Id;
use eframe::egui::{Color32, Visuals};

/// A colour, for light and for dark backgrounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ink {
    light: Color32,
    dark: Color32,
}

impl Ink {
    pub(super) fn on(self, visuals: &Visuals) -> Color32 {
        if visuals.dark_mode { self.dark } else { self.light }
    }
}

const fn ink(light: [u8; 3], dark: [u8; 3]) -> Ink {
    Ink { light: Color32::from_rgb(light[0], light[1], light[2]), dark: Color32::from_rgb(dark[0], dark[1], dark[2]) }
}

/// Okabe and Ito's colours, which colour-blind eyes tell apart, darkened and lightened until they stand out by 3:1.
const PALETTE: [Ink; 8] = [
    ink([200, 70, 0], [255, 128, 72]),    // vermillion
    ink([0, 130, 95], [44, 200, 150]),    // bluish green
    ink([0, 105, 175], [92, 165, 255]),   // blue
    ink([175, 115, 0], [240, 185, 50]),   // orange
    ink([170, 75, 135], [235, 150, 205]), // reddish purple
    ink([70, 70, 70], [215, 215, 215]),   // grey
    ink([40, 140, 195], [150, 218, 255]), // sky blue
    ink([120, 115, 0], [240, 228, 90]),   // yellow
];
const AXIS_1: usize = 0;
const AXIS_2: usize = 1;

/// What belongs to axis 1 is red and what belongs to axis 2 green, as in the chapter; of a matrix its first row is
/// warm and its second cool.
fn preferred(channel: Id) -> usize {
    if channel == Id::Etle {
        // As in the pictures of the command line.
        return 3;
    }
    let name = channel.channel().name;
    if name.ends_with("11") {
        AXIS_1
    } else if name.ends_with("22") {
        AXIS_2
    } else if name.ends_with("12") {
        3
    } else if name.ends_with("21") {
        2
    } else if name.ends_with('1') || name.ends_with('X') || name.ends_with('x') {
        AXIS_1
    } else if name.ends_with('2') || name.ends_with('Y') || name.ends_with('y') {
        AXIS_2
    } else {
        2
    }
}

/// A colour for each channel of a plot, and whether its curve is dashed, since there are more channels than colours.
pub(super) fn inks(channels: &[Id]) -> Vec<(Ink, bool)> {
    let mut used = [0; PALETTE.len()];
    let mut take = |index: usize| {
        used[index] += 1;
        (PALETTE[index], used[index] % 2 == 0)
    };
    let mut inks = vec![None; channels.len()];
    // Whoever has its own colour keeps it, wherever in the list it stands.
    let mut owners: Vec<usize> = Vec::new();
    for (ink, &channel) in inks.iter_mut().zip(channels) {
        let index = preferred(channel);
        if !owners.contains(&index) {
            owners.push(index);
            *ink = Some(take(index));
        }
    }
    // The axes' colours come last: what is of no axis shall not look as if it were.
    let order = (2..PALETTE.len()).chain([AXIS_1, AXIS_2]);
    let mut next = order.clone().filter(|index| !owners.contains(index)).chain(order.clone().cycle());
    inks.into_iter().map(|ink| ink.unwrap_or_else(|| take(next.next().unwrap_or_default()))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::Rgba;

    #[test]
    fn the_two_axes_have_their_colours_in_every_plot() {
        for pair in [[Id::X1, Id::X2], [Id::Y1, Id::Y2], [Id::S1, Id::S2], [Id::C11, Id::C22], [Id::Duty1, Id::Duty2]] {
            assert_eq!(inks(&pair), [(PALETTE[AXIS_1], false), (PALETTE[AXIS_2], false)]);
        }
    }

    #[test]
    fn no_two_curves_of_a_plot_look_the_same() {
        let inks = inks(&Id::ALL[..2 * PALETTE.len()]);
        for (index, ink) in inks.iter().enumerate() {
            assert!(!inks[..index].contains(ink), "{index}");
        }
    }

    #[test]
    fn colours_stand_out_from_the_background_of_their_theme() {
        let light = |colour: Color32| {
            let [r, g, b, _] = Rgba::from(colour).to_array();
            0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05
        };
        for ink in PALETTE {
            for visuals in [Visuals::light(), Visuals::dark()] {
                let (a, b) = (light(ink.on(&visuals)), light(visuals.extreme_bg_color));
                assert!(a.max(b) / a.min(b) >= 3.0, "{ink:?}: {}", a.max(b) / a.min(b));
            }
        }
    }
}
