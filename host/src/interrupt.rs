//! Ctrl-C: what goes on is told to come to its end, and does so in order.

use crate::failure::Failure;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that goes up when somebody presses Ctrl-C, or when the process is told to end. To be asked for once in a process.
///
/// # Errors
/// A system that does not say when that happens.
pub fn flag() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).map_err(Failure::broken)?;
    Ok(stop)
}
