//! The report: every claim of the chapter about the barrel, run and judged.
//!
//! | file | what it holds |
//! |---|---|
//! | [`claims`] | the claims: what is run for each, and the numbers that decide |
//! | [`claim`] | what a claim, a check and a finding are |
//! | [`case`] | one command line and what came of it |
//! | [`campaign`] | many cases on all cores, resumed after an interruption |
//! | [`statistics`] | many numbers in one |
//! | [`figure`] | pictures |
//! | [`page`] | the HTML |
//! | [`data`] | the JSON |

pub mod campaign;
pub mod case;
pub mod claim;
pub mod claims;
pub mod data;
pub mod figure;
pub mod page;
pub mod statistics;

use crate::failure::Failure;
use campaign::{Campaign, Outcomes};
use case::Outcome;
use claim::{Claim, Finding};

/// A claim with what its runs show.
pub struct Result<'c> {
    /// The claim.
    pub claim: &'c Claim,
    /// The outcomes of its cases, in their order.
    pub outcomes: Vec<Outcome>,
    /// What they show.
    pub finding: Finding,
}

/// Runs all that the claims need and judges them.
///
/// # Errors
/// Those of [`Campaign::run`].
pub fn judge<'c>(claims: &'c [Claim], campaign: &Campaign) -> core::result::Result<Vec<Result<'c>>, Failure> {
    let outcomes: Outcomes = campaign.run(claims.iter().flat_map(|claim| &claim.cases))?;
    let result = |claim: &'c Claim| {
        let outcomes: Vec<Outcome> = claim.cases.iter().map(|case| outcomes[&case.key()].clone()).collect();
        let finding = claim.judge(&outcomes);
        Result { claim, outcomes, finding }
    };
    Ok(claims.iter().map(result).collect())
}
