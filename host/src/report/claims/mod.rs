//! The claims of the chapter about the barrel, in its order, one file for each experiment.
//!
//! The settings are the chapter's where it gives them and the presets' (`barrel list`) elsewhere; each claim's method says where
//! it leaves them.

mod beyond;
mod closed_loop;
mod homeokinetic;
mod homeostatic;
mod learning;
mod open_loop;
mod repellers;
mod robustness;
mod upright;

use super::case::Case;
use super::claim::{Claim, Scale};

/// Every claim, in the chapter's order.
pub fn all(scale: Scale) -> Vec<Claim> {
    [
        open_loop::claims(scale),
        closed_loop::claims(scale),
        learning::claims(scale),
        homeostatic::claims(scale),
        homeokinetic::claims(scale),
        upright::claims(scale),
        repellers::claims(scale),
        robustness::claims(scale),
        beyond::claims(scale),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// The claim with this name.
pub fn find(scale: Scale, name: &str) -> Option<Claim> {
    all(scale).into_iter().find(|claim| claim.name == name)
}

/// A case for each item and seed: all seeds of the first item, then all of the second.
fn each<T: Copy>(items: &[T], seeds: core::ops::Range<u64>, case: impl Fn(T, u64) -> Case) -> Vec<Case> {
    items.iter().flat_map(|item| seeds.clone().map(|seed| case(*item, seed)).collect::<Vec<_>>()).collect()
}

/// `--set` of C = c U(φ), to six decimals.
fn rotation(c: f64, phi: f64) -> String {
    format!("--set coupling1={} --set coupling2={}", decimals(c * phi.cos()), decimals(-c * phi.sin()))
}

/// `--at` of the same, at a time.
fn rotation_at(t: f64, c: f64, phi: f64) -> String {
    format!("--at {t}:coupling1={} --at {t}:coupling2={}", decimals(c * phi.cos()), decimals(-c * phi.sin()))
}

/// A number to six decimals, without zeros at the end: what a line says is what is run.
fn decimals(number: f64) -> f64 {
    (number * 1e6).round() / 1e6
}
