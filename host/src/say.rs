//! Words for the person: standard output, without the panic of `println` when nobody reads on, as in `barrel list | head`.

/// As `println`, but a reader who has gone is no error.
macro_rules! say {
    ($($words:tt)*) => {{
        use std::io::Write;
        let _ = writeln!(std::io::stdout(), $($words)*);
    }};
}
