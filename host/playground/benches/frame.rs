//! Time of a frame.
fn main() {}
