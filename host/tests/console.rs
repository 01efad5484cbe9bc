//! What the console promises: lines that are nearly right get an answer that helps, and sets are all or nothing.

use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::time::Duration;

use barrel::console::{
    Action, COMMANDS, Command, Console, ConsoleError, Input, Target, Topic, complete, execute, parameter_set, parse,
};
use proptest::prelude::*;
use protocol::Id;
use protocol::message::{BodyAxis, CalibrationStep};
use protocol::parameter::TABLE;

/// Holds parameters as a single-precision robot does; refuses what it was told to refuse.
#[derive(Default)]
struct Robot {
    values: HashMap<Id, f64>,
    refuses: Option<Id>,
    actions: Vec<Action>,
}

impl Target for Robot {
    fn get(&mut self, id: Id) -> Result<f64, String> {
        Ok(self.values.get(&id).copied().unwrap_or(id.parameter().default))
    }

    fn set(&mut self, id: Id, value: f64) -> Result<f64, String> {
        if self.refuses == Some(id) {
            return Err("the robot refuses".into());
        }
        let held = f64::from(value as f32);
        self.values.insert(id, held);
        Ok(held)
    }

    fn act(&mut self, action: Action) -> Result<String, String> {
        self.actions.push(action);
        Ok(format!("{action:?}"))
    }
}

fn complaint(line: &str) -> String {
    parse(line).unwrap_err().to_string()
}

fn say(robot: &mut Robot, line: &str) -> String {
    execute(&parse(line).unwrap(), robot).unwrap()
}

#[test]
fn lines_are_understood() {
    for (line, command) in [
        ("", Command::Nothing),
        ("  # only a comment", Command::Nothing),
        ("epsA", Command::Show(Id::EpsA)),
        ("epsA=0.2", Command::Set(Id::EpsA, 0.2)),
        ("  C11  =  -1e-1 # turn", Command::Set(Id::C11, -0.1)),
        ("help", Command::Help(Topic::All)),
        ("?", Command::Help(Topic::All)),
        ("help KP", Command::Help(Topic::Parameter(Id::Kp))),
        ("list eps", Command::List("eps".into())),
        ("store my set.txt", Command::Store(PathBuf::from("my set.txt"))),
        ("load \"my set.txt\"", Command::Load(PathBuf::from("my set.txt"))),
        ("load a=b.txt", Command::Load(PathBuf::from("a=b.txt"))),
        ("push -5 0.5", Command::Act(Action::Push { torque: -5.0, seconds: 0.5 })),
        ("shove 30 0.02", Command::Act(Action::Shove { force: 30.0, seconds: 0.02 })),
        ("scatter 0.2", Command::Act(Action::Scatter(0.2))),
        ("random C", Command::Act(Action::RandomC(5.0))),
        ("random C 2", Command::Act(Action::RandomC(2.0))),
        ("random h", Command::Act(Action::RandomH(3.0))),
        ("speed max", Command::Act(Action::Speed(f64::INFINITY))),
        ("arm", Command::Act(Action::Arm)),
        ("disarm", Command::Act(Action::Disarm)),
        ("stop", Command::Act(Action::Stop)),
        ("clear", Command::Act(Action::Clear)),
        ("home", Command::Act(Action::Home)),
        ("calibrate still", Command::Act(Action::Calibrate(CalibrationStep::Still))),
        ("calibrate  up  -C", Command::Act(Action::Calibrate(CalibrationStep::Up(BodyAxis::CylinderNegative)))),
        ("calibrate up +2", Command::Act(Action::Calibrate(CalibrationStep::Up(BodyAxis::Slider2)))),
        ("calibrate status", Command::Act(Action::Calibrate(CalibrationStep::Status))),
        ("calibrate restart", Command::Act(Action::Calibrate(CalibrationStep::Restart))),
        ("save", Command::Act(Action::Save)),
        ("forget", Command::Act(Action::Forget)),
        ("status", Command::Act(Action::Status)),
        ("pause", Command::Act(Action::Pause)),
        ("go", Command::Act(Action::Go)),
        ("step", Command::Act(Action::Step(1))),
        ("step 50", Command::Act(Action::Step(50))),
        ("speed 2.5", Command::Act(Action::Speed(2.5))),
        ("quit", Command::Act(Action::Quit)),
        ("exit", Command::Act(Action::Quit)),
    ] {
        assert_eq!(parse(line), Ok(command), "{line:?}");
    }
}

