//! What is new: from the session, from recordings that were read, from threads that have written something.

use super::{App, Playback, Show, shape};
use crate::film::Film;
use crate::guide::Guide;
use crate::order::Start;
use crate::recording::{Loading, Recording};
use crate::session::{Desk, Said};

impl App {
    /// Takes what is new from the session and from files that are being read.
    pub(super) fn take_news(&mut self) {
        let Desk { frames, said, status } = self.session.look();
        if status.session != self.status.session {
            self.live.begin();
            if let Some(start) = &status.start {
                self.guide = Guide::of(start);
                self.knobs.pending.clear();
            }
        }
        let changed = status.revision != self.status.revision || status.session != self.status.session;
        self.status = status;
        if changed {
            self.reshape();
        }
        self.live.history.extend(&frames);
        for sentence in said {
            match sentence {
                Said::Typed(line) => {
                    self.answers_matter = ["store", "load"].iter().any(|word| line.trim_start().starts_with(word));
                    self.drawer.typed(&line);
                }
                Said::Told(text) => {
                    if self.answers_matter && !self.layout.console {
                        self.notices.tell(&text);
                    }
                    self.drawer.said(&text);
                }
                Said::Failed(text) => {
                    if !self.layout.console {
                        self.notices.warn(&text);
                    }
                    self.drawer.failed(&text);
                }
            }
        }
        if let Some(result) = self.loading.as_ref().and_then(Loading::done) {
            self.loading = None;
            match result {
                Ok(recording) => self.play(recording),
                Err(why) => self.notices.warn(&why),
            }
        }
        while let Some(done) = self.notices.arrived() {
            self.drawer.said(&done);
        }
        if self.film.as_ref().is_some_and(Film::is_over) {
            self.end_film();
        }
    }

    /// The barrel may have got other measures.
    fn reshape(&mut self) {
        let (Some(values), Some(start)) = (&self.status.values, &self.status.start) else { return };
        self.live.shape = shape(start, values);
    }

    /// Shows a recording.
    fn play(&mut self, mut recording: Recording) {
        if let Some(problem) = &recording.problem {
            self.notices.warn(&format!("{}: {problem}", recording.path.display()));
        }
        let start = Start { experiment: self.guide.chosen, body: recording.body, seed: 1, sets: Vec::new() };
        let shape = shape(&start, &recording.values);
        let mut show = Show::new(std::mem::take(&mut recording.history), shape);
        if let Some((begin, _)) = show.history.span() {
            show.look_at(begin);
        }
        self.layout.plots.show_all();
        self.recording = Some(Playback { recording, show, playing: false, speed: 1.0 });
        self.layout.view.recentre();
    }
}
