//! What the robot keeps without power, on the virtual board: after a cut at any moment it has the old record or the new one,
//! and no motor is ever driven.

use barrel_tests::board::{Bench, image};
use hil_sim::coupling::Coupling;
use hil_sim::virtual_board::Trouble;
use protocol::message::{MemoryState, Refusal, ResetCause};
use protocol::{HostMessage, Id, RobotMessage};

const OLD: f32 = 0.07;
const NEW: f32 = 0.23;

fn set(bench: &mut Bench, value: f32) {
    let answer = bench.ask(HostMessage::SetParameter { index: Id::EpsA.index(), value });
    assert_eq!(answer, RobotMessage::Parameter { index: Id::EpsA.index(), value });
}

fn get(bench: &mut Bench) -> f32 {
    match bench.ask(HostMessage::GetParameter { index: Id::EpsA.index() }) {
        RobotMessage::Parameter { value, .. } => value,
        other => panic!("{other:?}"),
    }
}

fn power_cycle(bench: &mut Bench) -> MemoryState {
    bench.board().board.power_cycle().expect("comes up again");
    let identity = bench.hello();
    assert_eq!(identity.reset, ResetCause::PowerOn);
    identity.memory
}

#[test]
fn parameters_outlive_resets_and_power_cycles_until_they_are_forgotten() {
    let mut bench = Bench::power_on(&image(), "homeokinetic", 1, &[]);
    assert_eq!(bench.hello().memory, MemoryState::Empty);
    let default = get(&mut bench);
    set(&mut bench, OLD);
    assert_eq!(power_cycle(&mut bench), MemoryState::Empty);
    assert_eq!(get(&mut bench), default, "what was not stored is gone");

    set(&mut bench, OLD);
    assert_eq!(bench.ask(HostMessage::Store), RobotMessage::Stored);
    set(&mut bench, NEW);
    bench.board().board.reset().expect("reset");
    let identity = bench.hello();
    assert_eq!((identity.reset, identity.memory), (ResetCause::Pin, MemoryState::Loaded));
    assert_eq!(get(&mut bench), OLD);
    assert_eq!(power_cycle(&mut bench), MemoryState::Loaded);
    assert_eq!(get(&mut bench), OLD);

    assert_eq!(bench.ask(HostMessage::Forget), RobotMessage::Stored);
    assert_eq!(get(&mut bench), OLD, "what is in use stays so");
    assert_eq!(power_cycle(&mut bench), MemoryState::Empty);
    assert_eq!(get(&mut bench), default);
    assert_eq!(bench.board().driven, 0, "nobody asked for the motors");
}

#[test]
fn a_power_cut_in_the_middle_of_a_write_leaves_the_old_record_or_the_new_one() {
    let mut bench = Bench::power_on(&image(), "homeokinetic", 1, &[]);
    set(&mut bench, OLD);
    assert_eq!(bench.ask(HostMessage::Store), RobotMessage::Stored);
    let (mut old, mut new) = (0, 0);
    // The whole record and beyond, in strides of a prime number; the library's own test cuts at every byte.
    for after in (0..8).chain((8..480).step_by(37)) {
        set(&mut bench, NEW);
        bench.board().board.trouble(Trouble::CutFram(after)).expect("will be cut");
        let frame = bench.robot.request(&HostMessage::Store, &mut bench.world);
        let cut = bench.board().pins().fram_cut;
        if !cut {
            assert_eq!(frame.expect("an answer").message, RobotMessage::Stored, "cut after {after} bytes");
        }
        let memory = power_cycle(&mut bench);
        assert_eq!(memory, MemoryState::Loaded, "cut after {after} bytes");
        let value = get(&mut bench);
        match value {
            OLD => old += 1,
            NEW => new += 1,
            _ => panic!("cut after {after} bytes it holds {value}"),
        }
        assert!(cut || value == NEW, "it said that it had stored it");
        set(&mut bench, OLD);
        assert_eq!(bench.ask(HostMessage::Store), RobotMessage::Stored);
    }
    assert!(old > 5 && new > 0, "{old} times the old record, {new} times the new one");
    assert_eq!(bench.board().driven, 0, "nobody asked for the motors");
}

