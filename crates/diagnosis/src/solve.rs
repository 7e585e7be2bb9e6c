//! From binned residuals to the models that explain them: search, look for what passes for scatter, sharpen shapes, estimate the
//! noise anew, until nothing changes.

mod run_ratio;
mod running_on;
mod sharpen;
mod state;
mod steps;
mod wandering;
mod weigh;

use gearmodel::effect::NominalRig;

use super::grid::Grid;
use super::options::Options;
use super::taken_off::TakenOff;
use state::State;

pub(crate) use state::Solution;

/// The models that a residual allows, with the noise and the design matrix that they were weighed in.
pub(crate) fn solve<'a>(rig: &'a NominalRig, grid: Grid, taken_off: TakenOff, options: &'a Options) -> Solution<'a> {
    let settings = &options.settings.search;
    let mut state = State::new(rig, grid, taken_off, options);
    for round in 0..settings.rounds {
        state.search();
        let changed = sharpen::sharpen(&mut state)
            | steps::look_for_steps(&mut state)
            | (round == 0 && running_on::look_for_what_runs_on(&mut state))
            | (round == 0 && wandering::look_for_wandering_waves(&mut state));
        let before = state.noise.floor_rad2();
        run_ratio::estimate_noise(&mut state);
        let moved = (state.noise.floor_rad2() / before).ln().abs();
        if round > 0 && !changed && moved < settings.floor_moved {
            break;
        }
    }
    state.finish()
}
