//! How much room a text takes, and how it is made to fit. The reader's font is not known here: widths are those of a
//! wide one, DejaVu Sans, so that others leave some room.

/// Width of a line of text, in the unit of its size.
pub fn width(text: &str, size: f64) -> f64 {
    size * text.chars().map(advance).sum::<f64>()
}

fn advance(character: char) -> f64 {
    match character {
        'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' | ' ' => 0.33,
        'f' | 'r' | 't' | '(' | ')' | '[' | ']' | '-' | '/' | '⁰'..='⁹' | '²' | '³' | '¹' | '⁻' => 0.42,
        'm' | 'w' | 'M' | 'W' | '%' | '@' | '+' | '=' | '<' | '>' => 0.95,
        'A'..='Z' => 0.72,
        _ => 0.64,
    }
}

/// The text in lines that are no wider than `room`, broken at spaces, and within a word only if it is too wide itself.
pub fn wrap(text: &str, size: f64, room: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        if let Some(line) = lines.last_mut()
            && width(line, size) + width(" ", size) + width(word, size) <= room
        {
            line.push(' ');
            line.push_str(word);
            continue;
        }
        let mut line = String::new();
        for character in word.chars() {
            if !line.is_empty() && width(&line, size) + size * advance(character) > room {
                lines.push(std::mem::take(&mut line));
            }
            line.push(character);
        }
        lines.push(line);
    }
    lines
}

/// The text, or its beginning and an ellipsis, no wider than `room`.
pub fn shorten(text: &str, size: f64, room: f64) -> String {
    if width(text, size) <= room {
        return text.into();
    }
    let room = room - width("…", size);
    let mut line = String::new();
    for character in text.chars() {
        if width(&line, size) + size * advance(character) > room {
            break;
        }
        line.push(character);
    }
    line + "…"
}

/// A number of three digits, without zeros at its end; with an exponent where it would be long.
pub fn number(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-4..1e6).contains(&magnitude) {
        return format!("{value:.1e}");
    }
    let digits = if magnitude == 0.0 { 0.0 } else { magnitude.log10().floor() };
    let text = format!("{value:.*}", (2.0 - digits).max(0.0) as usize);
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapped_lines_fit_and_lose_nothing() {
        let text = "angular rate about the long axis, averaged (rad/s) averylongwordthatfitsnowhere";
        let lines = wrap(text, 14.0, 120.0);
        assert!(lines.iter().all(|line| width(line, 14.0) <= 120.0), "{lines:?}");
        let letters = |text: &str| text.replace(' ', "");
        assert_eq!(letters(&lines.concat()), letters(text));
    }

    #[test]
    fn a_shortened_text_fits() {
        assert_eq!(shorten("short", 13.0, 100.0), "short");
        let text = shorten("a legend that somebody wrote too long", 13.0, 100.0);
        assert!(text.ends_with('…') && width(&text, 13.0) <= 100.0, "{text}");
    }

    #[test]
    fn numbers_are_short_and_zero_has_no_sign() {
        let said = [0.0, -0.0, 1.0, -0.25, 12.345, 98_765.0, 3.2e-7, -4e9].map(number);
        assert_eq!(said, ["0", "0", "1", "-0.25", "12.3", "98765", "3.2e-7", "-4.0e9"]);
    }
}
