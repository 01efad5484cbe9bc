//! The wire: every message survives it, and no garbage does.

use proptest::prelude::*;
use protocol::frame::{Arrival, MAX_FRAME, Numbering};
use protocol::message::*;
use protocol::{Decoder, FrameError, HostMessage, RobotMessage, SCHEMA, VERSION, encode};

fn telemetry(seed: f32) -> Telemetry {
    Telemetry {
        tick: u32::MAX,
        state: SafetyState::Fault(FaultCode::BrownOut),
        x: [seed; 2],
        y: [-seed; 2],
        c: [seed * 3.0; 4],
        h: [0.0; 2],
        a: [f32::MIN_POSITIVE; 4],
        b: [f32::MAX; 2],
        xi: [seed; 2],
        time_loop_error: seed,
    }
}

/// The longest vitals there can be.
fn busiest() -> Vitals {
    Vitals {
        ticks: u32::MAX,
        homed: true,
        simulated_sensors: true,
        load: u16::MAX,
        servo_ns: u32::MAX,
        brain_ns: u32::MAX,
        jitter_ns: u32::MAX,
        overruns: u32::MAX,
        imu_missed: u32::MAX,
        battery_mv: u16::MAX,
        encoder: [i32::MIN; 2],
        unsent: u32::MAX,
        garbled: u32::MAX,
    }
}

fn host_messages() -> Vec<HostMessage> {
    vec![
        HostMessage::Hello { version: VERSION, schema: SCHEMA },
        HostMessage::Arm,
        HostMessage::Disarm,
        HostMessage::EmergencyStop,
        HostMessage::ClearFault,
        HostMessage::Restart { seed: u64::MAX },
        HostMessage::SimulatedSensors(true),
        HostMessage::SetParameter { index: 255, value: -0.0 },
        HostMessage::GetParameter { index: 3 },
        HostMessage::Inclination { x: [0.5, -1.0] },
        HostMessage::Transducers(Transducers {
            accelerometer: [i16::MIN, 0, i16::MAX],
            gyroscope: [-1, 0, 1],
            encoder: [i32::MIN, i32::MAX],
        }),
        HostMessage::Home,
        HostMessage::Calibrate(CalibrationStep::Up(BodyAxis::Slider2Negative)),
        HostMessage::Store,
        HostMessage::Forget,
    ]
}

fn robot_messages() -> Vec<RobotMessage> {
    vec![
        RobotMessage::Hello {
            version: VERSION,
            schema: SCHEMA,
            firmware: [255; 3],
            precision: Precision::Fixed,
            state: SafetyState::Disarmed,
            reset: ResetCause::HardFault,
            memory: MemoryState::Unreadable,
        },
        RobotMessage::State(SafetyState::Armed),
        RobotMessage::Parameter { index: 0, value: 1e-30 },
        RobotMessage::Refused(Refusal::BadValue),
        RobotMessage::Telemetry(telemetry(0.1)),
        RobotMessage::Actuators { duty: [1.0, -1.0] },
        RobotMessage::Calibration(CalibrationProgress { phase: CalibrationPhase::Inconsistent, attitudes: 63 }),
        RobotMessage::Stored,
        RobotMessage::Vitals(busiest()),
    ]
}

fn decode_all<M: serde::de::DeserializeOwned>(bytes: &[u8]) -> Vec<Result<(u16, M), FrameError>> {
    let mut decoder = Decoder::new();
    bytes.iter().filter_map(|&byte| decoder.push(byte)).collect()
}

#[test]
fn every_message_arrives_as_it_was_sent() {
    let mut buffer = [0; MAX_FRAME];
    for (i, message) in host_messages().iter().enumerate() {
        let bytes = encode(i as u16, message, &mut buffer).expect("fits");
        assert_eq!(decode_all::<HostMessage>(bytes), [Ok((i as u16, *message))]);
    }
    for (i, message) in robot_messages().iter().enumerate() {
        let bytes = encode(65535 - i as u16, message, &mut buffer).expect("fits");
        assert_eq!(decode_all::<RobotMessage>(bytes), [Ok((65535 - i as u16, *message))]);
    }
}

