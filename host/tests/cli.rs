//! The command line as a person meets it: what goes right, and what every kind of bad input is told.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

fn barrel(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_barrel"))
        .args(args)
        .current_dir(folder)
        .env("HOME", folder)
        .env_remove("XDG_STATE_HOME")
        .stdin(Stdio::null())
        .output()
        .expect("barrel starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs `barrel` in an empty folder; it must refuse with exit code 2, say every one of `words`, and write nothing.
fn refused(args: &[&str], words: &[&str]) {
    let folder = TempDir::new().expect("a folder");
    refused_in(folder.path(), args, words);
}

fn refused_in(folder: &Path, args: &[&str], words: &[&str]) {
    let files = || -> Vec<_> {
        let paths = fs::read_dir(folder).expect("readable").map(|e| e.expect("entry").path());
        paths.map(|path| (fs::read(&path).ok(), path)).collect()
    };
    let before = files();
    let output = barrel(folder, args);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
    for word in words {
        assert!(said.contains(word), "{args:?} should say '{word}': {said}");
    }
    assert_eq!(files(), before, "{args:?} left something behind");
}

fn run_in(folder: &Path, args: &[&str]) -> String {
    let output = barrel(folder, args);
    assert!(output.status.success(), "{args:?}: {}{}", text(&output.stdout), text(&output.stderr));
    text(&output.stdout)
}

#[test]
fn an_unknown_experiment_is_told_the_nearest() {
    refused(&["run", "homeokinetc"], &["homeokinetc", "homeokinetic"]);
}

#[test]
fn an_unknown_parameter_is_told_the_nearest() {
    refused(&["run", "homeokinetic", "--set", "epsc=0.2"], &["epsc", "epsC"]);
    refused(&["run", "homeokinetic", "--set", "C13=0.2"], &["C13"]);
    refused(&["run", "homeokinetic", "--set", "epsC"], &["NAME=VALUE"]);
}

#[test]
fn a_value_that_is_missing_or_no_number_is_refused() {
    refused(&["run", "homeokinetic", "--set", "C11="], &["C11", "number"]);
    refused(&["run", "homeokinetic", "--set", "C11=one"], &["one", "not a number"]);
    refused(&["run", "homeokinetic", "--set", "C11=NaN"], &["C11", "finite"]);
    refused(&["run", "homeokinetic", "--set", "C11=inf"], &["C11", "finite"]);
    refused(&["run", "homeokinetic", "--set", "C11=-infinity"], &["C11", "finite"]);
}

#[test]
fn a_value_out_of_range_is_told_the_range_and_the_nearest() {
    refused(&["run", "homeokinetic", "--set", "rule=4"], &["rule", "0 to 3", "nearest is 3"]);
    refused(&["run", "homeokinetic", "--set", "rule=1.4"], &["rule", "whole", "nearest is 1"]);
    refused(&["run", "homeokinetic", "--set", "friction=-1"], &["friction", "nearest is 0"]);
}

#[test]
fn parameters_that_make_no_barrel_are_refused() {
    refused(&["run", "homeokinetic", "--set", "range=0.6"], &["range"]);
    refused(&["run", "homeokinetic", "--set", "weightMass=60"], &["weightMass"]);
}

#[test]
fn a_duration_that_is_no_duration_is_refused() {
    for duration in ["0", "-5", "nan", "inf", "soon", "0.001"] {
        refused(&["run", "homeokinetic", "--duration", duration], &["--duration"]);
    }
}

#[test]
fn a_push_that_is_no_push_is_refused() {
    for push in ["10", "1:2", "1:2:3:4", "a:b:c", "-1:10:1", "1:nan:1", "1:10:0"] {
        refused(&["run", "homeokinetic", "--push", push], &["push"]);
    }
}

#[test]
fn a_link_that_is_not_there_is_refused() {
    refused(&["run", "homeokinetic", "--link", "serial:no-such-port"], &["no serial port", "no-such-port"]);
    refused(&["run", "homeokinetic", "--link", "pigeon"], &["link", "in-process"]);
}

#[cfg(not(feature = "virtual-board"))]
#[test]
fn a_build_without_the_virtual_board_says_how_to_get_it() {
    for command in ["run", "console"] {
        let args = [command, "homeokinetic", "--link", "virtual-board", "--body", "tabletop"];
        refused(&args, &["cargo virtual run"]);
    }
}

#[cfg(feature = "virtual-board")]
#[test]
fn a_virtual_board_wants_an_image() {
    let args = ["run", "homeokinetic", "--link", "virtual-board", "--firmware"];
    refused(&[&args[..], &["no-such.elf"]].concat(), &["no-such.elf"]);
    // Something that is there for certain, and no image.
    refused(&[&args[..], &[env!("CARGO_BIN_EXE_barrel")]].concat(), &["no flash image", "cargo xtask firmware"]);
}

#[test]
fn a_place_that_cannot_be_written_is_refused() {
    refused(&["run", "homeokinetic", "--csv", "no/such/folder/run.csv"], &["no/such/folder/run.csv"]);
    refused(&["run", "homeokinetic", "--log", "no/such/folder/run.mcap"], &["no/such/folder/run.mcap"]);
    // The CSV could be written, the log cannot: neither is left behind.
    refused(&["run", "homeokinetic", "--csv", "run.csv", "--log", "no/run.mcap"], &["no/run.mcap"]);
    refused(&["run", "homeokinetic", "--plot", "run.gif"], &["run.gif", ".png"]);
    let folder = TempDir::new().expect("a folder");
    // What was there before stays as it was.
    fs::write(folder.path().join("old.csv"), "precious").expect("written");
    refused_in(folder.path(), &["run", "homeokinetic", "--csv", "old.csv", "--log", "no/run.mcap"], &["no/run.mcap"]);
    refused_in(folder.path(), &["run", "homeokinetic", "--csv", "old.csv", "--plot", "x.gif"], &["x.gif"]);
    refused_in(folder.path(), &["run", "homeokinetic", "--csv", "old.csv", "--log", "old.csv"], &["twice"]);
    fs::write(folder.path().join("runs"), "not a folder").expect("written");
    refused_in(folder.path(), &["run", "homeokinetic"], &["runs"]);
}

#[test]
fn a_run_in_which_the_robot_goes_into_fault_fails_when_all_of_it_is_recorded() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let run = ["run", "homeokinetic", "--body", "tabletop", "--set", "omega0=-100", "--duration", "2"];
    let output = barrel(f, &[&run[..], &["--csv", "run.csv", "--log", "run.mcap"]].concat());
    let (said, complaint) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(1), "{said}{complaint}");
    assert!(said.contains("  Fault at 0.") && said.contains("It rolled at"), "{said}");
    assert!(complaint.contains("barrel: Fault at 0.") && complaint.contains("run.csv, run.mcap"), "{complaint}");
    assert_eq!(fs::read_to_string(f.join("run.csv")).expect("readable").lines().count(), 101);
    let reader = barrel::log::Reader::open(&f.join("run.mcap")).expect("a log");
    let states = reader.filter(|entry| match entry.as_ref().expect("an undamaged log") {
        barrel::log::Entry::Event(event) => event.kind == "state" && event.text.starts_with("Fault: "),
        _ => false,
    });
    assert_eq!(states.count(), 1);
}

