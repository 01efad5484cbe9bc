//! Colours: Okabe and Ito's for lines and markers, viridis for numbers.

use plotters::style::{Color as _, RGBAColor, RGBColor};

use super::Ink;
use crate::plot::canvas::Color;
use crate::plot::{BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION};

pub const WHITE: Color = Color(255, 255, 255);
pub const TEXT: Color = Color(40, 40, 40);
/// Labels of axes, and what is said where there is nothing.
pub const LABEL: Color = Color(70, 70, 70);
pub const FRAME: Color = Color(130, 130, 130);
/// Marks across a panel.
pub const MARK: Color = Color(60, 60, 60);
pub const GREY: Color = Color(130, 130, 130);
/// A cell without a value.
pub const MISSING: Color = Color(200, 200, 200);

/// Viridis at 0, 0.1, … 1 (van der Walt & Smith 2015): equal steps look equal, to colour-blind eyes as well.
const VIRIDIS: [Color; 11] = [
    Color(68, 1, 84),
    Color(72, 37, 118),
    Color(65, 68, 135),
    Color(53, 95, 141),
    Color(42, 120, 142),
    Color(33, 145, 140),
    Color(34, 168, 132),
    Color(66, 190, 113),
    Color(122, 209, 81),
    Color(187, 223, 39),
    Color(253, 231, 37),
];

/// The colour of an ink.
pub fn of(ink: Ink) -> Color {
    match ink {
        Ink::Blue => BLUE,
        Ink::Vermillion => VERMILLION,
        Ink::Green => GREEN,
        Ink::Orange => ORANGE,
        Ink::Purple => PURPLE,
        Ink::Sky => SKY,
        Ink::Black => BLACK,
        Ink::Grey => GREY,
    }
}

/// A colour through which so much of what is below is not seen.
pub fn cover(Color(red, green, blue): Color, opacity: f64) -> RGBAColor {
    RGBColor(red, green, blue).mix(opacity)
}

/// Where `share` of the way from the low end to the high one lies on the map; beyond the ends, as at them; NaN is grey.
pub fn map(share: f64) -> Color {
    if share.is_nan() {
        return MISSING;
    }
    let place = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let below = (place as usize).min(VIRIDIS.len() - 2);
    let (Color(r0, g0, b0), Color(r1, g1, b1)) = (VIRIDIS[below], VIRIDIS[below + 1]);
    let between = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * (place - below as f64)).round() as u8;
    Color(between(r0, r1), between(g0, g1), between(b0, b1))
}

/// Black or white, whichever is easier to read on this colour (relative luminance and contrast as in WCAG 2.1).
pub fn on(Color(red, green, blue): Color) -> Color {
    let linear = |channel: u8| {
        let share = f64::from(channel) / 255.0;
        if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
    };
    let luminance = 0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue);
    // At this luminance, L, both contrasts are the same: (L + 0.05) / 0.05 = 1.05 / (L + 0.05).
    if luminance > 0.179 { Color(0, 0, 0) } else { WHITE }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_ends_where_viridis_ends_and_goes_no_further() {
        assert_eq!([map(0.0), map(-3.0), map(f64::NEG_INFINITY)], [VIRIDIS[0]; 3]);
        assert_eq!([map(1.0), map(7.0), map(f64::INFINITY)], [VIRIDIS[10]; 3]);
        assert_eq!(map(0.5), VIRIDIS[5]);
        assert_eq!(map(f64::NAN), MISSING);
    }

    #[test]
    fn text_is_white_on_dark_and_black_on_light() {
        assert_eq!(on(map(0.0)), WHITE);
        assert_eq!([on(map(1.0)), on(MISSING)], [Color(0, 0, 0); 2]);
    }
}