#[test]
fn what_is_lost_on_the_memorys_bus_is_written_again_or_admitted() {
    let mut bench = Bench::power_on(&image(), "homeokinetic", 1, &[]);
    set(&mut bench, OLD);
    assert_eq!(bench.ask(HostMessage::Store), RobotMessage::Stored);
    let (mut stored, mut refused) = (0, 0);
    for lost in (1..12).chain([200]) {
        set(&mut bench, NEW);
        bench.board().board.trouble(Trouble::LoseFram(lost)).expect("lost");
        let said_to_be = match bench.ask(HostMessage::Store) {
            RobotMessage::Stored => {
                stored += 1;
                [NEW, NEW]
            }
            RobotMessage::Refused(Refusal::NoMemory) => {
                refused += 1;
                [OLD, NEW]
            }
            other => panic!("{other:?}"),
        };
        assert_eq!(power_cycle(&mut bench), MemoryState::Loaded, "{lost} lost");
        let value = get(&mut bench);
        assert!(said_to_be.contains(&value), "{lost} lost: it holds {value}");
        set(&mut bench, OLD);
        assert_eq!(bench.ask(HostMessage::Store), RobotMessage::Stored);
    }
    assert!(stored > 0 && refused > 0, "{stored} times stored, {refused} times refused");
}

#[test]
fn bits_that_the_memorys_bus_gets_wrong_are_written_again_or_admitted() {
    let mut bench = Bench::power_on(&image(), "homeokinetic", 1, &[]);
    set(&mut bench, OLD);
    assert_eq!(bench.ask(HostMessage::Store), RobotMessage::Stored);
    for bit in 0..8 {
        set(&mut bench, NEW);
        bench.board().board.trouble(Trouble::FlipFram(1 << bit)).expect("flipped");
        assert_eq!(bench.ask(HostMessage::Store), RobotMessage::Stored, "one wrong bit is made good");
        assert_eq!(power_cycle(&mut bench), MemoryState::Loaded);
        assert_eq!(get(&mut bench), NEW, "bit {bit}");
        set(&mut bench, OLD);
        assert_eq!(bench.ask(HostMessage::Store), RobotMessage::Stored);
    }
}

#[test]
fn a_reset_in_the_middle_of_a_write_leaves_the_old_record_or_the_new_one() {
    let mut bench = Bench::power_on(&image(), "homeokinetic", 1, &[]);
    set(&mut bench, OLD);
    assert_eq!(bench.ask(HostMessage::Store), RobotMessage::Stored);
    let (mut old, mut new) = (0, 0);
    for after in (0..8).chain((8..480).step_by(37)) {
        set(&mut bench, NEW);
        let resets = bench.board().pins().resets;
        bench.board().board.trouble(Trouble::ResetInWrite(after)).expect("will be reset");
        bench.robot.send(&HostMessage::Store);
        bench.pass(50);
        let reset = bench.board().pins().resets > resets;
        let identity = bench.hello();
        assert_eq!(identity.memory, MemoryState::Loaded, "reset after {after} bytes");
        match get(&mut bench) {
            OLD => old += 1,
            NEW => new += 1,
            value => panic!("reset after {after} bytes it holds {value}"),
        }
        assert!(reset || after > 300, "the record has more than {after} bytes");
        if !reset {
            // The write was over before; the reset that waits for the next one is not to come.
            power_cycle(&mut bench);
        }
        set(&mut bench, OLD);
        assert_eq!(bench.ask(HostMessage::Store), RobotMessage::Stored);
    }
    assert!(old > 5 && new > 0, "{old} times the old record, {new} times the new one");
    assert_eq!(bench.board().driven, 0, "nobody asked for the motors");
}

#[test]
fn power_that_goes_while_the_robot_rolls_and_stores_leaves_it_off_with_the_old_record_or_the_new_one() {
    let mut bench = Bench::start(&image(), "closed-loop", 1, &[("omega0", 2.0), ("epsA", f64::from(OLD))]);
    assert_eq!(bench.ask(HostMessage::Store), RobotMessage::Stored);
    set(&mut bench, NEW);
    bench.board().board.trouble(Trouble::CutFram(100)).expect("will be cut");
    bench.robot.send(&HostMessage::Store);
    bench.board().driven = 0;
    let mut waited = 0;
    while !bench.board().pins().fram_cut {
        bench.pass(1);
        waited += 1;
        assert!(waited < 50, "it does not store while it is Armed");
    }
    assert_eq!(bench.board().driven, waited, "storing does not stop the servo");
    bench.board().board.power_cycle().expect("comes up again");
    assert!(!bench.board().pins().enabled_meanwhile, "driven in the first millisecond");
    bench.board().driven = 0;
    bench.pass(200);
    assert_eq!(bench.board().driven, 0);
    assert_eq!(bench.hello().memory, MemoryState::Loaded);
    assert_eq!(get(&mut bench), OLD);
}
