//! The inertial sensor's calibration on the virtual board: a chip that is screwed in another way round and errs is found out in
//! six attitudes, and what was found out survives being switched off.

use barrel_tests::board::image;
use hil_sim::link::{Board, Line, Link, LinkError, Tethered};
use hil_sim::virtual_board::VirtualBoard;
use protocol::message::{BodyAxis, CalibrationPhase, CalibrationStep, Transducers};
use protocol::{HostMessage, Id, RobotMessage, Telemetry};

/// A board at rest in a hand, its chip screwed on in another way round.
struct InHand {
    board: VirtualBoard,
    /// Which way is up, along the body axes.
    up: [f64; 3],
}

/// What the chip adds to each reading, and what it makes of 1 g: 40 mg off and 2 % too much at worst.
const BIAS: [f64; 3] = [330.0, -200.0, 120.0];
const PER_G: [f64; 3] = [8355.0, 8192.0, 8070.0];
/// 0.5 °/s.
const GYROSCOPE: [i16; 3] = [8, -5, 3];

impl Board for InHand {
    fn tick(&mut self, _: &Transducers, to: &[u8], from: &mut Vec<u8>) -> Result<[f32; 2], LinkError> {
        // The chip's axes are the body's second, third and first.
        let turned = [self.up[1], self.up[2], self.up[0]];
        let accelerometer = std::array::from_fn(|i| (turned[i] * PER_G[i] + BIAS[i]).round() as i16);
        self.board.tick(&Transducers { accelerometer, gyroscope: GYROSCOPE, encoder: [0; 2] }, to, from)
    }
}

struct Robot(Line<Tethered<InHand>>);

impl Robot {
    fn hold(&mut self, up: [f64; 3]) {
        self.0.transport_mut().board_mut().up = up;
    }

    fn ask(&mut self, message: HostMessage) -> RobotMessage {
        self.0.request(&message).expect("an answer").message
    }

    /// Lets so many control steps pass; the last one.
    fn pass(&mut self, steps: u32) -> Telemetry {
        let mut last = None;
        let mut heard = 0;
        while heard < steps {
            if let Some(RobotMessage::Telemetry(telemetry)) = self.0.listen().expect("goes on") {
                heard += 1;
                last = Some(telemetry);
            }
        }
        last.expect("one at least")
    }

    fn calibrate(&mut self, step: CalibrationStep) -> CalibrationPhase {
        match self.ask(HostMessage::Calibrate(step)) {
            RobotMessage::Calibration(progress) => progress.phase,
            other => panic!("{other:?}"),
        }
    }

    /// One step of the calibration, to its end.
    fn step(&mut self, step: CalibrationStep) -> CalibrationPhase {
        assert_eq!(self.calibrate(step), CalibrationPhase::Averaging);
        self.pass(120);
        self.calibrate(CalibrationStep::Status)
    }

    /// How far the inclinations are off when it is held like this.
    fn error(&mut self, up: [f64; 3]) -> f64 {
        self.hold(up);
        // The chapter's noise on the sensors is not what is looked at here.
        let noise = Id::SensorNoise.index();
        assert_eq!(
            self.ask(HostMessage::SetParameter { index: noise, value: 0.0 }),
            RobotMessage::Parameter { index: noise, value: 0.0 }
        );
        // A disarmed robot takes a restart for a move, and finds its attitude anew.
        self.ask(HostMessage::Restart { seed: 0 });
        let x = self.pass(50).x.map(f64::from);
        (x[0] - up[0]).abs().max((x[1] - up[2]).abs())
    }
}

/// Not along an axis: what is wrong with any of them shows.
const ASKEW: [f64; 3] = [0.6, -0.48, 0.64];

#[test]
fn six_attitudes_make_good_how_the_chip_is_mounted_and_errs_and_that_is_kept() {
    let board = VirtualBoard::power_on(&image()).expect("an image");
    let mut robot = Robot(Line::new(Tethered::new(InHand { board, up: ASKEW })));
    robot.pass(50);
    let before = robot.error(ASKEW);
    assert!(before > 0.5, "it is only {before:.3} off without calibration");

    assert_eq!(robot.step(CalibrationStep::Still), CalibrationPhase::Applied);
    let attitudes = [
        (BodyAxis::Slider1, [1.0, 0.0, 0.0]),
        (BodyAxis::Slider1Negative, [-1.0, 0.0, 0.0]),
        (BodyAxis::Cylinder, [0.0, 1.0, 0.0]),
        (BodyAxis::CylinderNegative, [0.0, -1.0, 0.0]),
        (BodyAxis::Slider2, [0.0, 0.0, 1.0]),
        (BodyAxis::Slider2Negative, [0.0, 0.0, -1.0]),
    ];
    for (i, (axis, up)) in attitudes.into_iter().enumerate() {
        robot.hold(up);
        let phase = robot.step(CalibrationStep::Up(axis));
        assert_eq!(phase, if i < 5 { CalibrationPhase::Taken } else { CalibrationPhase::Applied }, "{axis:?}");
    }
    let after = robot.error(ASKEW);
    assert!(after < 0.005, "it is {after:.4} off");

    assert_eq!(robot.ask(HostMessage::Store), RobotMessage::Stored);
    robot.0.transport_mut().board_mut().board.power_cycle().expect("comes up again");
    let kept = robot.error(ASKEW);
    assert!(kept < 0.005, "it is {kept:.4} off after being switched off and on");
}
