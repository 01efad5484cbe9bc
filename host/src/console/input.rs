//! Reads the lines, in a thread of its own: the run goes on while one is typed.

use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::thread;
use std::time::Duration;

use rustyline::error::ReadlineError;
use rustyline::history::FileHistory;
use rustyline::{CompletionType, Config, Editor, ExternalPrinter};

use super::complete::Assistant;
use super::{Action, Command, ConsoleError, parse};

const PROMPT: &str = "> ";

/// What came in.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// A line, understood or not.
    Line(Result<Command, ConsoleError>),
    /// There will be no more: end of the pipe, Ctrl-D or Ctrl-C.
    End,
}

/// The open console.
pub struct Console {
    lines: Receiver<Input>,
    printer: Option<Box<dyn ExternalPrinter + Send>>,
    ended: bool,
    is_person: bool,
    /// The terminal's settings before the line editor changed them.
    terminal: Option<String>,
}

impl Console {
    /// Starts to read standard input: with line editing if it is a terminal, else line by line. `history` is the file
    /// that keeps the lines from one console to the next; without one they are forgotten.
    pub fn start(history: Option<&Path>) -> Console {
        let (send, lines) = mpsc::channel();
        if !(io::stdin().is_terminal() && io::stdout().is_terminal()) {
            thread::spawn(move || read_plain(io::stdin().lock(), &send));
            return Console { lines, printer: None, ended: false, is_person: false, terminal: None };
        }
        let terminal = terminal_settings();
        let history = history.map(Path::to_path_buf);
        let (send_printer, printer) = mpsc::channel();
        thread::spawn(move || match editor(history.as_deref()) {
            Ok(mut editor) => {
                let printer = editor.create_external_printer();
                let _ = send_printer.send(printer.ok().map(|printer| Box::new(printer) as Box<_>));
                read_terminal(editor, history, &send);
            }
            // A terminal that cannot be edited on: better plain lines than none.
            Err(_) => {
                let _ = send_printer.send(None);
                read_plain(io::stdin().lock(), &send);
            }
        });
        Console { lines, printer: printer.recv().ok().flatten(), ended: false, is_person: true, terminal }
    }

    /// Whether the lines come from a person at a terminal; else they are a script's.
    pub fn is_person(&self) -> bool {
        self.is_person
    }

    /// The next line if there is one; does not wait. After [`Input::End`] there is none.
    pub fn poll(&mut self) -> Option<Input> {
        if self.ended {
            return None;
        }
        let input = match self.lines.try_recv() {
            Ok(input) => input,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Input::End,
        };
        self.note(input)
    }

    /// The next line, waiting for it for so long: what a paused run does.
    pub fn wait(&mut self, patience: Duration) -> Option<Input> {
        if self.ended {
            return None;
        }
        let input = match self.lines.recv_timeout(patience) {
            Ok(input) => input,
            Err(RecvTimeoutError::Timeout) => return None,
            Err(RecvTimeoutError::Disconnected) => Input::End,
        };
        self.note(input)
    }

    fn note(&mut self, input: Input) -> Option<Input> {
        // The reading thread stops after these two, and the terminal is as it was.
        self.ended = matches!(input, Input::End | Input::Line(Ok(Command::Act(Action::Quit))));
        Some(input)
    }

    /// Prints lines above the one that is being typed. Nothing is printed for an empty text.
    pub fn print(&mut self, text: &str) {
        if text.is_empty() {
            return;
        }
        let printed = self.printer.as_mut().is_some_and(|printer| printer.print(format!("{text}\n")).is_ok());
        if !printed {
            // Where nobody listens, as in a closed pipe, there is nobody to tell.
            let mut out = io::stdout().lock();
            let _ = writeln!(out, "{text}").and_then(|()| out.flush());
        }
    }
}

impl Drop for Console {
    /// The run has ended by itself while the line editor waits for a key: gives the terminal back as it was.
    fn drop(&mut self) {
        if let Some(settings) = self.terminal.take().filter(|_| !self.ended) {
            let _ = Process::new("stty").arg(settings).stdin(Stdio::inherit()).status();
            // The line editor had also asked for marks around what is pasted.
            println!("\x1b[?2004l");
        }
    }
}

/// The terminal's settings, as `stty` wants them back.
fn terminal_settings() -> Option<String> {
    let output = Process::new("stty").arg("-g").stdin(Stdio::inherit()).stderr(Stdio::null()).output().ok()?;
    let settings = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| settings.trim().to_string())
}

fn editor(history: Option<&Path>) -> rustyline::Result<Editor<Assistant, FileHistory>> {
    let config = Config::builder().completion_type(CompletionType::List).max_history_size(1000)?.build();
    let mut editor = Editor::with_config(config)?;
    editor.set_helper(Some(Assistant::new()));
    if let Some(path) = history {
        // The first console has none yet.
        let _ = editor.load_history(path);
    }
    Ok(editor)
}

fn read_terminal(mut editor: Editor<Assistant, FileHistory>, mut history: Option<PathBuf>, send: &Sender<Input>) {
    loop {
        match editor.readline(PROMPT) {
            Ok(line) => {
                let _ = editor.add_history_entry(line.as_str());
                if let Some(path) = &history
                    && let Err(error) = editor.append_history(path)
                {
                    eprintln!("the history cannot be kept in {}: {error}", path.display());
                    history = None;
                }
                let command = parse(&line);
                let quit = command == Ok(Command::Act(Action::Quit));
                if send.send(Input::Line(command)).is_err() || quit {
                    return;
                }
            }
            Err(ReadlineError::Signal(_)) => {}
            Err(_) => {
                let _ = send.send(Input::End);
                return;
            }
        }
    }
}

fn read_plain(input: impl BufRead, send: &Sender<Input>) {
    for line in input.split(b'\n').map_while(Result::ok) {
        let command = parse(&String::from_utf8_lossy(&line));
        let quit = command == Ok(Command::Act(Action::Quit));
        if send.send(Input::Line(command)).is_err() || quit {
            return;
        }
    }
    let _ = send.send(Input::End);
}