#[test]
fn a_recording_that_is_none_is_refused() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    run_in(f, &["run", "homeokinetic", "--duration", "4", "--csv", "good.csv", "--log", "good.mcap"]);
    let csv = fs::read_to_string(f.join("good.csv")).expect("readable");
    fs::write(f.join("empty.csv"), "").expect("written");
    fs::write(f.join("header.csv"), "t,x1,y1\n0,1,1\n").expect("written");
    fs::write(f.join("torn.csv"), &csv[..csv.len() - 40]).expect("written");
    fs::write(f.join("nan.csv"), "x1,x2\n0.1,0.2\nNaN,0.3\n").expect("written");
    fs::write(f.join("empty.mcap"), "").expect("written");
    fs::write(f.join("text.mcap"), "this is not an MCAP file, whatever its name says").expect("written");
    let log = fs::read(f.join("good.mcap")).expect("readable");
    let mut damaged = log.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 0xff;
    fs::write(f.join("damaged.mcap"), damaged).expect("written");
    for (file, words) in [
        ("missing.csv", &["missing.csv"][..]),
        ("empty.csv", &["empty"]),
        ("header.csv", &["x2"]),
        ("torn.csv", &["torn.csv", "201"]),
        ("nan.csv", &["line 3", "x1"]),
        ("missing.mcap", &["missing.mcap"]),
        ("empty.mcap", &["empty"]),
        ("text.mcap", &["not an MCAP"]),
        ("damaged.mcap", &["damaged"]),
    ] {
        refused_in(f, &["replay", file], words);
        // Without x2 it is no recording to replay, but there is something to draw.
        if file != "header.csv" {
            refused_in(f, &["plot", file, "--out", "picture.png"], &[]);
        }
    }
    refused_in(f, &["plot", "good.csv", "--columns", "C11,omga"], &["omga", "omega"]);
    refused_in(f, &["export", "text.mcap", "--csv", "out.csv"], &["not an MCAP"]);
    refused_in(f, &["replay", "good.csv", "--csv", "no/such/folder.csv"], &["no/such/folder.csv"]);
    refused_in(f, &["replay", "god.csv"], &["good.csv"]);
    refused_in(f, &["replay", "good.csv", "--set", "radius=2"], &["radius"]);
    refused_in(f, &["replay", "good.mcap", "--seed", "2"], &["--seed"]);
}

