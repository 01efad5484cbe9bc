//! Keeps parameters and calibration in the FRAM: read once at the start, written when a host asks for it. Writing
//! and reading back takes some milliseconds on a bus of its own, below the servo, which does not notice.

use firmware::fram::Fram;
use firmware::robot::Errand;
use firmware::storage::{self, MemoryError, Record};
use protocol::RobotMessage;
use protocol::message::MemoryState;

use crate::board::FramSpi;
use crate::log;
use crate::tasks::shared::{ERRANDS, OUTBOX, Outgoing};

/// Finds the memory and what is in it.
pub fn open(spi: FramSpi) -> (Option<Fram<FramSpi>>, MemoryState, Option<Record>) {
    match Fram::probe(spi) {
        Ok(mut fram) => {
            let (state, record) = storage::load(&mut fram);
            (Some(fram), state, record)
        }
        Err(_) => (None, MemoryState::Absent, None),
    }
}

/// Sees to what the robot wants kept.
#[embassy_executor::task]
pub async fn storage(mut fram: Option<Fram<FramSpi>>) {
    loop {
        let (port, errand) = ERRANDS.receive().await;
        let done = match (&mut fram, &errand) {
            (Some(fram), Errand::Store(record)) => storage::save(fram, record),
            (Some(fram), Errand::Forget) => storage::forget(fram),
            (None, _) => Err(MemoryError::NoAnswer),
        };
        let answer = match done {
            Ok(()) => RobotMessage::Stored,
            Err(error) => {
                log::warning!("storing failed");
                RobotMessage::Refused(error.into())
            }
        };
        port.of(&OUTBOX).send(Outgoing::Answer(answer)).await;
    }
}