#[test]
fn full_state_at_50_hz_leaves_a_fifth_of_a_57600_baud_radio_free() {
    // 8N1 takes ten bits a byte.
    let budget = 57_600.0 / 10.0 * 0.8;
    let mut buffer = [0; MAX_FRAME];
    // Eleven hours after the start, and the longest state.
    let message = RobotMessage::Telemetry(Telemetry { tick: 2_000_000, ..telemetry(0.1) });
    let step = encode(u16::MAX, &message, &mut buffer).expect("fits").len();
    // The ticks of eleven hours, some of them late, and a line that was busy.
    let vitals = Vitals {
        ticks: 40_000_000,
        load: 10_000,
        servo_ns: 1_000_000,
        brain_ns: 1_000_000,
        jitter_ns: 1_000_000,
        overruns: 100,
        imu_missed: 100_000,
        battery_mv: 12_000,
        encoder: [-860, 860],
        unsent: 10_000,
        garbled: 100,
        ..busiest()
    };
    let vitals = encode(u16::MAX, &RobotMessage::Vitals(vitals), &mut buffer).expect("fits").len();
    let bytes = 50 * step + vitals;
    assert!(bytes as f64 <= budget, "{step} bytes a step, {vitals} of vitals: {bytes} of {budget} a second");
}

#[test]
fn a_changed_bit_is_never_taken_for_a_message() {
    let mut buffer = [0; MAX_FRAME];
    let bytes = encode(7, &RobotMessage::Telemetry(telemetry(0.3)), &mut buffer).expect("fits").to_vec();
    for position in 0..bytes.len() {
        for bit in 0..8 {
            let mut broken = bytes.clone();
            broken[position] ^= 1 << bit;
            broken.push(0);
            let accepted = decode_all::<RobotMessage>(&broken).into_iter().flatten().count();
            assert_eq!(accepted, 0, "byte {position} bit {bit}");
        }
    }
}

#[test]
fn a_lost_byte_costs_one_frame() {
    let mut buffer = [0; MAX_FRAME];
    let frames: Vec<Vec<u8>> = (0..3)
        .map(|i| encode(i, &HostMessage::Inclination { x: [i as f32, 0.5] }, &mut buffer).expect("fits").to_vec())
        .collect();
    for lost in 0..frames[1].len() {
        let mut stream = frames[0].clone();
        stream.extend(frames[1].iter().enumerate().filter(|(i, _)| *i != lost).map(|(_, b)| *b));
        stream.extend(&frames[2]);
        let arrived: Vec<u16> = decode_all::<HostMessage>(&stream).into_iter().flatten().map(|(n, _)| n).collect();
        // Without its delimiter the second frame takes the third with it.
        let expected: &[u16] = if lost == frames[1].len() - 1 { &[0] } else { &[0, 2] };
        assert_eq!(arrived, expected, "byte {lost} lost");
    }
}

#[test]
fn a_message_of_another_build_is_named_as_such() {
    let mut buffer = [0; MAX_FRAME];
    let bytes = encode(0, &200_u8, &mut buffer).expect("fits");
    assert_eq!(decode_all::<HostMessage>(bytes), [Err(FrameError::UnknownMessage)]);
    // A known message with something behind it is not ours either.
    let bytes = encode(0, &(HostMessage::Arm, 1_u8), &mut buffer).expect("fits");
    assert_eq!(decode_all::<HostMessage>(bytes), [Err(FrameError::UnknownMessage)]);
}

#[test]
fn a_flood_without_delimiters_is_one_error() {
    let mut stream = vec![0x55; 10_000];
    stream.push(0);
    assert_eq!(decode_all::<HostMessage>(&stream), [Err(FrameError::TooLong)]);
}

#[test]
fn gaps_are_counted_across_the_wrap() {
    let mut numbering = Numbering::default();
    let gaps = [65534, 65535, 2, 3].map(|n| numbering.arrived(n));
    assert_eq!(gaps, [0, 0, 2, 0].map(|lost| Arrival::New { lost }));
    assert_eq!(numbering.lost(), 2);
}

#[test]
fn a_repeated_frame_and_a_sender_that_starts_anew_are_no_gaps() {
    let mut numbering = Numbering::default();
    let arrivals = [40_000, 40_001, 40_001, 39_995, 40_002, 0, 1].map(|n| numbering.arrived(n));
    let new = Arrival::New { lost: 0 };
    let (again, lost) = (Arrival::Again, Arrival::New { lost: 25_533 });
    assert_eq!(arrivals, [new, new, again, again, new, lost, new], "a jump forwards can only be a gap");
    let mut numbering = Numbering::default();
    let arrivals = [20_000, 0, 1].map(|n| numbering.arrived(n));
    assert_eq!(arrivals, [new, Arrival::Restarted, new]);
    assert_eq!(numbering.lost(), 0);
    numbering.begin(1);
    assert_eq!(numbering.arrived(2), new, "a new sender's second frame");
}

