//! Logs over RTT with defmt. Without the feature `log` nothing of them is left in the image.

#[cfg(feature = "log")]
use defmt_rtt as _;

#[cfg(feature = "log")]
defmt::timestamp!("{=u64:us}", embassy_time::Instant::now().as_micros());

/// Says something worth knowing.
macro_rules! info {
    ($($said:tt)*) => {{
        #[cfg(feature = "log")]
        defmt::info!($($said)*);
        #[cfg(not(feature = "log"))]
        if false {
            let _ = core::format_args!($($said)*);
        }
    }};
}

/// Says something that should not be.
macro_rules! warning {
    ($($said:tt)*) => {{
        #[cfg(feature = "log")]
        defmt::warn!($($said)*);
        #[cfg(not(feature = "log"))]
        if false {
            let _ = core::format_args!($($said)*);
        }
    }};
}

pub(crate) use {info, warning};

/// A value as its `Debug` shows it.
#[cfg(feature = "log")]
pub fn shown<T: core::fmt::Debug>(value: &T) -> defmt::Debug2Format<'_, T> {
    defmt::Debug2Format(value)
}

/// A value as its `Debug` shows it.
#[cfg(not(feature = "log"))]
pub fn shown<T>(_: &T) -> &'static str {
    ""
}