#[test]
fn lines_that_are_nearly_right_get_an_answer_that_helps() {
    for (line, says) in [
        ("epsa", "unknown command or parameter 'epsa': did you mean 'epsA'?"),
        ("epsa = 1", "unknown parameter 'epsa': did you mean 'epsA'?"),
        ("hlep", "did you mean 'help'?"),
        ("help epsx", "did you mean 'epsA'?"),
        ("list foo", "unknown parameter 'foo': did you mean"),
        ("epsA 0.2", "to set epsA, put = before the value"),
        ("epsA =", "epsA = what? Write a number, as in epsA = 0.1"),
        ("epsA = much", "'much' is not a number; write for example epsA = 0.1"),
        ("epsA = 11", "epsA = 11 is out of range 0 to 10; the nearest is 10"),
        ("epsA = NaN", "epsA = NaN is not a finite number"),
        ("epsA = inf", "epsA = inf is not a finite number"),
        ("rule = 1.5", "rule = 1.5 must be a whole number from 0 to 3"),
        ("= 3", "unknown parameter ''"),
        ("shove 30", "shove: a force in N and a time in s are needed; write shove FORCE SECONDS"),
        ("scatter", "scatter: one number is needed"),
        ("scatter -1", "-1 is not from 0 to 100"),
        ("random", "random: C or h?; write random C | h [WITHIN]"),
        ("random C 5 6", "random: one number at most"),
        ("store", "store: a file is missing; write store FILE"),
        ("push 5", "write push TORQUE SECONDS"),
        ("push 5 0", "it must last longer than 0 s"),
        ("push 5 NaN", "'NaN' is not a number; write for example push 5 0.5"),
        ("step 0", "N is a whole number from 1"),
        ("speed 0", "it must be more than 0; pause stops the time"),
        ("speed fast", "'fast' is not a number"),
        ("calibrate", "calibrate: one of four things can be done; write calibrate still"),
        ("calibrate up", "which axis points up?"),
        ("calibrate up 3", "AXIS is +1 or -1"),
        ("save my.txt", "save: nothing comes behind it"),
        ("arm now", "arm: nothing comes behind it; write arm"),
    ] {
        assert!(complaint(line).contains(says), "{line:?}: {}", complaint(line));
    }
}

#[test]
fn no_word_is_a_command_and_a_parameter() {
    for command in COMMANDS {
        assert_eq!(Id::from_name(command.name), None);
        assert!(matches!(parse(&format!("help {}", command.name)), Ok(Command::Help(Topic::Command(_)))));
    }
}

proptest! {
    #[test]
    fn no_line_makes_the_parser_panic(line in ".*", word in 0..TABLE.len(), rest in ".*") {
        let _ = parse(&line);
        let _ = complete(&line);
        let line = format!("{} {rest}", TABLE[word].name);
        let _ = parse(&line);
        let _ = complete(&line);
    }
}

#[test]
fn values_are_shown_as_they_are_held() {
    let mut robot = Robot::default();
    assert_eq!(say(&mut robot, "epsA"), "epsA = 0.1 1/step");
    assert_eq!(say(&mut robot, "epsA = 0.25"), "epsA = 0.25 1/step");
    assert_eq!(say(&mut robot, "C12 = 0.1"), "C12 = 0.10000000149011612  (rounded)");
    assert!(say(&mut robot, "help epsC").contains("0 to 10 1/step, default 0.1"));
    assert!(say(&mut robot, "help").lines().count() > COMMANDS.len());
    assert_eq!(say(&mut robot, "list eps").lines().count(), 2);
    assert_eq!(say(&mut robot, "list").lines().count(), TABLE.len());
    assert_eq!(say(&mut robot, "step 3"), "Step(3)");
    assert_eq!(robot.actions, [Action::Step(3)]);
}

#[test]
fn a_stored_set_brings_every_parameter_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.txt");
    let mut robot = Robot::default();
    for line in ["C11 = 1.25", "C21 = -0.5", "phi0 = 0.1", "ridge = 1e-6", "maxForce = 123.5"] {
        say(&mut robot, line);
    }
    let said = say(&mut robot, &format!("store {}", path.display()));
    assert!(said.starts_with(&format!("{} parameters stored", TABLE.len() - 2)), "all but the couplings: {said}");
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("C11 = 1.25 ") && text.contains("# [1/step] learning rate"), "{text}");

    let mut fresh = Robot::default();
    say(&mut fresh, &format!("load {}", path.display()));
    for &id in Id::ALL.iter().filter(|id| id.coupled().is_none()) {
        let (stored, loaded) = (robot.get(id).unwrap(), fresh.get(id).unwrap());
        assert_eq!(stored as f32, loaded as f32, "{}", id.name());
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "a draft was left behind");
}