#[test]
fn a_log_cut_off_in_the_middle_is_replayed_up_to_its_last_whole_chunk() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    run_in(f, &["run", "homeokinetic", "--duration", "20", "--log", "run.mcap"]);
    let log = fs::read(f.join("run.mcap")).expect("readable");
    fs::write(f.join("cut.mcap"), &log[..log.len() / 2]).expect("written");
    let said = run_in(f, &["replay", "cut.mcap"]);
    assert!(said.contains("bit for bit"), "{said}");
    let steps: u32 = said.split_whitespace().next().and_then(|n| n.parse().ok()).expect("a number of steps");
    assert!((300..600).contains(&steps), "{steps} of 1000 steps in half the file");
}

#[test]
fn a_run_writes_what_replay_and_export_reproduce() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    for (experiment, body) in [("homeokinetic", "chapter"), ("open-loop", "chapter"), ("homeokinetic", "tabletop")] {
        let args = ["run", experiment, "--body", body, "--duration", "5", "--seed", "9", "--set", "noise=0.1"];
        run_in(f, &[&args[..], &["--csv", "run.csv", "--log", "run.mcap", "--plot", "run.svg"]].concat());
        let said = run_in(f, &["replay", "run.mcap", "--csv", "replayed.csv"]);
        assert!(said.contains("bit for bit"), "{said}");
        run_in(f, &["export", "run.mcap", "--csv", "exported.csv"]);
        let (run, exported, replayed) = (
            fs::read_to_string(f.join("run.csv")).expect("readable"),
            fs::read_to_string(f.join("exported.csv")).expect("readable"),
            fs::read_to_string(f.join("replayed.csv")).expect("readable"),
        );
        assert_eq!(run, exported, "{experiment} on {body}");
        assert_eq!(run.lines().count(), 251, "a header and 50 rows a second");
        for (was, is) in run.lines().zip(replayed.lines()) {
            assert!(was.starts_with(is), "{experiment} on {body}: recorded {was}, replayed {is}");
        }
    }
}

#[cfg(unix)]
#[test]
fn a_link_is_followed_and_a_pipe_is_written_into() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    run_in(f, &["run", "homeokinetic", "--duration", "1", "--csv", "run.csv"]);
    fs::write(f.join("real.csv"), "old").expect("written");
    std::os::unix::fs::symlink("real.csv", f.join("link.csv")).expect("linked");
    run_in(f, &["replay", "run.csv", "--csv", "link.csv"]);
    assert!(f.join("link.csv").is_symlink(), "the link is still one");
    assert_eq!(fs::read_to_string(f.join("real.csv")).expect("readable").lines().count(), 51);
    let pipe = f.join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    for command in [&["replay", "run.csv"][..], &["run", "homeokinetic", "--duration", "1"]] {
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read_to_string(pipe).expect("readable").lines().count()
        });
        run_in(f, &[command, &["--csv", "pipe"]].concat());
        assert_eq!(reader.join().expect("read"), 51);
    }
    assert!(!pipe.is_file(), "a pipe stays a pipe");
}

