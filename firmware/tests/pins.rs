//! The table of pins in the documentation is the one that the code takes its pins from.

const CODE: &str = include_str!("../src/board/pins.rs");
const BOARD: &str = include_str!("../src/board/mod.rs");
const CRASH: &str = include_str!("../src/board/crash.rs");
const DOCUMENT: &str = include_str!("../../docs/hardware.md");

/// Name in the code, pin, connector, use.
type Row<'a> = (&'a str, [&'a str; 3]);

/// `name: PIN, "connector", "use";`
fn code() -> Vec<Row<'static>> {
    let (_, table) = CODE.split_once("pins! { $\n").expect("the table");
    let (table, _) = table.split_once("\n}").expect("its end");
    let row = |line: &'static str| {
        let (name, rest) = line.trim().split_once(": ")?;
        let (pin, rest) = rest.split_once(", \"")?;
        let (connector, rest) = rest.split_once("\", \"")?;
        Some((name, [pin, connector, rest.strip_suffix("\";")?]))
    };
    table.lines().map(|line| row(line).unwrap_or_else(|| panic!("{line} is no row"))).collect()
}

/// `| PIN | connector | use |`
fn document() -> Vec<[&'static str; 3]> {
    let (_, section) = DOCUMENT.split_once("\n## Pins\n").expect("the section");
    let (section, _) = section.split_once("\n## ").expect("the next one");
    let rows = section.lines().filter(|line| line.starts_with('|')).skip(2);
    rows.map(|line| {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        cells.try_into().unwrap_or_else(|_| panic!("{line} has not three cells"))
    })
    .collect()
}

#[test]
fn the_document_and_the_code_have_the_same_pins() {
    let code: Vec<_> = code().into_iter().map(|(_, row)| row).collect();
    assert!(code.len() > 20, "{} rows", code.len());
    assert_eq!(document(), code);
}

#[test]
fn every_pin_exists_and_is_used_once() {
    let mut pins: Vec<&str> = code().into_iter().map(|(_, [pin, ..])| pin).collect();
    for pin in &pins {
        let number: u8 = pin[2..].parse().expect("a number");
        assert!(pin.starts_with('P') && ('A'..='H').contains(&char::from(pin.as_bytes()[1])) && number < 16, "{pin}");
    }
    let all = pins.len();
    pins.sort_unstable();
    pins.dedup();
    assert_eq!(pins.len(), all);
}

#[test]
fn the_board_takes_its_pins_from_the_table_and_uses_them_all() {
    for (name, [pin, ..]) in code() {
        assert_eq!(BOARD.matches(&format!("pins.{name}")).count(), 1, "{name}");
        assert!(!BOARD.contains(&format!("p.{pin}")), "{pin} is taken past the table");
    }
}

#[test]
fn a_crash_switches_off_the_very_pin_that_enables_the_motors() {
    let (_, [pin, ..]) = code().into_iter().find(|(name, _)| *name == "motor_enable").expect("in the table");
    let (port, number) = (&pin[1..2], &pin[2..]);
    assert!(CRASH.contains(&format!("pac::GPIO{port}.bsrr().write(|w| w.set_br({number}, true))")), "{pin}");
}