#[test]
fn a_bad_set_is_named_by_line_and_changes_nothing() {
    let path = Path::new("my.txt");
    for (text, says) in [
        (
            "epsA = 0.2\nepsx = 1\n",
            "my.txt, line 2: unknown parameter 'epsx': did you mean 'epsA'?; nothing was changed",
        ),
        ("epsA = 0.2\n\nC11 =\n", "line 3: C11 = what?"),
        ("epsA = 99", "line 1: epsA = 99 is out of range 0 to 10; the nearest is 10"),
        ("epsA = 0.2\nepsA = 0.3\n", "line 2: epsA was set before, in line 1"),
        ("just some text\n", "line 1: unknown parameter 'just some text'"),
        ("# nothing\n", "it sets no parameter"),
        ("", "it sets no parameter"),
    ] {
        let error = parameter_set::parse(path, text).unwrap_err().to_string();
        assert!(error.contains(says), "{text:?}: {error}");
    }

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("set.txt");
    std::fs::write(&path, "epsA = 0.5\nepsC = 0.5\nKP = 100\n").unwrap();
    let mut robot = Robot { refuses: Some(Id::Kp), ..Robot::default() };
    let error = execute(&Command::Load(path.clone()), &mut robot).unwrap_err().to_string();
    assert_eq!(error, "KP: the robot refuses; nothing was changed");
    assert_eq!(robot.get(Id::EpsA), Ok(f64::from(0.1_f32)), "set back");

    let error = execute(&Command::Load(folder.path().join("sett.txt")), &mut robot).unwrap_err().to_string();
    assert!(error.contains("did you mean 'set.txt'?"), "{error}");
    let error = execute(&Command::Store(PathBuf::from("/no/such/set.txt")), &mut robot).unwrap_err();
    assert!(matches!(&error, ConsoleError::File { .. }) && error.to_string().contains("/no/such/set.txt"), "{error}");
}

#[test]
fn tab_completes_commands_names_and_leaves_files_to_the_editor() {
    assert_eq!(complete("eps"), Some((0, vec!["epsA", "epsC"])));
    assert_eq!(complete("EPSA"), Some((0, vec!["epsA"])));
    assert_eq!(complete("he"), Some((0, vec!["help"])));
    assert_eq!(complete("help pu"), Some((5, vec!["push"])));
    assert_eq!(complete("list sensorN"), Some((5, vec!["sensorNoise", "sensorNoiseTau"])));
    assert_eq!(complete("epsA = "), Some((7, vec![])));
    assert_eq!(complete("calibrate s"), Some((10, vec!["still", "status"])));
    assert_eq!(complete("calibrate up +"), Some((13, vec!["+1", "+c", "+2"])));
    assert_eq!(complete("load ru"), None);
    assert_eq!(complete("").unwrap().1.len(), COMMANDS.len() + TABLE.len());
}

const CHILD: &str = "BARREL_TEST_CONSOLE_CHILD";

/// Not a test of its own: the program at the other end of the pipe of [`a_pipe_works_like_a_keyboard`].
#[test]
fn the_child_obeys_standard_input() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let mut robot = Robot::default();
    let mut console = Console::start(None);
    loop {
        match console.wait(Duration::from_secs(30)).expect("the pipe is silent") {
            Input::Line(Ok(command)) => {
                let text = execute(&command, &mut robot).unwrap_or_else(|error| error.to_string());
                console.print(&text);
                if command == Command::Act(Action::Quit) {
                    break;
                }
            }
            Input::Line(Err(error)) => console.print(&error.to_string()),
            Input::End => {
                console.print("the end");
                break;
            }
        }
    }
    assert_eq!(console.poll(), None, "nothing comes after the end");
}

#[test]
fn a_pipe_works_like_a_keyboard() {
    for (typed, expected) in [
        ("epsA = 0.25\nepsa\nquit\nepsA = 1\n", &["epsA = 0.25 1/step", "did you mean 'epsA'?", "Quit"][..]),
        ("# comment\r\n§h1\r\nh1", &["unknown command or parameter", "h1 = 0", "the end"]),
        ("", &["the end"]),
    ] {
        let mut child = Process::new(std::env::current_exe().unwrap())
            .args(["--exact", "the_child_obeys_standard_input", "--nocapture"])
            .env(CHILD, "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        child.stdin.take().unwrap().write_all(typed.as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{said}");
        let mut rest = said.as_str();
        for line in expected {
            let at = rest.find(line).unwrap_or_else(|| panic!("{typed:?}: '{line}' is missing in {said}"));
            rest = &rest[at + line.len()..];
        }
        assert!(!said.contains("epsA = 1 "), "a line after quit was read: {said}");
    }
}
