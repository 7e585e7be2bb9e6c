//! Single steps of any size.

use super::edges::sharpen;
use crate::grid::Grid;
use crate::nuisance_patterns::Pattern;
use crate::sectors::Sector;
use crate::settings::StepSettings;

/// Steps of any size, one after the other, each where it takes most off the sectors' residual; one that is undone later counts as two.
pub(super) fn single_steps(grid: &Grid, sectors: &[Sector], rest: &[f64], settings: &StepSettings) -> Vec<Pattern> {
    let per_revolution = settings.sectors;
    let mut left: Vec<f64> = sectors.iter().map(|s| s.mean_rad).collect();
    let mut found = Vec::new();
    for _ in 0..settings.most_single {
        let sums = Sums::new(sectors, &left, per_revolution);
        let end = sectors.len();
        let stays = (1..end).map(|from| sums.segment(from, end));
        let goes_back = (1..end).flat_map(|from| (from + per_revolution / 2..end).map(move |until| (from, until)));
        let goes_back = goes_back.map(|(from, until)| sums.segment(from, until));
        let most = |a: &Segment, b: &Segment| a.gain.total_cmp(&b.gain);
        let (Some(once), back) = (stays.max_by(most), goes_back.max_by(most)) else { break };
        let best = back.filter(|back| back.gain > once.gain + settings.single_nats).unwrap_or(once);
        if best.gain < settings.single_nats {
            break;
        }
        let sharp = |at: usize, step_rad: f64| sharpen(grid, rest, &[sectors[at].start_s], step_rad, per_revolution)[0];
        let cost_nats = |at: usize| {
            if sectors[at].run == sectors[at - 1].run { settings.in_run_nats } else { settings.in_pause_nats }
        };
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
struct Sums {
    before: Vec<[f64; 2]>,
    /// Sectors a revolution.
    per_revolution: usize,
}

impl Sums {
    fn new(sectors: &[Sector], values: &[f64], per_revolution: usize) -> Self {
        let mut sums = vec![[0.0; 2]];
        for (sector, value) in sectors.iter().zip(values) {
            let [weight, sum] = sums[sums.len() - 1];
            sums.push([weight + 1.0 / sector.variance_rad2, sum + value / sector.variance_rad2]);
        }
        Self { before: sums, per_revolution }
    }

    fn segment(&self, from: usize, until: usize) -> Segment {
        // Neighbouring sectors of a turn share its level: as many independent values as half turns.
        let share = 2.0 / self.per_revolution as f64;
        let [total, sum] = self.before[self.before.len() - 1];
        let [inside, inside_sum] = [0, 1].map(|n| self.before[until][n] - self.before[from][n]);
        let outside = total - inside;
        let step_rad = inside_sum / inside - (sum - inside_sum) / outside;
        let gain = 0.5 * share * step_rad * step_rad * inside * outside / total;
        Segment { from, until, step_rad, gain }
    }
}
