//! Every state the safety machine can get into is walked through, with every event and every kind of tick in each.

use std::collections::{BTreeMap, VecDeque};

use firmware::safety::{Event, FAULT_CODES, Faults, Health, Outputs, Safety};
use protocol::message::{FaultCode, Refusal, SafetyState};

const SENSORS: usize = 2;
/// Short, so that the walk sees every age of every sensor.
const LIMITS: [u16; SENSORS] = [0, 2];
const GOOD: Health<SENSORS> = Health { fresh: [true; SENSORS], faults: Faults::NONE };

/// Whatever can be done to the machine.
#[derive(Clone, Copy, Debug)]
enum Step {
    Handle(Event),
    Tick(Health<SENSORS>),
}

fn steps() -> Vec<Step> {
    let mut steps: Vec<Step> = [Event::Arm, Event::Disarm, Event::EmergencyStop, Event::ClearFault]
        .into_iter()
        .chain(FAULT_CODES.into_iter().map(Event::Fault))
        .map(Step::Handle)
        .collect();
    for fresh in [[true, true], [true, false], [false, true], [false, false]] {
        let found = FAULT_CODES.into_iter().map(|code| Faults::NONE.with(code));
        for faults in std::iter::once(Faults::NONE).chain(found) {
            steps.push(Step::Tick(Health { fresh, faults }));
        }
    }
    steps
}

/// Checks every claim about one step from one state and returns the state after it.
fn take(before: &Safety<SENSORS>, step: Step) -> Safety<SENSORS> {
    let mut after = before.clone();
    match step {
        Step::Handle(event) => {
            let answer = after.handle(event);
            let in_fault = matches!(before.state(), SafetyState::Fault(_));
            match event {
                Event::Arm if in_fault => {
                    assert_eq!(answer, Err(Refusal::InFault));
                    assert_eq!(&after, before, "a refused command changes nothing");
                }
                Event::Arm => assert_eq!(answer, Ok(SafetyState::Armed)),
                Event::Disarm if in_fault => assert_eq!(answer, Ok(before.state())),
                Event::Disarm => assert_eq!(answer, Ok(SafetyState::Disarmed)),
                Event::ClearFault if in_fault => assert_eq!(answer, Ok(SafetyState::Disarmed)),
                Event::ClearFault => assert_eq!(answer, Ok(before.state())),
                Event::EmergencyStop => assert!(after.faults().contains(FaultCode::EmergencyStop)),
                Event::Fault(code) => assert!(after.faults().contains(code)),
            }
            if event != Event::ClearFault {
                assert!(before.faults().iter().all(|code| after.faults().contains(code)), "a fault was lost");
            }
        }
        Step::Tick(health) => {
            let moved = after.tick(&health).map(|armed| armed.drive([0.5, -0.25]));
            let outputs = moved.as_ref().map_or([0.0; 2], Outputs::duty);
            match (before.state(), after.state()) {
                (SafetyState::Armed, SafetyState::Armed) => {
                    assert!(health.faults.is_empty(), "{health:?} went by");
                    assert!(health.fresh[0], "sensor 1 may not miss a tick");
                    assert_eq!(outputs, [0.5, -0.25]);
                }
                (_, SafetyState::Armed) => panic!("a tick armed the robot"),
                (_, SafetyState::Disarmed | SafetyState::Fault(_)) => {
                    assert!(moved.is_none(), "outputs without being armed");
                }
            }
            for code in health.faults.iter() {
                let idle = code == FaultCode::StalledAxis && before.state() != SafetyState::Armed;
                assert!(idle || after.faults().contains(code), "{code:?} was lost");
            }
            assert!(before.faults().iter().all(|code| after.faults().contains(code)), "a fault was lost");
        }
    }
    if let (SafetyState::Fault(first), SafetyState::Fault(now)) = (before.state(), after.state()) {
        assert_eq!(first, now, "the first code is the one that is shown");
    }
    if let SafetyState::Fault(code) = after.state() {
        assert!(after.faults().contains(code));
    } else {
        assert!(after.faults().is_empty());
        if matches!(before.state(), SafetyState::Fault(_)) {
            assert!(matches!(step, Step::Handle(Event::ClearFault)), "{step:?} left Fault");
            assert_eq!(after.state(), SafetyState::Disarmed);
        }
    }
    if after.state() == SafetyState::Armed && before.state() != SafetyState::Armed {
        assert!(matches!(step, Step::Handle(Event::Arm)), "{step:?} armed the robot");
    }
    after
}

#[test]
fn no_path_moves_a_motor_unless_armed_and_none_loses_a_fault() {
    let steps = steps();
    let mut seen = BTreeMap::new();
    let mut open = VecDeque::new();
    for cause in std::iter::once(None).chain(FAULT_CODES.into_iter().map(Some)) {
        open.push_back(Safety::new(LIMITS, cause));
    }
    let mut taken = 0;
    while let Some(state) = open.pop_front() {
        if seen.insert(format!("{state:?}"), ()).is_some() {
            continue;
        }
        for step in &steps {
            taken += 1;
            open.push_back(take(&state, *step));
        }
    }
    println!("{} states, {taken} steps", seen.len());
    // Two ages of sensor 1 and four of sensor 2; in Fault, eleven first codes with any set of the other ten.
    let (ages, faults) = (2 * 4, 11 * 1024);
    assert!(seen.len() > faults && seen.len() <= ages * (faults + 2), "{} states", seen.len());
}

