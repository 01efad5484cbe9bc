//! The robot as a host meets it: what it answers, what it refuses, and that nothing moves unless it is Armed.

use firmware::attitude::ImuCalibration;
use firmware::axes::ImuCounts;
use firmware::calibration::READINGS;
use firmware::robot::{BATTERY_LOW, Boot, Senses};
use firmware::storage::Record;
use firmware::{Port, Robot};
use hil_sim::link::{HELLO, InProcess, Line, Link, LinkError, Transport, hello};
use hil_sim::plant::{Body, Drive};
use protocol::message::{
    CalibrationPhase, CalibrationProgress, CalibrationStep, FaultCode, MemoryState, Precision, Refusal, ResetCause,
    SafetyState, Transducers,
};
use protocol::{HostMessage, Id, RobotMessage, encode};

fn robot() -> Line<InProcess<f32>> {
    Line::new(InProcess::new(Robot::default()))
}

fn ask(line: &mut impl Link, message: HostMessage) -> RobotMessage {
    line.request(&message).expect("an answer").message
}

/// A robot that takes simulated sensors and is Armed.
fn armed() -> Line<InProcess<f32>> {
    let mut line = robot();
    ask(&mut line, HostMessage::SimulatedSensors(true));
    assert_eq!(ask(&mut line, HostMessage::Arm), RobotMessage::State(SafetyState::Armed));
    line
}

/// Chips of a barrel that lies still, x = (0, 1), with a last bit that flickers as noise does.
fn still(k: i16) -> Transducers {
    Transducers { accelerometer: [k % 3, 0, 8192], gyroscope: [k % 2, 0, 0], encoder: [0, 0] }
}

fn duty(line: &mut impl Link, transducers: Transducers) -> [f32; 2] {
    match ask(line, HostMessage::Transducers(transducers)) {
        RobotMessage::Actuators { duty } => duty,
        other => panic!("{other:?}"),
    }
}

fn state(line: &mut impl Link) -> SafetyState {
    match ask(line, HELLO) {
        RobotMessage::Hello { state, .. } => state,
        other => panic!("{other:?}"),
    }
}

#[test]
fn it_says_who_it_is() {
    let identity = hello(&mut robot()).expect("the same build");
    assert_eq!((identity.precision, identity.state), (Precision::F32, SafetyState::Disarmed));
}

#[test]
fn every_message_is_answered_once_and_by_what_answers_it() {
    for message in [
        HostMessage::Hello { version: 9, schema: 9 },
        HostMessage::Arm,
        HostMessage::EmergencyStop,
        HostMessage::Arm,
        HostMessage::ClearFault,
        HostMessage::Disarm,
        HostMessage::Restart { seed: 4 },
        HostMessage::SetParameter { index: 0, value: 2.0 },
        HostMessage::SetParameter { index: 255, value: 2.0 },
        HostMessage::GetParameter { index: 1 },
        HostMessage::Inclination { x: [0.0, 1.0] },
        HostMessage::SimulatedSensors(true),
        HostMessage::Inclination { x: [f32::NAN, 1.0] },
        HostMessage::Transducers(still(0)),
    ] {
        let mut answers = Vec::new();
        let mut robot = Robot::<f32>::default();
        robot.handle(&HostMessage::SimulatedSensors(true), &mut |_| {});
        robot.handle(&message, &mut |reply| answers.push(*reply));
        assert_eq!(answers.iter().filter(|a| message.is_answered_by(a)).count(), 1, "{message:?}: {answers:?}");
    }
}

#[test]
fn what_it_refuses_it_leaves_as_it_was() {
    let mut line = robot();
    let refused = |refusal| RobotMessage::Refused(refusal);
    assert_eq!(ask(&mut line, HostMessage::Inclination { x: [0.0, 1.0] }), refused(Refusal::OwnSensors));
    assert_eq!(ask(&mut line, HostMessage::GetParameter { index: 255 }), refused(Refusal::UnknownParameter));
    let radius = Id::Radius.index();
    assert_eq!(ask(&mut line, HostMessage::SetParameter { index: radius, value: 1.0 }), refused(Refusal::NotTheRobots));
    for value in [f32::NAN, f32::INFINITY, -1.0, 11.0] {
        let index = Id::EpsA.index();
        assert_eq!(ask(&mut line, HostMessage::SetParameter { index, value }), refused(Refusal::BadValue));
        assert_eq!(ask(&mut line, HostMessage::GetParameter { index }), RobotMessage::Parameter { index, value: 0.1 });
    }
    let mut line = armed();
    assert_eq!(ask(&mut line, HostMessage::SimulatedSensors(false)), refused(Refusal::WhileArmed));
}

