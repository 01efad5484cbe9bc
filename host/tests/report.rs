//! The report as somebody meets it who does not believe it: run twice, interrupted, and its lines typed again.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

fn barrel(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_barrel"))
        .args(args)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .expect("barrel starts")
}

fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// A few claims of every kind of line.
const SOME: [&str; 6] =
    ["report", "--quick", "--quiet", "--only", "tabula-rasa,doubling,scatter,controller,held,chain-wave", "--out"];

fn report(folder: &Path, out: &str) -> (Vec<u8>, Vec<u8>) {
    let output = barrel(folder, &[&SOME[..], &[out]].concat());
    assert!(output.status.success(), "{}", said(&output));
    let read = |name: &str| fs::read(folder.join(out).join(name)).expect("it was written");
    (read("report.html"), read("report.json"))
}

#[test]
fn every_line_of_the_report_prints_its_numbers_when_it_is_typed_again() {
    let folder = TempDir::new().expect("a folder");
    let (_, json) = report(folder.path(), "out");
    let json: serde_json::Value = serde_json::from_slice(&json).expect("it is JSON");
    let mut compared = 0;
    for claim in json["claims"].as_array().expect("claims") {
        // The first run of each claim and the last.
        let runs = claim["runs"].as_array().expect("runs");
        for run in [runs.first(), runs.last()].into_iter().flatten() {
            let line = run["line"].as_str().expect("a line");
            let args: Vec<&str> = line.split_whitespace().skip(1).collect();
            let again = barrel(folder.path(), &args);
            assert!(again.status.success(), "{line}: {}", said(&again));
            let printed = String::from_utf8_lossy(&again.stdout).into_owned();
            for (name, value) in run["measures"].as_object().expect("measures") {
                let start = format!("{name} = ");
                let told = printed.lines().find_map(|line| line.strip_prefix(&start)).expect("it is printed");
                let told = told.split_whitespace().next().unwrap_or_default();
                match value.as_f64() {
                    Some(number) => assert_eq!(told.parse(), Ok(number), "{line}: {name}"),
                    None => assert_eq!(told, "never", "{line}: {name}"),
                }
                compared += 1;
            }
        }
    }
    assert!(compared > 30, "{compared} numbers");
    assert!(!folder.path().join("runs").exists(), "a line of measures makes no run folder");
}

#[test]
fn a_second_report_has_the_same_bytes_and_needs_nothing_beside_it() {
    let folder = TempDir::new().expect("a folder");
    let (html, json) = report(folder.path(), "first");
    assert!((html.clone(), json) == report(folder.path(), "second"), "two runs of the report differ");
    let html = String::from_utf8(html).expect("it is text");
    assert!(html.contains("<svg"), "it has pictures");
    for outside in ["src=", "<link", "<script", "@import", "url("] {
        assert!(!html.contains(outside), "'{outside}' is not to be read offline");
    }
    assert!(!folder.path().join("first/report.journal").exists(), "the journal stayed");
}

#[test]
fn an_interrupted_report_says_how_to_go_on_and_goes_on() {
    use std::time::{Duration, Instant};
    let folder = TempDir::new().expect("a folder");
    let args = ["report", "--quiet", "--jobs", "1", "--only", "sweep", "--out", "out"];
    let child = Command::new(env!("CARGO_BIN_EXE_barrel"))
        .args(args)
        .current_dir(folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("barrel starts");
    let journal = folder.path().join("out/report.journal");
    let done = || fs::read_to_string(&journal).map_or(0, |text| text.lines().count());
    let patience = Instant::now() + Duration::from_secs(120);
    while done() < 5 && Instant::now() < patience {
        std::thread::sleep(Duration::from_millis(2));
    }
    let pid = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(pid, rustix::process::Signal::INT).expect("it runs");
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
    assert!(said(&output).contains("the same line goes on"), "{}", said(&output));
    let kept = done();
    assert!(kept >= 5, "{kept} lines are kept");
    assert!(!folder.path().join("out/report.html").exists(), "nothing half written");
    let output = barrel(folder.path(), &args);
    assert!(output.status.success(), "{}", said(&output));
    assert!(folder.path().join("out/report.html").exists() && !journal.exists());
}

#[test]
fn an_unknown_claim_is_told_the_nearest_and_nothing_is_written() {
    let folder = TempDir::new().expect("a folder");
    let output = barrel(folder.path(), &["report", "--only", "sweeep"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("did you mean 'sweep'"), "{}", said(&output));
    assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 0);
}
