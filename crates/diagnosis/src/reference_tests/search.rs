//! Search against all subsets: of at most eight blocks the posterior of every set is
//!
//! ```text
//! score = log evidence + Σ log prior,   prior odds 0.04 an effect, 0.15 all patterns together,
//! w_m ∝ exp(score_m − best),     p(effect) = Σ of the weights of the sets that contain it
//! ```

use gearmodel::effect::{LIBRARY, NominalRig};

use super::support::{
    Random, TRUTH, Truth, add_trace, draw, effect, estimate, full, grid, level, order, pool, rig, uneven,
};
use crate::design_matrix::{Candidate, DesignMatrix};
use crate::evidence::{Fit, fit};
use crate::grid::Grid;
use crate::noise::Whitened;
use crate::nuisance_patterns::Weight;
use crate::posterior::posterior;
use crate::search::{Model, Search};
use crate::settings::Settings;
use gearmodel::Direction::{Ccw, Cw};

/// The exponent of the weights.
const SHARPNESS: f64 = 1.0;
/// What a search does not look at lies further below the best, nats: by what a scan expects of it.
const COMPETING_NATS: f64 = 9.0;

/// Blocks wider than this are scanned coarsely.
fn wide() -> usize {
    Settings::default().evidence.wide_columns
}

/// A search with nothing known and nothing cut out.
fn search_in<'a>(pool: &'a DesignMatrix, whitened: &'a Whitened) -> Search<'a> {
    Search::new(pool, whitened, &[], 0.0, &Settings::default())
}

/// Scores of all subsets, best first.
fn all_subsets(pool: &DesignMatrix, whitened: &Whitened) -> Vec<Model> {
    let count = pool.blocks.len();
    let patterns = pool.blocks.iter().filter(|b| matches!(b.candidate, Candidate::Unknown(_))).count() as f64;
    let prior = |block: usize| match &pool.blocks[block].candidate {
        Candidate::Effect { cost_nats, .. } => 0.04_f64.ln() - cost_nats,
        Candidate::Unknown(pattern) => (0.15 / patterns).ln() - pattern.cost_nats(&Settings::default()),
    };
    // A part larger than three times the residual, which another cancels, is no explanation.
    let possible = |fit: &Fit| (0..fit.set.len()).all(|n| fit.rms_rad(pool, n) < 3.0 * pool.residual_rms_rad());
    let rest = -0.5 * whitened.log_det - 0.5 * whitened.gram[(0, 0)];
    let mut models: Vec<Model> = (0..1_usize << count)
        .filter_map(|bits| {
            let set: Vec<usize> = (0..count).filter(|b| bits >> b & 1 == 1).collect();
            let fit = fit(pool, whitened, &set, &[])?;
            let score = rest + fit.log_evidence + set.iter().map(|b| prior(*b)).sum::<f64>();
            possible(&fit).then_some(Model { fit, score })
        })
        .collect();
    models.sort_by(|a, b| b.score.total_cmp(&a.score));
    models
}

/// Effects that look like one another and like the patterns: orders 1 and 2 of either shaft, levels; and one more.
fn candidates(rig: &NominalRig, grid: &Grid, last: Candidate) -> Vec<Candidate> {
    vec![
        effect(rig, grid, LIBRARY[0].name()),
        effect(rig, grid, LIBRARY[1].name()),
        effect(rig, grid, "mesh_compliance"),
        effect(rig, grid, "backlash_error"),
        order(1.0, false),
        order(2.0, false),
        level(Weight::Load, false, 10.0),
        last,
    ]
}

/// Campaigns of both senses at two loads: scatter, and up to three of the candidates at 1 to 20 µrad. Each with its
/// pool and what it is whitened to.
fn campaigns(last: &Candidate, cases: usize, seed: u64) -> impl Iterator<Item = (DesignMatrix, Whitened)> {
    let (rig, bins) = (rig(), 48);
    let runs = [full(Ccw, 5.0, 2, bins), full(Cw, 5.0, 2, bins), full(Ccw, 15.0, 2, bins), full(Cw, 15.0, 2, bins)];
    let mut grid = grid(&rig, &runs, bins, uneven);
    let truth = Truth { order_rad2: TRUTH.order_rad2.map(|v| 0.01 * v), white_rad2: 1e-12, ..TRUTH };
    let candidates = candidates(&rig, &grid, last.clone());
    let mut random = Random::new(seed);
    (0..cases).map(move |case| {
        grid.rho_rad = draw(&grid, &truth, &mut random);
        let columns = pool(&rig, &grid, &candidates);
        let noise = estimate(&grid);
        for _ in 0..case % 4 {
            let block = columns.blocks[random.below(8)].columns.clone();
            let size_rad = 1e-6 * 20.0_f64.powf(random.below(100) as f64 / 100.0);
            let d = block.len() as f64;
            let amplitudes: Vec<_> = block.map(|c| (c, size_rad * random.normal() / d.sqrt())).collect();
            add_trace(&mut grid, &columns, &amplitudes);
        }
        let pool = pool(&rig, &grid, &candidates);
        let whitened = noise.whiten(&grid, &pool);
        (pool, whitened)
    })
}