#[test]
fn a_sensor_that_is_no_number_faults_and_stops_the_motors() {
    let mut line = armed();
    ask(&mut line, HostMessage::Inclination { x: [0.3, 0.9] });
    let RobotMessage::Telemetry(telemetry) = ask(&mut line, HostMessage::Inclination { x: [f32::NAN, 0.9] }) else {
        panic!("no telemetry")
    };
    assert_eq!(telemetry.state, SafetyState::Fault(FaultCode::ImpossibleSensor));
    assert_eq!(telemetry.y, [0.0; 2]);
    assert!(telemetry.c.iter().chain(&telemetry.a).all(|n| n.is_finite()));
    assert_eq!(ask(&mut line, HostMessage::Arm), RobotMessage::Refused(Refusal::InFault));
    assert_eq!(ask(&mut line, HostMessage::ClearFault), RobotMessage::State(SafetyState::Disarmed));
}

#[test]
fn motors_get_nothing_unless_armed() {
    let mut line = robot();
    ask(&mut line, HostMessage::SimulatedSensors(true));
    for k in 0..50 {
        assert_eq!(duty(&mut line, still(k)), [0.0; 2], "Disarmed");
    }
    ask(&mut line, HostMessage::Arm);
    let driven = (0..50).any(|k| duty(&mut line, still(k)) != [0.0; 2]);
    assert!(driven, "Armed, the weight goes down");
    ask(&mut line, HostMessage::EmergencyStop);
    for k in 0..50 {
        assert_eq!(duty(&mut line, still(k)), [0.0; 2], "in Fault");
    }
    assert_eq!(state(&mut line), SafetyState::Fault(FaultCode::EmergencyStop));
}

#[test]
fn a_dead_sensor_faults_in_the_same_tick() {
    let mut line = armed();
    for k in 0..30 {
        duty(&mut line, still(k));
    }
    let dead = Transducers { accelerometer: [-1; 3], gyroscope: [-1; 3], encoder: [0, 0] };
    assert_eq!(duty(&mut line, dead), [0.0; 2]);
    assert_eq!(state(&mut line), SafetyState::Fault(FaultCode::ImpossibleSensor));
}

#[test]
fn an_encoder_that_jumps_faults_in_the_same_tick() {
    let mut line = armed();
    for k in 0..30 {
        duty(&mut line, still(k));
    }
    let jumped = Transducers { encoder: [300, 0], ..still(1) };
    assert_eq!(duty(&mut line, jumped), [0.0; 2]);
    assert_eq!(state(&mut line), SafetyState::Fault(FaultCode::ImpossibleSensor));
}

/// A robot that has been calibrated: its chip is screwed in the other way round.
fn calibrated() -> Robot<f32> {
    let mut calibration = ImuCalibration::default();
    calibration.mounting = -calibration.mounting;
    calibration.mounting.m22 = 1.0;
    let mut parameters = Id::ALL.iter().map(|id| id.parameter().default as f32).collect::<Vec<_>>();
    for (id, value) in [(Id::EpsA, 0.07), (Id::SensorNoise, 0.0)] {
        parameters[usize::from(id.index())] = value;
    }
    let record = Record { parameters: parameters.try_into().expect("all of them"), calibration };
    let boot = Boot { reset: ResetCause::PowerOn, memory: MemoryState::Loaded, record: Some(record) };
    let mut robot = Robot::new(&boot);
    for (id, value) in firmware::axes::SERVO_PARAMETERS {
        robot.set(id, value).expect("in range");
    }
    robot
}

fn tell(robot: &mut Robot<f32>, message: HostMessage) -> RobotMessage {
    let mut answer = None;
    robot.handle(&message, &mut |reply| answer = Some(*reply));
    answer.expect("an answer")
}

/// What it senses by itself lying still, in its chip's axes, which are the other way round.
fn lying(k: i16) -> Senses {
    Senses { imu: Some(ImuCounts { accelerometer: [k % 3, 0, -8192], gyroscope: [k % 2, 0, 0] }), ..Senses::default() }
}

