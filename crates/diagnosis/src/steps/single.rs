//! Single steps of any size.

use super::edges::sharpen;
use crate::grid::Grid;
use crate::nuisance_patterns::Pattern;
use crate::sectors::{SECTORS, Sector};

/// Most single steps of any size looked for, and the evidence from which one is taken into the design matrix, nats.
const SINGLE_STEPS: usize = 3;
const SINGLE_STEP_NATS: f64 = 14.0;
/// What the time of such a step costs, nats, in a run and between two: something happens as readily in one of the few pauses.
const IN_RUN_NATS: f64 = 6.0;
const IN_PAUSE_NATS: f64 = 3.0;

/// Steps of any size, one after the other, each where it takes most off the sectors' residual; one that is undone later counts as two.
pub(super) fn single_steps(grid: &Grid, sectors: &[Sector], rest: &[f64]) -> Vec<Pattern> {
    let mut left: Vec<f64> = sectors.iter().map(|s| s.mean_rad).collect();
    let mut found = Vec::new();
    for _ in 0..SINGLE_STEPS {
        let sums = Sums::new(sectors, &left);
        let end = sectors.len();
        let stays = (1..end).map(|from| sums.segment(from, end));
        let goes_back = (1..end).flat_map(|from| (from + SECTORS / 2..end).map(move |until| (from, until)));
        let goes_back = goes_back.map(|(from, until)| sums.segment(from, until));
        let most = |a: &Segment, b: &Segment| a.gain.total_cmp(&b.gain);
        let (Some(once), back) = (stays.max_by(most), goes_back.max_by(most)) else { break };
        let best = back.filter(|back| back.gain > once.gain + SINGLE_STEP_NATS).unwrap_or(once);
        if best.gain < SINGLE_STEP_NATS {
            break;
        }
        let sharp = |at: usize, step_rad: f64| sharpen(grid, rest, &[sectors[at].start_s], step_rad)[0];
        let cost_nats = |at: usize| if sectors[at].run == sectors[at - 1].run { IN_RUN_NATS } else { IN_PAUSE_NATS };
        let time_s = sharp(best.from, best.step_rad);
        found.push(if best.until < end {
            let until_s = sharp(best.until, -best.step_rad);
            Pattern::Step { time_s, until_s, cost_nats: cost_nats(best.from) + cost_nats(best.until) }
        } else {
            Pattern::Step { time_s, until_s: f64::INFINITY, cost_nats: cost_nats(best.from) }
        });
        left[best.from..best.until].iter_mut().for_each(|y| *y -= best.step_rad);
    }
    found
}

/// Sectors that stand off the others.
struct Segment {
    from: usize,
    until: usize,
    /// By how much, rad.
    step_rad: f64,
    /// Evidence for it, nats.
    gain: f64,
}

/// Sums of the weights and weighted values of all sectors before each.
struct Sums(Vec<[f64; 2]>);

impl Sums {
    fn new(sectors: &[Sector], values: &[f64]) -> Self {
        let mut sums = vec![[0.0; 2]];
        for (sector, value) in sectors.iter().zip(values) {
            let [weight, sum] = sums[sums.len() - 1];
            sums.push([weight + 1.0 / sector.variance_rad2, sum + value / sector.variance_rad2]);
        }
        Self(sums)
    }

    fn segment(&self, from: usize, until: usize) -> Segment {
        // Neighbouring sectors of a turn share its level: as many independent values as half turns.
        let share = 2.0 / SECTORS as f64;
        let [total, sum] = self.0[self.0.len() - 1];
        let [inside, inside_sum] = [0, 1].map(|n| self.0[until][n] - self.0[from][n]);
        let outside = total - inside;
        let step_rad = inside_sum / inside - (sum - inside_sum) / outside;
        let gain = 0.5 * share * step_rad * step_rad * inside * outside / total;
        Segment { from, until, step_rad, gain }
    }
}