#[test]
fn every_fault_takes_the_outputs_away_in_the_same_tick() {
    for code in FAULT_CODES {
        let mut safety = Safety::new(LIMITS, None);
        safety.handle(Event::Arm).expect("disarmed");
        assert!(safety.tick(&GOOD).is_some());
        assert!(safety.tick(&Health { faults: Faults::NONE.with(code), ..GOOD }).is_none());
        assert_eq!(safety.state(), SafetyState::Fault(code));
        assert!(safety.tick(&GOOD).is_none(), "a fault does not go away by itself");
        assert_eq!(safety.handle(Event::Arm), Err(Refusal::InFault));
        assert_eq!(safety.handle(Event::ClearFault), Ok(SafetyState::Disarmed));
        assert!(safety.tick(&GOOD).is_none(), "clearing does not arm");
        assert_eq!(safety.handle(Event::Arm), Ok(SafetyState::Armed));
        assert!(safety.tick(&GOOD).is_some());
    }
}

#[test]
fn a_sensor_is_stale_one_tick_after_its_limit() {
    for limit in [0u16, 1, 10, 999] {
        let mut safety = Safety::new([limit], None);
        safety.handle(Event::Arm).expect("disarmed");
        let blind = Health { fresh: [false], faults: Faults::NONE };
        for tick in 0..limit {
            assert!(safety.tick(&blind).is_some(), "tick {tick} of {limit}");
        }
        assert!(safety.tick(&blind).is_none());
        assert_eq!(safety.state(), SafetyState::Fault(FaultCode::StaleSensor));
        // Cleared, but still blind: the fault is back as soon as the limit is over again.
        safety.handle(Event::ClearFault).expect("in fault");
        for _ in 0..=limit {
            assert_eq!(safety.state(), SafetyState::Disarmed);
            assert!(safety.tick(&blind).is_none());
        }
        assert_eq!(safety.state(), SafetyState::Fault(FaultCode::StaleSensor));
    }
}

#[test]
fn a_reading_in_time_starts_the_count_afresh() {
    let mut safety = Safety::new([3], None);
    safety.handle(Event::Arm).expect("disarmed");
    for tick in 0..1000 {
        let health = Health { fresh: [tick % 4 == 3], faults: Faults::NONE };
        assert!(safety.tick(&health).is_some(), "tick {tick}");
    }
}

#[test]
fn a_duty_that_is_not_a_number_faults_at_once() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut safety = Safety::new(LIMITS, None);
        safety.handle(Event::Arm).expect("disarmed");
        let outputs = safety.tick(&GOOD).expect("armed").drive([0.5, bad]);
        assert_eq!(outputs, Outputs::ZERO);
        assert_eq!(safety.state(), SafetyState::Fault(FaultCode::NonFinite));
    }
}

#[test]
fn duties_are_cut_off_at_one() {
    let mut safety = Safety::new(LIMITS, None);
    safety.handle(Event::Arm).expect("disarmed");
    assert_eq!(safety.tick(&GOOD).expect("armed").drive([7.0, -1.5]).duty(), [1.0, -1.0]);
}

#[test]
fn an_idle_axis_does_not_stall() {
    let mut safety = Safety::new(LIMITS, None);
    let stalled = Health { faults: Faults::NONE.with(FaultCode::StalledAxis), ..GOOD };
    assert!(safety.tick(&stalled).is_none());
    assert_eq!(safety.state(), SafetyState::Disarmed);
}

#[test]
fn of_several_faults_in_a_tick_the_most_urgent_is_shown_and_all_are_kept() {
    let mut all = Faults::NONE;
    for code in FAULT_CODES {
        all = all.with(code);
    }
    let mut safety = Safety::new(LIMITS, None);
    safety.handle(Event::Arm).expect("disarmed");
    assert!(safety.tick(&Health { faults: all, ..GOOD }).is_none());
    assert_eq!(safety.state(), SafetyState::Fault(FaultCode::EmergencyStop));
    assert_eq!(safety.faults().iter().collect::<Vec<_>>(), FAULT_CODES);
}

#[test]
fn a_reset_by_the_watchdog_starts_in_fault() {
    for code in [FaultCode::Watchdog, FaultCode::Panic, FaultCode::HardFault, FaultCode::BrownOut] {
        let mut safety = Safety::new(LIMITS, Some(code));
        assert_eq!(safety.state(), SafetyState::Fault(code));
        assert_eq!(safety.handle(Event::Arm), Err(Refusal::InFault));
    }
    assert_eq!(Safety::new(LIMITS, None).state(), SafetyState::Disarmed);
}
