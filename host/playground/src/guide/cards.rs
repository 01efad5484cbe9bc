//! What the cards say and what their buttons do. What is to be watched holds for the chapter's barrel: as
//! `barrel report` found it, or as `barrel run` shows with the same settings.

use hil_sim::experiment::Experiment;
use protocol::Id;
use protocol::parameter::Scope;

/// What is told of an experiment.
#[derive(Debug)]
pub(super) struct Card {
    /// The experiment's name.
    experiment: &'static str,
    /// Its heading.
    pub(super) title: &'static str,
    /// What is going on.
    pub(super) about: &'static str,
    /// What there is to try, in the order in which it makes sense.
    pub(super) tries: &'static [Try],
}

/// Something to try.
#[derive(Debug)]
pub(super) struct Try {
    /// The button.
    pub(super) name: &'static str,
    /// What to watch.
    pub(super) watch: &'static str,
    /// What the button does.
    pub(super) does: Does,
}

/// What a button does.
#[derive(Clone, Copy, Debug)]
pub(super) enum Does {
    /// Sets parameters while it rolls.
    Set(&'static [(Id, f64)]),
    /// Sets the controller to the rotation C = U(this), rad.
    C(f64),
    /// Sets the self-model to the rotation A = U(this), rad.
    A(f64),
    /// Lines of the console.
    Lines(&'static [&'static str]),
    /// Starts again with what differs from the preset.
    Start(&'static [(Id, f64)]),
}

impl Does {
    /// The parameters that it sets.
    pub(super) fn sets(self) -> Vec<(Id, f64)> {
        match self {
            Does::Set(sets) | Does::Start(sets) => sets.to_vec(),
            Does::C(angle) => vec![(Id::Coupling1, angle.cos()), (Id::Coupling2, -angle.sin())],
            Does::A(angle) => {
                let (sin, cos) = angle.sin_cos();
                vec![(Id::A11, cos), (Id::A12, -sin), (Id::A21, sin), (Id::A22, cos)]
            }
            Does::Lines(_) => Vec::new(),
        }
    }

    /// Whether there must be a simulated barrel for it: it is pushed, or its body or its floor is changed.
    pub(super) fn needs_simulation(self) -> bool {
        match self {
            Does::Lines(lines) => lines.iter().any(|line| line.starts_with("push") || line.starts_with("shove")),
            Does::Set(_) | Does::C(_) | Does::A(_) | Does::Start(_) => {
                self.sets().iter().any(|(id, _)| id.parameter().scope == Scope::Plant)
            }
        }
    }

    /// What it does, as it would be typed.
    pub(super) fn words(self) -> String {
        let sets = || {
            let assignments: Vec<String> = self
                .sets()
                .iter()
                .map(|(id, value)| format!("{} = {}", id.name(), (value * 1e4).round() / 1e4))
                .collect();
            assignments.join(", ")
        };
        match self {
            Does::Lines(lines) => lines.join("; "),
            Does::Start([]) => "starts again as the preset has it".to_owned(),
            Does::Start(_) => format!("starts again with {}", sets()),
            Does::Set(_) | Does::C(_) | Does::A(_) => sets(),
        }
    }
}

impl Card {
    /// The card of an experiment.
    pub(super) fn of(experiment: &Experiment) -> Option<&'static Card> {
        CARDS.iter().find(|card| card.experiment == experiment.name)
    }
}

const fn set(name: &'static str, sets: &'static [(Id, f64)], watch: &'static str) -> Try {
    Try { name, watch, does: Does::Set(sets) }
}

