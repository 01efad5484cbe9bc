//! The chapter's claims about the barrel, as `barrel report` judges them: the same runs and the same checks, by other seeds than
//! the report's, and fewer of them.

use barrel::report::campaign::Campaign;
use barrel::report::claim::{Scale, Verdict};
use barrel::report::{claims, judge};
use std::sync::atomic::AtomicBool;

/// Not the seeds that the report shows.
const SCALE: Scale = Scale { quick: true, seed: 7001 };

fn is(name: &str, verdict: Verdict) {
    let claim = claims::find(SCALE, name).unwrap_or_else(|| panic!("the report has no claim '{name}'"));
    let campaign = Campaign { jobs: 1, journal: None, stop: &AtomicBool::new(false), quiet: true };
    let claims = [claim];
    let results = judge(&claims, &campaign).expect("its runs come to their end");
    let finding = &results[0].finding;
    let missed: Vec<_> = finding.checks.iter().filter(|check| !check.holds()).collect();
    assert_eq!(finding.verdict(), verdict, "{}: {missed:#?}", claims[0].title);
    for (caption, figure) in &finding.figures {
        assert!(figure.svg().is_ok_and(|svg| svg.starts_with("<svg")), "no picture: {caption}");
    }
}

macro_rules! claims {
    ($($verdict:ident: $($test:ident $name:literal)*;)*) => {
        $($(#[test] fn $test() { is($name, Verdict::$verdict); })*)*

        /// Every claim of the report has its test.
        #[test]
        fn none_is_left_out() {
            let tested = [$($($name),*),*];
            // The virtual board's runs are in on_board.rs, over more of what it does.
            let untested: Vec<_> = claims::all(SCALE)
                .iter()
                .map(|claim| claim.name)
                .filter(|name| !tested.contains(name) && *name != "virtual-board")
                .collect();
            assert!(untested.is_empty(), "{untested:?}");
        }
    };
}

claims! {
    Holds:
    a_slow_drive_locks_the_rolling_and_a_fast_one_loses_it "locking"
    doubling_the_drive_loses_the_lock_and_a_push_brings_it_back "doubling"
    noise_moves_the_barrel_nowhere "noise-drive"
    a_rotation_rolls_the_barrel_faster_the_larger_it_is "rolling-speed"
    the_rolling_recovers_from_pushes_and_from_a_start_backwards "recovery"
    the_model_follows_every_switch_of_the_controller "model"
    the_controller_finds_the_rotation_that_fits_its_model "controller"
    a_scattered_controller_is_brought_back_by_its_model "scatter"
    homeostatic_control_rests_until_a_kick_and_then_sweeps_on "rest-and-kick"
    a_slower_model_keeps_a_direction_longer "slow-model"
    large_rates_come_to_rest "large-rates"
    one_setting_shows_all_of_experiment_2_2 "one-setting"

    homeokinetic_control_leaves_rest_and_sweeps "sweep"
    held_and_let_go_the_barrel_goes_on "held"
    the_rates_set_how_long_a_behaviour_lasts "rates"
    forgetting_turns_the_sweep_round "forgetting"
    a_controller_that_knows_nothing_is_driven_away "tabula-rasa"
    the_upright_barrel_topples_itself "toppling"
    the_upright_barrel_comes_to_precess "precession"
    a_precession_decays_where_nothing_keeps_the_controller "precession-decay"
    a_model_without_response_repels "no-model"
    the_key_claims_hold_with_everything_varied_by_a_fifth "robustness"
    the_tabletop_robot_does_the_same "tabletop"
    the_brain_takes_hold_of_a_chain_of_pendulums "chain"
    fewer_sensors_than_motors_make_a_wave "chain-wave";

    // Where a claim holds in part, its note says which part and why.
    Partly:
    random_controllers_find_rest_rounds_and_rocking_but_few_that_stay_on_the_ground "random-controllers"
    most_redrawn_controllers_come_to_rest_on_a_floor_that_holds "figure-8"
    saturation_repels_unless_it_is_very_deep "saturation";

    // Searches: they tell and do not judge.
    NotJudged:
    what_it_takes_to_topple "toppling-search"
    what_precession_hangs_on "precession-search";
}