#[test]
fn two_runs_with_one_seed_are_the_same_bytes() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    for n in ["1", "2"] {
        let files = ["--csv", &format!("{n}.csv"), "--log", &format!("{n}.mcap"), "--plot", &format!("{n}.png")]
            .map(String::from);
        let files: Vec<&str> = files.iter().map(String::as_str).collect();
        run_in(f, &[&["run", "homeokinetic", "--duration", "5"], &files[..]].concat());
    }
    for ending in ["csv", "mcap", "png"] {
        let read = |n: &str| fs::read(f.join(format!("{n}.{ending}"))).expect("readable");
        assert!(read("1") == read("2"), "{ending} differs");
    }
}

#[test]
fn a_run_without_places_makes_a_dated_folder_with_log_csv_and_picture() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let said = run_in(f, &["run", "homeostatic", "--duration", "2"]);
    let runs: Vec<_> = fs::read_dir(f.join("runs")).expect("made").map(|e| e.expect("entry").path()).collect();
    assert_eq!(runs.len(), 1);
    for file in ["run.csv", "run.mcap", "run.png"] {
        assert!(runs[0].join(file).is_file(), "{file}");
        assert!(said.contains(file), "{said}");
    }
}

#[test]
fn every_list_lists() {
    let folder = TempDir::new().expect("a folder");
    for (list, word) in
        [("experiments", "upright"), ("parameters", "epsC"), ("columns", "E_tle"), ("bodies", "tabletop")]
    {
        assert!(run_in(folder.path(), &["list", list]).contains(word));
    }
}

