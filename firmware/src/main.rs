//! The flash image: wiring. What runs, at which priority:
//!
//! ```text
//! highest     embassy             the clock, and the end of the inertial sensor's transfer: they wake the servo
//! interrupt   tasks::servo        1 kHz: sensors ─► Robot::servo_tick ─► motors; owns the robot; the brain every 20th tick
//! thread      tasks::wire    ×2   bytes of a UART ─► messages ─► servo;  answers and telemetry ─► UART
//!             tasks::storage      keeps parameters and calibration in the FRAM
//!             tasks::panel        lamps, battery
//! ```
//!
//! Commands are carried out, and the brain steps, inside a servo tick: the robot has one owner and no lock, and events come in the
//! order in which they come in process. What takes longer, parsing and framing messages and the memory, is below.
//!
//! Every decision is the library's ([`firmware::Robot`]); a motor pin is moved in one place, [`board::Axes`].
#![no_std]
#![no_main]

mod board;
mod log;
mod tasks;

use cortex_m_rt::entry;
use embassy_executor::InterruptExecutor;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use firmware::Robot;
use firmware::robot::Boot;

use tasks::shared::Port;

/// The number format of the brain.
#[cfg(not(feature = "fixed"))]
type Brain = f32;
/// The number format of the brain.
#[cfg(feature = "fixed")]
type Brain = firmware::scalar::Fixed16;

static SERVO: InterruptExecutor = InterruptExecutor::new();

/// A line that this board does not use otherwise: the servo runs in its handler.
#[interrupt]
#[allow(unsafe_code)]
unsafe fn UART5() {
    // SAFETY: this is the executor's handler, and the line is enabled by its start only.
    unsafe { SERVO.on_interrupt() }
}

#[entry]
fn main() -> ! {
    let reset = board::crash::cause();
    let board = board::start();
    // The memory answers 250 µs after power-on at the latest (FM25V02, AC table).
    cortex_m::asm::delay(board::CORE_HZ / 1000);
    let (fram, memory, record) = tasks::storage::open(board.fram);
    log::info!("start after {}, memory {}", log::shown(&reset), log::shown(&memory));
    let robot = Robot::new(&Boot { reset, memory, record });

    interrupt::UART5.set_priority(Priority::P6);
    let servo = SERVO.start(interrupt::UART5);
    servo.spawn(
        tasks::servo::servo(robot, board.imu, board.axes, board.stop, board.supply, board.watchdog).expect("one servo"),
    );
    tasks::idle::run(|spawner| {
        spawner.spawn(tasks::wire::wire(Port::Usb, board.usb).expect("two wires"));
        spawner.spawn(tasks::wire::wire(Port::Radio, board.radio).expect("two wires"));
        spawner.spawn(tasks::storage::storage(fram).expect("one storage"));
        spawner.spawn(tasks::panel::panel(board.lamps, board.battery).expect("one panel"));
    })
}
