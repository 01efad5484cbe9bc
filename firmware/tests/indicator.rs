//! The lamps: every state looks different from every other, and as the table says.

use std::collections::BTreeMap;

use firmware::indicator::{Lamps, PATTERNS, lamps};
use firmware::safety::FAULT_CODES;
use protocol::message::SafetyState;

/// Longer than any pattern takes to repeat, ms.
const WINDOW: u32 = 16_000;

/// Lit lamps over time, in steps of 10 ms.
fn shown(state: SafetyState, homed: bool, simulated: bool) -> Vec<(bool, bool, bool)> {
    (0..WINDOW)
        .step_by(10)
        .map(|ms| lamps(state, homed, simulated, ms))
        .map(|Lamps { green, blue, red }| (green, blue, red))
        .collect()
}

/// Pieces of constant light: how often it went on, and for how long each time, ms, without those that the window cuts.
fn lit(light: &[bool]) -> Vec<usize> {
    light.split(|on| !on).map(<[bool]>::len).filter(|length| *length > 0).map(|length| 10 * length).collect()
}

#[test]
fn the_documentation_has_the_table_that_the_code_has() {
    let rows: Vec<String> = PATTERNS.iter().map(|(state, lamps)| format!("//! | {state} | {lamps} |")).collect();
    let documented: Vec<&str> =
        include_str!("../src/indicator.rs").lines().filter(|line| line.starts_with("//! |")).skip(2).collect();
    assert_eq!(documented, rows);
}

#[test]
fn no_two_states_look_alike() {
    let mut seen = BTreeMap::new();
    for simulated in [false, true] {
        let mut states = vec![
            ("not homed".to_string(), SafetyState::Disarmed, false),
            ("homed".to_string(), SafetyState::Disarmed, true),
            ("armed".to_string(), SafetyState::Armed, true),
        ];
        states.extend(FAULT_CODES.map(|code| (format!("{code:?}"), SafetyState::Fault(code), true)));
        for (name, state, homed) in states {
            let looks = seen.insert(shown(state, homed, simulated), (name.clone(), simulated));
            assert_eq!(looks, None, "{name} looks like another state");
        }
    }
}

#[test]
fn green_shows_what_the_table_says() {
    let green = |state, homed| -> Vec<bool> { shown(state, homed, false).iter().map(|lamps| lamps.0).collect() };
    assert_eq!(lit(&green(SafetyState::Disarmed, false)), [100; WINDOW as usize / 2000]);
    assert_eq!(lit(&green(SafetyState::Disarmed, true)), [500; WINDOW as usize / 1000]);
    assert!(green(SafetyState::Armed, true).iter().all(|on| *on));
    for state in [SafetyState::Disarmed, SafetyState::Armed] {
        assert!(shown(state, true, false).iter().all(|(_, blue, red)| !blue && !red));
    }
}

#[test]
fn blue_is_on_with_simulated_sensors_and_changes_nothing_else() {
    for state in [SafetyState::Disarmed, SafetyState::Armed, SafetyState::Fault(FAULT_CODES[3])] {
        for (own, simulated) in shown(state, true, false).into_iter().zip(shown(state, true, true)) {
            assert_eq!((own.0, true, own.2), simulated);
            assert!(!own.1);
        }
    }
}

#[test]
fn red_blinks_the_number_of_the_fault() {
    assert_eq!(PATTERNS.len(), 4 + FAULT_CODES.len());
    for (i, code) in FAULT_CODES.into_iter().enumerate() {
        let number = i + 1;
        let (row, pattern) = PATTERNS[4 + i];
        let name: String = row.trim_start_matches("Fault: ").split([' ', '-']).collect();
        // "not finite" is the one that the code calls otherwise.
        let name = name.replace("notfinite", "nonfinite");
        assert_eq!(name, format!("{code:?}").to_lowercase(), "row {i}");
        let plural = if number == 1 { "" } else { "s" };
        assert_eq!(pattern, format!("red: {number} blink{plural}, pause"));

        let lamps = shown(SafetyState::Fault(code), true, false);
        assert!(lamps.iter().all(|(green, ..)| !green));
        let red: Vec<bool> = lamps.iter().map(|(.., red)| *red).collect();
        assert!(lit(&red).iter().all(|ms| *ms == 200), "{code:?}");
        let dark: Vec<usize> = lit(&red.iter().map(|on| !on).collect::<Vec<_>>());
        let (blinks, _) = dark.split_at(number);
        assert!(blinks[..number - 1].iter().all(|ms| *ms == 300), "{code:?}: {dark:?}");
        assert_eq!(blinks[number - 1], 300 + 1500, "{code:?}: {dark:?}");
    }
}
