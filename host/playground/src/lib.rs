//! The playground: a window on a barrel, to see it, push it and turn its knobs.
//!
//! A [`session`] runs in a thread of its own, around a simulated barrel or a robot on a line, and tells the window ([`app`]) what
//! it does in [`channel::Frame`]s, one for each control step; the window asks for things in [`order::Order`]s. [`history`] keeps the
//! frames; [`scene`], [`plots`] and [`matrix`] show them; [`knobs`], [`guide`], [`keys`] and [`drawer`] make orders.

pub mod app;
pub mod channel;
pub mod drawer;
pub mod film;
pub mod guide;
pub mod help;
pub mod history;
pub mod keys;
pub mod knobs;
pub mod matrix;
pub mod order;
pub mod picture;
pub mod plots;
pub mod recording;
pub mod scene;
pub mod session;
pub mod theme;