/// Lets it lie for so many servo ticks.
fn rest(robot: &mut Robot<f32>, ticks: u16) {
    for k in 0..ticks {
        robot.servo_tick(&lying(k.cast_signed()));
    }
}

#[test]
fn a_simulation_leaves_nothing_of_itself_in_the_robot() {
    let mut robot = calibrated();
    rest(&mut robot, 50);
    let inclination = robot.telemetry().x;
    assert!((inclination[1] - 1.0).abs() < 0.01, "{inclination:?}");
    let held = |robot: &Robot<f32>| Id::ALL.iter().map(|id| robot.get(*id)).collect::<Vec<_>>();
    let before = held(&robot);

    tell(&mut robot, HostMessage::SimulatedSensors(true));
    // The chapter's body is five times as large and ten times as strong.
    for (id, value) in [(Id::Range, 0.3), (Id::MaxForce, 200.0), (Id::Kp, 200.0), (Id::C12, -3.0), (Id::EpsA, 0.5)] {
        robot.set(id, value).expect("in range");
    }
    tell(&mut robot, HostMessage::Restart { seed: 1 });
    tell(&mut robot, HostMessage::Arm);
    for k in 0..200 {
        tell(&mut robot, HostMessage::Transducers(still(k)));
    }
    assert_ne!(held(&robot), before);
    // What comes from the host is along the body's axes, however the chip is mounted.
    assert!((robot.telemetry().x[1] - 1.0).abs() < 0.02, "{:?}", robot.telemetry().x);
    tell(&mut robot, HostMessage::Disarm);
    for message in [HostMessage::Store, HostMessage::Calibrate(CalibrationStep::Still)] {
        assert_eq!(tell(&mut robot, message), RobotMessage::Refused(Refusal::WhileSimulated));
    }
    // Neither a second call nor a homing that was not finished changes that.
    tell(&mut robot, HostMessage::SimulatedSensors(true));
    tell(&mut robot, HostMessage::Home);
    tell(&mut robot, HostMessage::EmergencyStop);
    tell(&mut robot, HostMessage::ClearFault);
    tell(&mut robot, HostMessage::SimulatedSensors(false));

    assert_eq!(held(&robot), before);
    rest(&mut robot, 50);
    let after = robot.telemetry().x;
    assert!((after[1] - 1.0).abs() < 0.01, "{after:?}");
    assert_eq!(tell(&mut robot, HostMessage::Arm), RobotMessage::Refused(Refusal::NotHomed));
}

#[test]
fn a_missed_deadline_is_a_fault_in_every_state() {
    let fault = SafetyState::Fault(FaultCode::MissedDeadline);
    for simulated in [false, true] {
        for arm in [false, true] {
            let mut robot = Robot::<f32>::default();
            tell(&mut robot, HostMessage::SimulatedSensors(simulated));
            if arm {
                // Homing arms it, whether or not the middle of its axes is known.
                tell(&mut robot, HostMessage::Home);
                assert_eq!(robot.safety_state(), SafetyState::Armed);
            }
            let tick = robot.servo_tick(&Senses { deadline_missed: true, ..lying(0) });
            assert_eq!((tick.outputs.duty(), tick.powered), ([0.0; 2], false));
            assert_eq!(robot.safety_state(), fault, "simulated {simulated}, armed {arm}");
        }
    }
}

#[test]
fn one_low_measurement_of_the_battery_is_a_start_of_two_motors_and_three_are_a_fault() {
    let mut robot = Robot::<f32>::default();
    let measure = |robot: &mut Robot<f32>, millivolts: u16| {
        for k in 0..10 {
            robot.servo_tick(&Senses { battery_mv: (k == 0).then_some(millivolts), ..lying(k) });
        }
        robot.safety_state()
    };
    let (low, good) = (BATTERY_LOW - 1, BATTERY_LOW);
    for _ in 0..5 {
        assert_eq!(measure(&mut robot, low), SafetyState::Disarmed, "no load, no matter");
    }
    tell(&mut robot, HostMessage::Home);
    for millivolts in [low, low, good, low, low] {
        assert_eq!(measure(&mut robot, millivolts), SafetyState::Armed);
    }
    assert_eq!(measure(&mut robot, low), SafetyState::Fault(FaultCode::BrownOut));
}