#[test]
fn a_lost_frame_that_arrives_after_all_is_heard_once_and_no_longer_lost() {
    let mut numbering = Numbering::default();
    let arrivals = [65_534, 1, 65_535, 65_535, 1, 0, 2].map(|n| numbering.arrived(n));
    let new = Arrival::New { lost: 0 };
    assert_eq!(arrivals, [new, Arrival::New { lost: 2 }, new, Arrival::Again, Arrival::Again, new, new]);
    assert_eq!(numbering.lost(), 0);
    // Beyond what is remembered, it is another sender's.
    numbering.arrived(100);
    assert_eq!(numbering.arrived(50), Arrival::Restarted);
    assert_eq!(numbering.lost(), 97);
}

fn hello() -> RobotMessage {
    robot_messages()[0]
}

#[test]
fn a_parameter_answers_only_those_who_asked_for_it() {
    let answer = RobotMessage::Parameter { index: 3, value: 0.5 };
    for (index, answered) in [(3, true), (4, false)] {
        assert_eq!(HostMessage::GetParameter { index }.is_answered_by(&answer), answered);
        assert_eq!(HostMessage::SetParameter { index, value: 1.0 }.is_answered_by(&answer), answered);
        let refused = RobotMessage::Refused(Refusal::BadValue);
        assert!(HostMessage::SetParameter { index, value: 1.0 }.is_answered_by(&refused));
    }
}

#[test]
fn what_was_lost_before_a_robots_hello_is_counted() {
    let vitals = RobotMessage::Vitals(busiest());
    let mut numbering = Numbering::default();
    assert_eq!(numbering.heard(7, &hello()), Arrival::New { lost: 0 }, "whoever comes in late has missed nothing");
    assert_eq!(numbering.heard(8, &vitals), Arrival::New { lost: 0 });
    assert_eq!(numbering.heard(5009, &hello()), Arrival::New { lost: 5000 });
    assert_eq!(numbering.heard(5010, &hello()), Arrival::New { lost: 0 });
    assert_eq!(numbering.lost(), 5000);
}

#[test]
fn a_robots_hello_under_a_number_that_has_passed_is_of_a_robot_that_was_reset() {
    let vitals = RobotMessage::Vitals(busiest());
    for before in [1, 20, 32, 33, 5000] {
        let mut numbering = Numbering::default();
        (0..=before).for_each(|number| assert_eq!(numbering.heard(number, &vitals), Arrival::New { lost: 0 }));
        assert_eq!(numbering.heard(1, &hello()), Arrival::Restarted, "reset after {before}");
        assert_eq!(numbering.heard(2, &vitals), Arrival::New { lost: 0 });
        assert_eq!(numbering.lost(), 0);
    }
}

#[test]
fn a_hosts_hello_begins_its_numbers_anew_and_is_always_carried_out() {
    let (hello, other) = (host_messages()[0], HostMessage::Arm);
    let mut numbering = Numbering::default();
    assert_eq!(numbering.heard(7, &other), Arrival::New { lost: 0 });
    for number in [7, 7, 30_000, 3] {
        assert_ne!(numbering.heard(number, &hello), Arrival::Again);
        assert_eq!(numbering.heard(number + 1, &other), Arrival::New { lost: 0 });
        assert_eq!(numbering.heard(number + 1, &other), Arrival::Again);
    }
    assert_eq!(numbering.lost(), 0);
}

proptest! {
    #[test]
    fn the_decoder_is_in_step_one_frame_after_any_garbage(
        garbage in prop::collection::vec(any::<u8>(), 0..400),
        x in any::<[f32; 2]>().prop_filter("NaN differs from itself", |x| !x[0].is_nan() && !x[1].is_nan()),
    ) {
        let mut buffer = [0; MAX_FRAME];
        let frame = encode(1, &HostMessage::Inclination { x }, &mut buffer).expect("fits").to_vec();
        let mut stream = garbage;
        stream.extend(&frame);
        stream.extend(&frame);
        let last = decode_all::<HostMessage>(&stream).pop();
        prop_assert_eq!(last, Some(Ok((1, HostMessage::Inclination { x }))));
    }

    #[test]
    fn random_bytes_are_never_a_message(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        prop_assert_eq!(decode_all::<RobotMessage>(&bytes).into_iter().flatten().count(), 0);
    }
}