#[test]
fn the_best_set_and_the_weights_are_those_of_all_subsets() {
    let mut sizes = [0; 9];
    for (case, (pool, whitened)) in campaigns(&order(1.0, true), 32, 61).enumerate() {
        assert!(pool.blocks.iter().all(|block| block.width() <= wide()));
        let all = all_subsets(&pool, &whitened);
        let mut search = search_in(&pool, &whitened);
        let best = search.run().unwrap();
        // Scales stop within 5 % of where they would come to rest, from wherever they began: d · 0.05² nats a block
        // of d columns.
        let width: usize = all[0].fit.set.iter().map(|b| pool.blocks[*b].width()).sum();
        let tolerance = 0.01 + 0.05_f64.powi(2) * width as f64;
        let names = format!("case {case}: {:?} {} of {:?} {}", best.fit.set, best.score, all[0].fit.set, all[0].score);
        assert!((best.score - all[0].score).abs() < tolerance, "{names}");
        sizes[best.fit.set.len()] += 1;
        search.explore(&best);
        let seen = search.models();
        let (found, right) = (posterior(&pool, &seen, SHARPNESS), posterior(&pool, &all, SHARPNESS));
        // What is one addition, removal or swap from the best and competes with it has been seen: by what a scan
        // expects of it, averaged over the scales and beside fixed ones, where the fit has the best of all. Those
        // come within 3 nats of each other here.
        let is_seen = |set: &[usize]| seen.iter().any(|model| model.fit.set == set);
        let steps = |set: &[usize]| {
            let only = |a: &[usize], b: &[usize]| a.iter().filter(|block| !b.contains(block)).count();
            only(set, &best.fit.set).max(only(&best.fit.set, set))
        };
        for model in all.iter().filter(|m| steps(&m.fit.set) == 1 && m.score > best.score - COMPETING_NATS + 3.0) {
            assert!(is_seen(&model.fit.set), "{names}: {:?} {}", model.fit.set, model.score);
        }
        // What lies further off may be left out: probabilities are off by its weight at most.
        let weight = |model: &Model| (SHARPNESS * (model.score - all[0].score)).exp();
        let total: f64 = all.iter().map(weight).sum();
        let unseen = all.iter().filter(|model| !is_seen(&model.fit.set)).map(weight).sum::<f64>() / total;
        assert!(unseen < 0.5, "{names}: {unseen} of the weight not seen");
        let tolerance = unseen + 2.0 * tolerance;
        for (n, (p, q)) in found.probability.iter().zip(&right.probability).enumerate() {
            assert!((p - q).abs() < tolerance, "{names}: {} {p} {q} ± {tolerance}", LIBRARY[n].name());
        }
        assert!((found.unknown - right.unknown).abs() < tolerance, "{names}: {} {}", found.unknown, right.unknown);
        // And the weights are what they are defined as.
        let total: f64 = seen.iter().map(|m| (SHARPNESS * (m.score - seen[0].score)).exp()).sum();
        for (model, weight) in seen.iter().zip(&found.weights) {
            assert!((weight - (SHARPNESS * (model.score - seen[0].score)).exp() / total).abs() < 1e-12);
        }
    }
    assert!(sizes[0] > 0 && sizes[1] > 0 && sizes[2] > 0, "sets of all sizes: {sizes:?}");
}

/// A wide block is scanned at scales a factor of 4 apart. About its maximum at ŝ the log evidence of d columns that
/// stand out lies d (ln r + 1/(2r²) − ½) under it at r ŝ: in the worst place between two, r = 2.33, by 0.437 d. The
/// scan shares it out to four scales, ln 4, where the fit takes ½ for a scale. What is so expected to fall 3 nats or
/// more short is not tried.
#[test]
fn with_a_wide_block_the_best_set_is_missed_by_no_more_than_its_scan_s_grid() {
    let smooth = Candidate::Unknown(super::support::smooth(1.0));
    for (case, (pool, whitened)) in campaigns(&smooth, 32, 62).enumerate() {
        let d = pool.blocks[7].width();
        assert!(d > wide());
        let all = all_subsets(&pool, &whitened);
        let best = search_in(&pool, &whitened).run().unwrap();
        let missed = 0.437 * d as f64 + 4.0_f64.ln() - 0.5 - 3.0;
        let names = format!("case {case}: {:?} {} of {:?} {}", best.fit.set, best.score, all[0].fit.set, all[0].score);
        assert!(best.score > all[0].score - missed, "{names}");
        // Where both hold the block or neither does nothing is missed.
        if best.fit.set.contains(&7) == all[0].fit.set.contains(&7) {
            assert!(best.score > all[0].score - 1.0, "{names}");
        }
    }
}
