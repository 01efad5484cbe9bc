//! What the pictures promise: one for any table that has something to draw, and clear words otherwise.
//!
//! With the environment variable `BARREL_PICTURES` naming a folder, the pictures are kept there to be looked at.

use std::path::{Path, PathBuf};

use barrel::csv::{BRAIN_COLUMNS, PLANT_COLUMNS, Table};
use barrel::plot::{self, PlotError, Title};

/// A made-up run: rolling that speeds up and turns, with a spike, a growing C and falling errors.
fn made_up(rows: usize, plant: bool) -> Table {
    let mut table = Table::new("a made-up run");
    let column = |f: &dyn Fn(f64) -> f64| (0..rows).map(|k| f(k as f64 / 50.0)).collect::<Vec<f64>>();
    let noise = |t: f64, i: f64| ((t * 12345.678 + i * 77.7).sin() * 43758.547).fract();
    table.insert("t", column(&|t| t));
    for (i, name) in BRAIN_COLUMNS.iter().map(|column| column.name).enumerate().skip(1) {
        let i = i as f64;
        let numbers = match name {
            "x1" | "x2" | "y1" | "y2" => column(&|t| (t * t * 0.03 + i * 1.57).sin() * 0.9 + 0.05 * noise(t, i)),
            "C11" | "C22" => column(&|t| 1.0 + 0.4 * (t * 0.1).tanh() + 0.02 * noise(t, i)),
            "C12" | "C21" => column(&|t| (i - 6.5) * 0.6 * (t * 0.05).sin() + 0.02 * noise(t, i)),
            "E" => column(&|t| 1e-3 * (-t * 0.1).exp() * (1.0 + noise(t, i)).max(0.0)),
            "E_tle" => column(&|t| 0.1 * (-t * 0.05).exp() * (1.1 + noise(t, i))),
            _ => column(&|t| (t * 0.2 + i).sin() * 0.3),
        };
        table.insert(name, numbers);
    }
    if plant {
        for column_of in &PLANT_COLUMNS {
            let numbers = match column_of.name {
                "omega" => column(&|t| t * 0.06 + 0.1 * noise(t, 3.0)),
                "px" => column(&|t| t * (t * 0.05).cos() * 0.3),
                "py" => column(&|t| t * (t * 0.05).sin() * 0.3),
                _ => column(&|_| 0.5),
            };
            table.insert(column_of.name, numbers);
        }
    }
    table
}

fn title() -> Title {
    Title {
        heading: "homeokinetic: the barrel finds its rolling modes (3.1)".into(),
        details: "chapter body, seed 7, 60 s, epsA = 0.1".into(),
    }
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    fn at(&self, name: &str) -> PathBuf {
        std::env::var_os("BARREL_PICTURES").map_or(self.0.path().into(), PathBuf::from).join(name)
    }
}

/// Width and height of a PNG, from its first chunk.
fn png_size(path: &Path) -> (u32, u32) {
    let bytes = std::fs::read(path).unwrap();
    assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"), "{} is not a PNG", path.display());
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

#[test]
fn a_whole_run_is_one_picture_with_all_panels() {
    let folder = Folder::new();
    let path = folder.at("run.png");
    plot::run(&made_up(3000, true), &title(), &path).unwrap();
    let (width, height) = png_size(&path);
    assert_eq!(width, 1600);
    assert!((1700..2000).contains(&height), "{height}");

    let path = folder.at("run.svg");
    plot::run(&made_up(3000, true), &title(), &path).unwrap();
    let svg = std::fs::read_to_string(&path).unwrap();
    for text in
        ["controller C", "self-model A", "E time loop", "omega (rad/s)", "px (m)", "start", "time (s)", "seed 7"]
    {
        assert!(svg.contains(text), "{text} is not in the picture");
    }
}

#[test]
fn a_long_run_is_drawn_without_losing_its_peaks_and_without_a_huge_file() {
    let folder = Folder::new();
    let mut table = made_up(180_000, true);
    let mut spike = table.get("h1").unwrap().to_vec();
    spike[90_000] = 4.5;
    table.insert("h1", spike);
    plot::run(&table, &title(), &folder.at("hour.png")).unwrap();
    plot::run(&table, &title(), &folder.at("hour.svg")).unwrap();
    let size = std::fs::metadata(folder.at("hour.svg")).unwrap().len();
    assert!(size < 4_000_000, "an hour is {size} bytes of SVG");
}

#[test]
fn odd_tables_are_drawn_too() {
    let folder = Folder::new();
    plot::run(&made_up(1, true), &title(), &folder.at("one-row.png")).unwrap();
    plot::run(&made_up(500, false), &title(), &folder.at("no-plant.png")).unwrap();

    let mut sensors = Table::new("sensors");
    sensors.insert("x1", vec![0.5; 100]);
    sensors.insert("x2", vec![f64::NAN; 100]);
    plot::run(&sensors, &title(), &folder.at("constant.png")).unwrap();

    let mut extreme = made_up(200, true);
    for (name, number) in [("C11", 1e30), ("A11", 1e-30), ("h1", 1e308), ("omega", -1e-300)] {
        extreme.insert(name, (0..200).map(|k| number * f64::from(k % 7)).collect());
    }
    extreme.insert("E", vec![0.0; 200]);
    extreme.insert("E_tle", vec![0.0; 200]);
    plot::run(&extreme, &title(), &folder.at("extreme.png")).unwrap();
}

#[test]
fn chosen_columns_share_a_panel_by_unit() {
    let folder = Folder::new();
    let names = |names: &str| names.split(',').map(String::from).collect::<Vec<String>>();
    let table = made_up(3000, true);
    plot::columns(&table, &names("C11,C12,C21,C22"), &title(), &folder.at("columns.png")).unwrap();
    let one = png_size(&folder.at("columns.png")).1;
    plot::columns(&table, &names("x1,omega,E,px,py"), &title(), &folder.at("units.png")).unwrap();
    assert!(png_size(&folder.at("units.png")).1 > one);

    let error = plot::columns(&table, &names("C11,c12"), &title(), &folder.at("none.png")).unwrap_err().to_string();
    assert!(error.contains("no column 'c12': did you mean 'C12'?"), "{error}");
    assert!(!folder.at("none.png").exists());
}

#[test]
fn what_cannot_be_drawn_is_said_and_leaves_nothing_behind() {
    let folder = Folder::new();
    let table = made_up(10, true);
    let error = plot::run(&table, &title(), &folder.at("run.gif")).unwrap_err().to_string();
    assert!(error.contains("run.gif") && error.contains(".png or .svg"), "{error}");
    assert!(matches!(plot::check_target(Path::new("picture")), Err(PlotError::Ending { .. })));

    let error = plot::check_target(Path::new("/no/such/run.png")).unwrap_err().to_string();
    assert!(error.contains("/no/such/run.png") && error.contains("choose a folder"), "{error}");
    plot::check_target(&folder.at("fine.SVG")).unwrap();

    let mut foreign = Table::new("shopping.csv");
    assert!(matches!(plot::run(&foreign, &title(), &folder.at("a.png")), Err(PlotError::Nothing { .. })));
    foreign.insert("apples", vec![1.0]);
    let error = plot::run(&foreign, &title(), &folder.at("a.png")).unwrap_err().to_string();
    assert!(error.contains("shopping.csv") && error.contains("none of a run's columns"), "{error}");
    assert!(std::fs::read_dir(folder.0.path()).unwrap().next().is_none(), "something was left behind");
}
