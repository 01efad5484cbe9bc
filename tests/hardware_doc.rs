//! What `docs/hardware.md` says of the body and of the lamps is what the code has.

use firmware::indicator::PATTERNS;
use firmware::robot::BATTERY_LOW;
use hil_sim::plant::{Body, Drive};

const DOCUMENT: &str = include_str!("../docs/hardware.md");

/// The rows of the table under a heading, without its head.
fn table(heading: &str, cells: usize) -> Vec<Vec<&'static str>> {
    let (_, section) = DOCUMENT.split_once(&format!("\n## {heading}\n")).expect("the section");
    let section = section.split("\n## ").next().unwrap_or_default();
    let rows = section.lines().filter(|line| line.starts_with('|')).skip(2);
    let rows = rows.map(|line| line.trim_matches('|').split('|').map(str::trim).collect::<Vec<_>>());
    rows.inspect(|row| assert_eq!(row.len(), cells, "{row:?}")).collect()
}

/// A figure in SI units.
fn value(cell: &str) -> f64 {
    let (number, unit) = cell.split_once(' ').expect("number and unit");
    let number: f64 = number.replace('−', "-").parse().unwrap_or_else(|_| panic!("{number} is no number"));
    match unit {
        "mm" => number / 1000.0,
        "" | "kg" | "m/s" | "N" | "V" | "N·s/m" | "N·m" | "N·m·s" | "counts/m" => number,
        _ => panic!("the unit {unit}"),
    }
}

#[test]
fn the_body_is_the_simulators_tabletop() {
    let body = Body::tabletop();
    let Drive::Motor(motor) = &body.drive else { panic!("the tabletop has motors") };
    let [x, y, z] = body.imu_position;
    let figures = [
        ("radius of tube and tyres", body.radius),
        ("length from rim to rim", body.length),
        ("mass without the weights", body.shell_mass),
        ("mass of each weight", body.weight_mass),
        ("farthest that the brain moves a weight", body.range),
        ("end blocks, from the middle", body.stop),
        ("distance of the two axes along the tube", body.axes_shift),
        ("inertial sensor, X", x),
        ("inertial sensor, Y", y),
        ("inertial sensor, Z", z),
        ("encoder", body.counts_per_metre),
        ("motor voltage", motor.nominal_voltage),
        ("force at standstill", motor.stall_force),
        ("speed without load", motor.no_load_speed),
        ("rotor and gear, seen at the weight", motor.rotor_mass),
        ("friction of a slide", motor.coulomb),
        ("friction of a slide, viscous", motor.viscous),
        ("rolling resistance", body.rolling_resistance),
        ("friction of rolling, viscous", body.friction),
        ("friction coefficient of the tyres", body.mu),
    ];
    let rows = table("Body", 2);
    let names: Vec<&str> = rows.iter().map(|row| row[0]).collect();
    assert_eq!(names, figures.map(|(name, _)| name));
    for (row, (name, figure)) in rows.iter().zip(figures) {
        let cell = if row[1].contains(' ') { row[1].to_owned() } else { format!("{} ", row[1]) };
        assert!((value(&cell) - figure).abs() < 1e-9, "{name}: {} in the document, {figure} in the simulator", row[1]);
    }
}

#[test]
fn the_parts_weigh_what_the_body_does() {
    let kilograms = |cell: &str| cell.trim_matches('*').strip_suffix(" kg").map(|n| n.parse::<f64>().expect("a mass"));
    let rows = table("Parts", 3);
    let all = rows.iter().position(|row| row[0].contains("all of it")).expect("a sum");
    let sum: f64 = rows[..all].iter().filter_map(|row| kilograms(row[2])).sum();
    let body = Body::tabletop();
    assert!((sum - body.shell_mass).abs() < 0.005, "the parts are {sum:.2} kg");
    assert_eq!(kilograms(rows[all][2]), Some(body.shell_mass));
    assert_eq!(kilograms(rows[all + 1][2]), Some(body.weight_mass), "{}", rows[all + 1][0]);
}

#[test]
fn the_lamps_are_those_of_the_indicator() {
    let rows: Vec<(&str, &str)> = table("Lamps", 2).iter().map(|row| (row[0], row[1])).collect();
    assert_eq!(rows, PATTERNS);
}

#[test]
fn the_low_battery_is_the_robots() {
    assert!(DOCUMENT.contains(&format!("Below {} V (3 V a cell)", BATTERY_LOW / 1000)), "{BATTERY_LOW} mV");
    assert_eq!(BATTERY_LOW % 1000, 0);
}