#[test]
fn a_reader_who_leaves_early_is_no_error() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_barrel"))
        .args(["list", "parameters"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("barrel starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("ends");
    assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
}

/// The console, with a script instead of a person.
#[test]
fn the_console_sets_shows_stores_and_loads_while_the_run_goes_on() {
    use std::io::Write;
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let mut child = Command::new(env!("CARGO_BIN_EXE_barrel"))
        .args(["console", "homeokinetic", "--speed", "1000", "--duration", "20", "--log", "talk.mcap"])
        .current_dir(f)
        .env("HOME", f)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("barrel starts");
    let script = "pause\nepsA = 0.07\nstore set.txt\nepsA = 0.2\nepsA\nload set.txt\nepsA\nepsa = 1\nepsA = 99\n\
                  C11 = 0.5\ncoupling1\nfriction = 0.3\nfriction\nradius = 1\nstop\narm\nclear\narm\npush 10 0.5\ngo\n";
    child.stdin.take().expect("piped").write_all(script.as_bytes()).expect("taken");
    let output = child.wait_with_output().expect("ends");
    let said = text(&output.stdout);
    assert!(output.status.success(), "{said}");
    let mut rest = said.as_str();
    for words in [
        "paused",
        "epsA = 0.07",
        "stored",
        "epsA = 0.2",
        "epsA = 0.2",
        "loaded",
        "epsA = 0.07",
        "epsA",
        "0 to 10",
        "C11 = 0.5",
        "coupling1",
        "friction = 0.3",
        "friction = 0.3",
        "start",
        "Fault",
        "clear",
        "Disarmed",
        "Armed",
        "pushing",
        "going on",
    ] {
        let at = rest.find(words).unwrap_or_else(|| panic!("'{words}' is not said in its turn: {said}"));
        rest = &rest[at + words.len()..];
    }
    let replayed = run_in(f, &["replay", "talk.mcap"]);
    assert!(replayed.contains("bit for bit"), "what was set while it ran is replayed: {replayed}");
}

#[test]
fn a_measure_is_printed_and_no_folder_made() {
    let folder = TempDir::new().expect("a folder");
    let line = ["run", "closed-loop", "-q", "--duration", "3", "--measure", "rate:phi:1", "--measure", "motion:0:1"];
    let said = run_in(folder.path(), &line);
    assert!(said.starts_with("rate:phi:1 = ") && said.contains(" rad/s\nmotion:0:1 = "), "{said}");
    assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 0);
}

#[test]
fn what_is_no_measure_is_told_what_is_one() {
    refused(&["run", "--measure", "average:omega"], &["average", "mean"]);
    refused(&["run", "--measure", "mean:speeed"], &["speeed", "omega"]);
    refused(&["run", "--measure", "mean:omega:9:3"], &["9:3", "FROM"]);
    refused(&["chain", "--measure", "waves"], &["waves", "persistence"]);
}

#[test]
fn an_action_is_carried_out_in_its_time_and_is_in_the_recording() {
    let folder = TempDir::new().expect("a folder");
    let line = ["run", "closed-loop", "-q", "--duration", "2", "--at", "1:C11=0.25", "--at", "1/0.5:randomH=2"];
    run_in(folder.path(), &[&line[..], &["--csv", "run.csv", "--log", "run.mcap"]].concat());
    let csv = fs::read_to_string(folder.path().join("run.csv")).expect("a CSV");
    let column = |name: &str| {
        let index = csv.lines().next().and_then(|head| head.split(',').position(|n| n == name)).expect("the column");
        csv.lines().skip(1).map(|row| row.split(',').nth(index).unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    let c11 = column("C11");
    assert!(c11[49] != "0.25" && c11[50] == "0.25", "{:?}", &c11[48..52]);
    let h1 = column("h1");
    assert!(h1[49] == "0" && h1[50] != "0" && h1[50] == h1[74] && h1[74] != h1[75], "{:?}", &h1[48..76]);
    // What was set at random is in the log, too: it replays bit for bit.
    run_in(folder.path(), &["replay", "run.mcap"]);
}

#[test]
fn what_cannot_be_done_at_a_time_is_refused() {
    refused(&["run", "--at", "60"], &["TIME:ACTION"]);
    refused(&["run", "--at", "60:epsc=1"], &["epsC"]);
    refused(&["run", "--at", "60:scatter=x"], &["scatter", "number"]);
    refused(&["run", "--at", "0/0.001:randomC=5"], &["0.02 s"]);
    refused(&["run", "--at", "60:phi0=1"], &["phi0", "start"]);
    refused(&["run", "--at", "60:epsC=99"], &["epsC", "nearest is 10"]);
}

#[test]
fn a_chain_runs_and_refuses_what_it_does_not_have() {
    let folder = TempDir::new().expect("a folder");
    let said =
        run_in(folder.path(), &["chain", "end-angles", "--duration", "3", "--hold", "1:1:2", "--csv", "chain.csv"]);
    assert!(said.contains("speed = "), "{said}");
    let csv = fs::read_to_string(folder.path().join("chain.csv")).expect("a CSV");
    assert!(
        csv.starts_with("t,angle1,angle2,angle3,rate1,") && csv.lines().count() == 151,
        "{} lines",
        csv.lines().count()
    );
    refused(&["chain", "end-angle"], &["end-angles"]);
    refused(&["chain", "--set", "friction=0.2"], &["friction"]);
    refused(&["chain", "angles", "--hold", "1:1:3"], &["pendulum 3", "has 2"]);
    refused(&["chain", "--hold", "1:1"], &["START:SECONDS:PENDULUM"]);
}

#[test]
fn what_is_wrong_with_a_playground_is_said_without_a_window() {
    refused(&["play", "homeokinetik"], &["did you mean 'homeokinetic'?"]);
    refused(&["play", "--set", "epsC=99"], &["epsC", "0 to 10"]);
    refused(&["play", "--open", "no.mcap"], &["no.mcap"]);
}

#[test]
fn without_the_playground_beside_it_barrel_says_how_to_get_it() {
    let folder = TempDir::new().expect("a folder");
    let alone = folder.path().join("barrel");
    fs::copy(env!("CARGO_BIN_EXE_barrel"), &alone).expect("copied");
    let output = Command::new(alone).arg("play").output().expect("it starts");
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("`cargo play`"), "{}", text(&output.stderr));
}
