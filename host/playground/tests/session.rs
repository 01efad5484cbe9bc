//! Sessions behind the window: their speed, their ends and what they leave.

mod bench;

use bench::{asked, folder, frames, open, until};
use eframe::egui::Key;
use egui_kittest::kittest::Queryable;
use hil_sim::experiment::EXPERIMENTS;
use hil_sim::setup::BodyKind;
use playground::history::History;
use playground::order::{Order, Start};
use playground::recording::{Recording, read};
use playground::session::{Desk, LinkState, Session};
use std::path::PathBuf;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(60);

fn begin(args: &[&str]) -> Session {
    folder();
    Session::begin(&asked(args), || {})
}

fn start(experiment: &str, body: BodyKind) -> Order {
    let experiment = EXPERIMENTS.iter().find(|other| other.name == experiment).expect("it is in the chapter");
    Order::Start(Start { experiment, body, seed: 3, sets: Vec::new() })
}

/// Looks at a session until something is so; what there was at the last look.
fn wait(session: &Session, what: &str, mut is_so: impl FnMut(&Desk) -> bool) -> Desk {
    let begun = Instant::now();
    loop {
        let desk = session.look();
        if is_so(&desk) {
            return desk;
        }
        assert!(begun.elapsed() < LIMIT, "{what}: not within {LIMIT:?}; {:?}", desk.status);
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn log(desk: &Desk) -> PathBuf {
    folder().join(desk.status.log.clone().expect("every session is recorded"))
}

fn whole(log: &std::path::Path) -> Recording {
    let recording = read(log).unwrap_or_else(|why| panic!("{why}"));
    assert_eq!(recording.problem, None);
    recording
}

#[test]
fn as_fast_as_it_goes_is_faster_than_real_time_and_no_step_is_missing() {
    let session = begin(&["homeokinetic"]);
    session.order(Order::Line("speed max".to_owned()));
    let mut history = History::new(2000);
    let begun = Instant::now();
    let mut steps = 0;
    wait(&session, "two minutes", |desk| {
        for frame in &desk.frames {
            assert!((frame.t - f64::from(steps) * 0.02).abs() < 1e-6, "step {steps} at {} s", frame.t);
            steps += 1;
        }
        history.extend(&desk.frames);
        steps > 6000
    });
    assert!(begun.elapsed() < Duration::from_secs(120), "that was no faster than real time");
    assert!((2000..2000 + 4097).contains(&history.len()), "{} rows are remembered", history.len());
    assert_eq!(history.span().map(|(_, end)| (end * 50.0).round() as i32), Some(steps - 1));
}

#[test]
fn from_one_experiment_to_the_next_each_log_is_whole_and_time_begins_anew() {
    let session = begin(&["homeokinetic"]);
    session.order(Order::Line("speed 20".to_owned()));
    let mut logs = vec![log(&wait(&session, "ten seconds", |desk| {
        desk.status.log.is_some() && desk.frames.last().is_some_and(|frame| frame.t > 10.0)
    }))];
    for (count, (experiment, body)) in (2..).zip([
        ("open-loop", BodyKind::Chapter),
        ("closed-loop", BodyKind::Tabletop),
        ("upright", BodyKind::Chapter),
    ]) {
        session.order(start(experiment, body));
        let mut latest: Option<f64> = None;
        let desk = wait(&session, "the next session", |desk| {
            if desk.status.session < count {
                return false;
            }
            for frame in &desk.frames {
                let is_next = latest.map_or(frame.t == 0.0, |latest| frame.t > latest);
                assert!(is_next, "{experiment}: {} s after {latest:?}", frame.t);
                latest = Some(frame.t);
            }
            latest.is_some_and(|t| t > 1.0)
        });
        assert_eq!(desk.status.start.as_ref().map(|start| start.experiment.name), Some(experiment));
        assert_eq!(desk.status.speed, 20.0, "the speed stays as it was set");
        logs.push(log(&desk));
        let before = whole(&logs[logs.len() - 2]);
        assert!(before.history.len() > 40);
    }
    drop(session);
    for (log, body) in logs.iter().zip([BodyKind::Chapter, BodyKind::Chapter, BodyKind::Tabletop, BodyKind::Chapter]) {
        let recording = whole(log);
        assert_eq!(recording.body, body);
        let (begin, end) = recording.history.span().expect("it has steps");
        assert_eq!(begin, 0.0);
        assert_eq!(
            recording.history.len(),
            (end * 50.0).round() as usize + 1,
            "a step is missing in {}",
            log.display()
        );
    }
}

#[test]
fn a_session_that_said_quit_says_that_it_is_over_and_begins_again_when_asked() {
    let mut window = open(&["homeokinetic"]);
    until(&mut window, "control steps", |window| window.state().history().len() > 10);
    window.state().order(Order::Line("quit".to_owned()));
    until(&mut window, "it is over", |window| matches!(window.state().status().link, LinkState::Over(_)));
    frames(&mut window, 3);
    let again = window.query_all_by_label("Start again").next();
    again.expect("it is offered").click();
    until(&mut window, "it is live again", |window| window.state().status().session == 2);
    until(&mut window, "steps", |window| window.state().history().len() > 5);
}

#[test]
fn a_setup_that_makes_no_barrel_is_said_and_the_next_one_is_taken() {
    let session = begin(&["homeokinetic", "--link", "serial:./nothing-here", "--simulate"]);
    let desk = wait(&session, "it is over", |desk| matches!(desk.status.link, LinkState::Over(_)));
    assert!(!session.is_robot());
    assert!(desk.status.link.sentence().contains("nothing-here"), "{}", desk.status.link.sentence());
    session.order(Order::Line("pause".to_owned()));
    wait(&session, "it is answered", |desk| format!("{:?}", desk.said).contains("nothing is running"));
}

#[test]
fn a_session_ends_soon_whatever_it_is_at() {
    type Doing = (&'static [&'static str], &'static [&'static str]);
    let doing: [Doing; 5] = [
        (&["homeokinetic"], &[]),
        (&["homeokinetic"], &["pause"]),
        (&["homeokinetic", "--body", "tabletop"], &["speed max"]),
        (&["homeokinetic"], &["speed 0.02"]),
        (&["homeokinetic"], &["quit"]),
    ];
    for (args, lines) in doing {
        let mut session = begin(args);
        let desk =
            wait(&session, "it is live", |desk| desk.status.link == LinkState::Live && desk.status.log.is_some());
        for line in lines {
            session.order(Order::Line((*line).to_owned()));
        }
        wait(&session, "it is said", |desk| lines.is_empty() || !desk.said.is_empty());
        let asked = Instant::now();
        session.end();
        let took = asked.elapsed();
        assert!(took < Duration::from_secs(5), "{args:?} {lines:?}: {took:?}");
        // A run that was ended before its first step has nothing in its log.
        if let Err(why) = read(&log(&desk)) {
            assert!(why.contains("holds no /brain message"), "{why}");
        }
    }
    for port in ["serial:./nothing-here", "serial:/dev/null"] {
        let mut session = begin(&["--link", port]);
        wait(&session, "it is looked for", |desk| desk.status.start.is_some());
        let asked = Instant::now();
        session.end();
        assert!(asked.elapsed() < Duration::from_secs(5), "{port}: {:?}", asked.elapsed());
    }
}

#[test]
fn the_window_remembers_what_it_was_shown_when_time_was_paused_and_went_on() {
    let mut window = open(&["closed-loop"]);
    until(&mut window, "control steps", |window| window.state().history().len() > 20);
    for _ in 0..3 {
        window.key_press(Key::Space);
        frames(&mut window, 5);
    }
    window.state().order(Order::Line("go".to_owned()));
    let rows = window.state().history().len();
    until(&mut window, "it goes on", |window| window.state().history().len() > rows + 20);
    let history = window.state().history();
    let times: Vec<f64> = (0..history.len()).filter_map(|row| Some(history.frame(row)?.t)).collect();
    assert!(times.windows(2).all(|two| (two[1] - two[0] - 0.02).abs() < 1e-6), "a step is missing");
}
