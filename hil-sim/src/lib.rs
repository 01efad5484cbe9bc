//! The simulated barrel, the links that close the loop around the firmware, and the run in which they meet.
//!
//! * [`plant`]: the barrel as physics sees it. [`transducers`]: its sensors; [`sensors`]: those of one run.
//! * [`experiment`], [`setup`]: what a run is made of.
//! * [`link`]: how the host reaches a robot.
//! * [`run`]: plant and robot in lock-step, the room where everything meets; [`record`] and [`measure`] take it down.
//! * [`replay`]: a recording held against the robot's code.

pub mod experiment;
pub mod link;
pub mod measure;
pub mod plant;
pub mod record;
pub mod replay;
pub mod run;
pub mod sensors;
pub mod setup;
pub mod transducers;