#[test]
fn a_microcontroller_whose_own_supply_sags_lets_go_of_the_motors() {
    let mut robot = Robot::<f32>::default();
    tell(&mut robot, HostMessage::Home);
    let tick = robot.servo_tick(&Senses { supply_low: true, ..lying(0) });
    assert_eq!((tick.outputs.duty(), tick.powered), ([0.0; 2], false));
    assert_eq!(robot.safety_state(), SafetyState::Fault(FaultCode::BrownOut));
}

#[test]
fn a_calibration_step_does_not_go_on_while_the_motors_move() {
    let mut robot = calibrated();
    rest(&mut robot, 50);
    tell(&mut robot, HostMessage::Calibrate(CalibrationStep::Still));
    rest(&mut robot, 100);
    tell(&mut robot, HostMessage::Home);
    rest(&mut robot, READINGS);
    let idle = CalibrationProgress { phase: CalibrationPhase::Idle, attitudes: 0 };
    assert_eq!(tell(&mut robot, HostMessage::Calibrate(CalibrationStep::Status)), RobotMessage::Calibration(idle));
}

#[test]
fn garbage_on_the_line_is_counted_and_the_next_frame_is_understood() {
    let mut robot = Robot::<f32>::default();
    let mut port = Port::default();
    let mut buffer = [0; 128];
    let frame = encode(0, &HostMessage::GetParameter { index: 0 }, &mut buffer).expect("fits").to_vec();
    let mut answers = 0;
    let garbage: Vec<u8> = (0..5000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).chain([0]).collect();
    port.serve(&garbage, &mut robot, &mut |_| answers += 1);
    assert_eq!(answers, 0);
    assert!(port.garbled() > 0);
    // In pieces of one byte, as a serial line may bring it.
    for byte in frame {
        port.serve(&[byte], &mut robot, &mut |_| answers += 1);
    }
    assert_eq!(answers, 1);
}

/// A wire that eats or changes what the robot says.
struct Bad<T>(T, fn(&mut Vec<u8>));

impl<T: Transport> Transport for Bad<T> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.0.write(bytes)
    }
    fn read(&mut self, buffer: &mut Vec<u8>) -> Result<(), LinkError> {
        self.0.read(buffer)?;
        (self.1)(buffer);
        if buffer.is_empty() { Err(LinkError::NoAnswer) } else { Ok(()) }
    }
}

#[test]
fn a_bad_wire_is_an_error_and_not_a_wrong_answer() {
    let request = HostMessage::GetParameter { index: 0 };
    let mut deaf = Line::new(Bad(InProcess::new(Robot::<f32>::default()), Vec::clear));
    assert_eq!(deaf.request(&request), Err(LinkError::NoAnswer));
    let mut noisy = Line::new(Bad(InProcess::new(Robot::<f32>::default()), |bytes| bytes[3] ^= 0x40));
    assert!(matches!(noisy.request(&request), Err(LinkError::Garbled(_))));
}

#[test]
fn the_firmware_and_the_simulator_mean_the_same_tabletop() {
    use firmware::axes::{COUNTS_PER_METRE, IMU_POSITION, SERVO_PARAMETERS};
    let body = Body::tabletop();
    assert_eq!(IMU_POSITION.map(f64::from).map(|p| (p * 1e6).round()), body.imu_position.map(|p| (p * 1e6).round()));
    assert_eq!(f64::from(COUNTS_PER_METRE), body.counts_per_metre);
    let range = SERVO_PARAMETERS.iter().find(|(id, _)| *id == Id::Range).expect("in the list").1;
    assert_eq!(range, body.range);
    let Drive::Motor(motor) = &body.drive else { panic!("the tabletop has motors") };
    let axis = firmware::axes::AXIS;
    assert_eq!((axis.stall_force, axis.free_speed), (motor.stall_force as f32, motor.no_load_speed as f32));
    assert!((f64::from(axis.travel) - body.range).abs() < 1e-6);
    assert!(f64::from(axis.travel + axis.stop_play) > body.stop);
    let radius = f64::from(firmware::attitude::AttitudeSettings::default().radius);
    assert!((radius - body.radius).abs() < 1e-6);
}