const fn lines(name: &'static str, lines: &'static [&'static str], watch: &'static str) -> Try {
    Try { name, watch, does: Does::Lines(lines) }
}

const fn start(name: &'static str, sets: &'static [(Id, f64)], watch: &'static str) -> Try {
    Try { name, watch, does: Does::Start(sets) }
}

const fn controller(name: &'static str, angle: f64, watch: &'static str) -> Try {
    Try { name, watch, does: Does::C(angle) }
}

const fn model(name: &'static str, angle: f64, watch: &'static str) -> Try {
    Try { name, watch, does: Does::A(angle) }
}

/// What makes the upright barrel precess.
const PRECESSING: &[(Id, f64)] = &[
    (Id::Coupling1, -1.0),
    (Id::Kd, 0.1),
    (Id::EpsC, 0.1),
    (Id::LambdaC, 0.003),
    (Id::ClipZeta, 1.0),
    (Id::SensorNoise, 0.03),
];
/// Nothing is learned any more, nothing forgotten.
const FROZEN: &[(Id, f64)] =
    &[(Id::Rule, 1.0), (Id::EpsA, 0.0), (Id::LambdaA, 0.0), (Id::LambdaB, 0.0), (Id::LambdaC, 0.0)];

/// Every card, in the chapter's order.
pub(super) const CARDS: &[Card] = &[
    Card {
        experiment: "open-loop",
        title: "Open loop",
        about: "Nothing is sensed and nothing is learned: a sine drives both weights, the second a quarter period \
                ahead of the first, as if the weight ran round in the barrel. The barrel falls after it. A slow drive \
                takes it along, one turn a period; a fast one leaves it behind, and what it does then is up to body \
                and friction.",
        tries: &[
            set(
                "Period 300",
                &[(Id::Period, 300.0)],
                "One turn in 300 control steps, 6 s. Watch x and y: one turn for each period, the rolling is locked \
                 to the drive.",
            ),
            set(
                "Period 100",
                &[(Id::Period, 100.0)],
                "One turn in 2 s, still locked; omega goes up and down within a turn.",
            ),
            set(
                "Period 50",
                &[(Id::Period, 50.0)],
                "One turn a second. It is kept if the barrel already rolls at nearly that; from rest the lock is not \
                 found.",
            ),
            set(
                "Period 25",
                &[(Id::Period, 25.0)],
                "Too fast: the lock is lost, and omega falls far below the drive's 12.6 rad/s.",
            ),
            lines(
                "Push it to the drive's speed",
                &["push -40 0.5"],
                "At period 25: −40 N·m for half a second bring the barrel to the drive's speed, and there the lock \
                 holds.",
            ),
            start(
                "Period 50 from rest",
                &[(Id::Period, 50.0)],
                "The same drive from rest: the barrel does not catch up.",
            ),
            set(
                "Amplitude 0.5",
                &[(Id::Amplitude, 0.5)],
                "Shorter ways of the weights, less torque: the period of 200 is still kept, from rest that of 100 no \
                 more.",
            ),
            set("Amplitude 1", &[(Id::Amplitude, 1.0)], "The whole way again."),
            start(
                "Phase shift −1 from rest",
                &[(Id::Phaseshift, -1.0)],
                "The second weight runs behind: the mirror image, it rolls the other way.",
            ),
            set(
                "Phase shift −1",
                &[(Id::Phaseshift, -1.0)],
                "In mid-roll the reversed drive does not turn it round: it rolls on, slower and uneven. Push it \
                 against its rolling.",
            ),
            set("Phase shift 1", &[(Id::Phaseshift, 1.0)], "Ahead again."),
            set(
                "Noise instead of the sine",
                &[(Id::Amplitude, 0.0), (Id::Noise, 1.0)],
                "A drive without a direction: the barrel is thrown about, and rolls neither way for long.",
            ),
            set("The sine again", &[(Id::Amplitude, 1.0), (Id::Noise, 0.0)], "Back to the drive of the beginning."),
        ],
    },
    Card {
        experiment: "closed-loop",
        title: "Closed loop",
        about: "Now the barrel feels where it is: y = tanh(C x), with C = U(φ), a rotation that stays as it is. Each \
                motor value is the inclination a little further on, by the angle φ; so the weights are always ahead \
                of the rolling, and the barrel falls after them by itself. No clock: the speed comes of brain and \
                body together.",
        tries: &[
            controller("C = U(0.1)", 0.1, "A slow roll: the weights are only just ahead."),
            controller("C = U(0.3)", 0.3, "Faster."),
            controller("C = U(0.5)", 0.5, "The experiment's own: 5.5 rad/s."),
            controller(
                "C = U(0.9)",
                0.9,
                "Faster still; the turn in a control step stays far below φ, as the controller leads.",
            ),
            controller("C = U(−0.5)", -0.5, "The mirror image: it turns round and rolls back at the same speed."),
            lines(
                "Push against it",
                &["push -20 0.5"],
                "It is slowed or turned round, and comes back to its speed and direction within seconds.",
            ),
            lines("Push with it", &["push 20 0.5"], "Too fast now: it comes back to the same speed."),
            lines("Random C (r)", &["random C 5"], "Any controller: most hop, rock or hang; a few roll. Draw again."),
            lines(
                "Random C and h (R)",
                &["random C 5", "random h 3"],
                "With a bias the weights lean to a side; rest is more likely.",
            ),
            lines(
                "Scatter C by 0.2 (s)",
                &["scatter 0.2"],
                "A near neighbour of the controller: what it does changes a little.",
            ),
            lines(
                "Scatter C by 0.5 (S)",
                &["scatter 0.5"],
                "Further away; again and again is a walk through the controllers.",
            ),
            start("The rotation again", &[], "C = U(0.5), h = 0, from rest."),
        ],
    },
    Card {
        experiment: "learn-controller",
        title: "A controller learned from a given model",
        about: "The self-model is given, A = U(−0.3), and does not learn. The controller does, from the prediction \
                error, so that what comes is what the model foresaw. A model that turns backward fits a controller \
                that turns forward: C becomes a rotation against A, and the barrel takes up the rolling that makes \
                its model right.",
        tries: &[
            start(
                "From C = 1, A = U(−0.3)",
                &[],
                "Watch C12 and C21 part: C turns against A, and the barrel begins to roll.",
            ),
            model("A = U(0.3)", 0.3, "The other sense: C turns over to the other side, and the barrel turns round."),
            model("A = U(−0.6)", -0.6, "A larger turn: C goes further, the barrel rolls faster."),
            model("A = U(0.6)", 0.6, "And back the other way, through rest."),
            model(
                "A = U(−0.1)",
                -0.1,
                "A small turn: slow rolling. C does not stop at the inverse of A; it goes beyond, most where A hardly \
                 turns.",
            ),
            model("A = U(−0.3)", -0.3, "The given model of the beginning."),
            lines(
                "Scatter C by 0.5 (S)",
                &["scatter 0.5"],
                "Away from the rotation; watch C11 and C22, and C12 and −C21, find together again.",
            ),
            lines(
                "Random C (r)",
                &["random C 5"],
                "From far away, mostly saturated: it takes longer, as saturated neurons learn slowly.",
            ),
            lines(
                "Push it",
                &["push -20 0.5"],
                "The push is a large error; C follows it for a moment, and comes back.",
            ),
            set(
                "Sensor noise 0.01",
                &[(Id::SensorNoise, 0.01)],
                "Quieter sensors: the entries of C stand still once they are found.",
            ),
        ],
    },
    Card {
        experiment: "homeostatic",
        title: "Homeostatic control",
        about: "Controller and self-model now learn together, both from the prediction error. The smallest error is \
                that of a barrel at rest, and rest is what this rule keeps. But once a kick has set it rolling, the \
                two have something to agree on: rotations that fit each other. They chase one another through all the \
                speeds, and the barrel sweeps.",
        tries: &[
            start(
                "From rest",
                &[(Id::LambdaA, 0.001)],
                "Nothing: E is the noise of the sensors. One decay for A and b, λ = 0.001, keeps both rest and sweep.",
            ),
            lines(
                "Kick it (x)",
                &["push 10 0.02"],
                "+10 N·m for one step: the pose trembles, and rest comes back. It is not enough.",
            ),
            lines(
                "Push it for half a second",
                &["push 10 0.5"],
                "Now it leaves rest: E jumps, C and A turn against each other, and the sweep goes on after the push.",
            ),
            lines(
                "Push it the other way",
                &["push -10 0.5"],
                "Against the rolling: it turns back sooner, and the sweep goes on.",
            ),
            set(
                "Slow model: epsA = 0.01",
                &[(Id::EpsA, 0.01)],
                "The model lags behind the controller: the barrel keeps a direction for longer.",
            ),
            set("Quick model: epsA = 0.1", &[(Id::EpsA, 0.1)], "As quick as the controller: it turns back more often."),
            set(
                "Both too quick: epsA = epsC = 1",
                &[(Id::EpsA, 1.0), (Id::EpsC, 1.0)],
                "Each step overshoots: C and h are thrown into saturation, nothing is learned there, and the barrel \
                 comes to rest.",
            ),
            set(
                "Both as before: epsA = epsC = 0.1",
                &[(Id::EpsA, 0.1), (Id::EpsC, 0.1)],
                "Slow enough again; out of saturation it does not come by itself. Scatter C, or start again.",
            ),
            lines("Scatter C by 0.2 (s)", &["scatter 0.2"], "A disturbance of the brain instead of the body."),
            set(
                "Without the servo's integral: KI = 0",
                &[(Id::Ki, 0.0)],
                "What keeps it rolling is the servo's integral term: without it the sweep dies out within minutes.",
            ),
        ],
    },
    Card {
        experiment: "homeokinetic",
        title: "Homeokinetic control",
        about: "The error is now looked at backward through the loop: how far would the last sensor values have had \
                to be off to explain it? That time loop error is small where the loop is sensitive. So rest is \
                destabilised, the noise is amplified until the barrel moves, and saturation keeps the movement within \
                bounds. It sweeps through its speeds, turning back about every ten seconds, since its model forgets.",
        tries: &[
            start(
                "From rest",
                &[],
                "Left within seconds. Watch E_tle fall and |C| grow until it does; then C and A turn to and fro \
                 against each other.",
            ),
            lines(
                "Push: omega up",
                &["push 20 0.5"],
                "Choose the push that is against its rolling (omega < 0): it takes the new direction up, and does not \
                 fight for the old one.",
            ),
            lines(
                "Push: omega down",
                &["push -20 0.5"],
                "The same for omega > 0. With its rolling, a push makes it turn back sooner.",
            ),
            set(
                "Hold it",
                &[(Id::RollingResistance, 50.0)],
                "The floor does not let it roll. C, A and h learn on from what little comes of the weights' moves.",
            ),
            set(
                "Let it go",
                &[(Id::RollingResistance, 0.0)],
                "It is off within a second or two, faster than before at first, and sweeps as before.",
            ),
            set("epsC = 0.02", &[(Id::EpsC, 0.02)], "A slow controller: slower rolling, and long until it turns back."),
            set(
                "epsC = 0.5",
                &[(Id::EpsC, 0.5)],
                "A quick one: it rolls twice as fast, and turns back as often as before.",
            ),
            set("epsC = 0.1", &[(Id::EpsC, 0.1)], "The preset."),
            start(
                "From rest with little noise: 0.01",
                &[(Id::SensorNoise, 0.01)],
                "It leaves rest all the same, only later: about 25 s instead of 8.",
            ),
            set(
                "Sensor noise 0.01",
                &[(Id::SensorNoise, 0.01)],
                "In mid-sweep: the movement does not live on the noise.",
            ),
            set("Sensor noise 0.1", &[(Id::SensorNoise, 0.1)], "The preset."),
            set(
                "Long memory: lambdaA = 0.001",
                &[(Id::LambdaA, 0.001)],
                "The model forgets less: it turns back every 40 s instead of every ten.",
            ),
            set(
                "No forgetting: lambdaA = 0",
                &[(Id::LambdaA, 0.0)],
                "It keeps its direction for a quarter of an hour.",
            ),
            set(
                "Usual memory: lambdaA = 0.003",
                &[(Id::LambdaA, 0.003)],
                "The preset: turning back every ten seconds.",
            ),
            lines(
                "Scatter C by 0.5 (S)",
                &["scatter 0.5"],
                "The brain disturbed instead of the body: the sweep goes on.",
            ),
        ],
    },
    Card {
        experiment: "upright",
        title: "Upright",
        about: "The same rule, but the barrel stands on its end, where the weights do next to nothing to its \
                inclination. There is nothing to learn: the model fades, so the controller grows and amplifies the \
                noise it finds, until the weights act together and the barrel rocks, tips over its rim and rolls on.",
        tries: &[
            start(
                "Stand it up",
                &[],
                "Watch |A| fall and |C| grow; after some 15 s it topples. The model comes back as soon as the motors \
                 have an effect.",
            ),
            start(
                "On a smoother floor: mu = 0.8",
                &[(Id::Mu, 0.8)],
                "It takes longer, some 20 s, and goes further: |A| falls by a factor of 100, |C| beyond 10, before it \
                 topples.",
            ),
            start(
                "Precession",
                PRECESSING,
                "Weights driven to the other side (C = −1), a slight decay of C: after half a minute it leans by 5° \
                 and goes round on its rim by itself, for minutes.",
            ),
            set(
                "Freeze the learning",
                FROZEN,
                "While it precesses: with the brain as it is now, and no longer learning, it falls within a minute.",
            ),
            lines("Push it along the floor", &["shove 30 0.5"], "It rocks, or falls."),
            lines("Scatter C by 0.5 (S)", &["scatter 0.5"], "The controller disturbed: precession outlasts it."),
            start("More noise: 0.3", &[(Id::SensorNoise, 0.3)], "More to amplify: it topples after some 5 s."),
            start(
                "The lying barrel's brain",
                &[(Id::Mu, 0.64), (Id::EpsC, 0.1), (Id::ClipZeta, 1.0), (Id::Kd, 0.1), (Id::SensorNoiseTau, 0.05)],
                "The settings of the experiment lying down: it hardly topples at all.",
            ),
        ],
    },
];
