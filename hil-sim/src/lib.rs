//! The simulated barrel, the links that close the loop around the firmware, and the run in which they meet.
//!
//! * [`plant`]: the barrel as physics sees it. [`transducers`]: its sensors; [`sensors`]: those of one run.
//! * [`experiment`], [`setup`], [`schedule`]: what a run is made of.
//! * [`link`]: how the host reaches a robot. [`world`]: barrel, sensors and pushes on one clock. [`coupling`]: the two together.
//! * [`run`]: one run of world and robot, the room where everything meets; [`record`] and [`measure`] take it down.
//! * [`replay`]: a recording held against the robot's code.
//! * [`chain`]: another body for the same brain.

pub mod chain;
pub mod coupling;
pub mod experiment;
pub mod link;
pub mod measure;
pub mod plant;
pub mod record;
pub mod replay;
pub mod run;
pub mod schedule;
pub mod sensors;
pub mod setup;
pub mod transducers;
#[cfg(feature = "virtual-board")]
pub mod virtual_board;
pub mod world;
