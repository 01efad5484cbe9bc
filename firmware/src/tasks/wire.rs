//! A UART and its host: bytes in, messages to the servo; answers and telemetry out, as frames. Nobody waits for it.

use core::sync::atomic::Ordering::Relaxed;

use embassy_futures::select::{Either, select};
use firmware::port::Incoming;
use protocol::frame::MAX_FRAME;

use crate::board::Uart;
use crate::tasks::shared::{GARBLED, INBOX, OUTBOX, Outgoing, Port};

/// Room for the answers to one request, which are sent again as one piece.
const ANSWERS: usize = 2 * MAX_FRAME;

/// Serves one port for ever.
#[embassy_executor::task(pool_size = 2)]
pub async fn wire(id: Port, mut uart: Uart) {
    let mut port = firmware::Port::default();
    let mut arrived = [0; 64];
    // Whatever a listener has caught of an earlier start ends here.
    uart.send(&[0]).await;
    loop {
        match select(uart.receive(&mut arrived), id.of(&OUTBOX).receive()).await {
            Either::First(count) => {
                for &byte in arrived.iter().take(count) {
                    let mut again = heapless::Vec::<u8, ANSWERS>::new();
                    match port.push(byte) {
                        None => {}
                        // The servo takes two of them in every tick: this waits for milliseconds at most, and the ring
                        // holds what arrives meanwhile.
                        Some(Incoming::Request(message)) => INBOX.send((id, message)).await,
                        Some(Incoming::Again(frames)) => {
                            let _ = again.extend_from_slice(frames);
                        }
                    }
                    if !again.is_empty() {
                        uart.send(&again).await;
                    }
                }
                id.of(&GARBLED).store(port.garbled(), Relaxed);
            }
            Either::Second(outgoing) => {
                let mut buffer = [0; MAX_FRAME];
                let frame = match outgoing {
                    Outgoing::Answer(reply) => port.answer(&reply, &mut buffer),
                    Outgoing::Announcement(message) => port.announce(&message, &mut buffer),
                };
                uart.send(frame).await;
            }
        }
    }
}
