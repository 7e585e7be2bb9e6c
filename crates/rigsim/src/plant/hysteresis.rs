//! Torque of a powder brake against its current: two branches, and everything between them after a reversal.
//!
//! A generalised Prandtl–Ishlinskii operator: three play operators between envelopes of different width. Each play
//! keeps its torque until an envelope pushes it, `y ← max(rising(i), min(falling(i), y))`; their mean follows the
//! rising branch while the current grows, the falling branch while it falls, and crosses over gradually after a
//! reversal, with closed minor loops. (I. Mayergoyz, Mathematical Models of Hysteresis; M. Brokate and J. Sprekels,
//! Hysteresis and Phase Transitions.)

/// Widths of the plays in parts of the branches' half distance; their mean is 1, so the branches are those of the
/// specification.
const PLAY_WIDTHS: [f64; 3] = [0.5, 1.0, 1.5];

/// Shape of the two branches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Branches {
    pub rated_torque_nm: f64,
    /// Reciprocal of the rated current, 1/A.
    pub per_rated_current: f64,
    /// c in g(x) = (1 + c) x²/(x² + c): small c saturates early.
    pub saturation: f64,
    /// δ: half distance of the branches in parts of their mean, at small current.
    pub hysteresis: f64,
}

impl Branches {
    /// (mean torque, half distance of the branches), N·m, without drag.
    #[inline]
    fn mean_and_half_width(&self, current_a: f64) -> (f64, f64) {
        // The branches meet at 1.5 times the rated current; beyond it the powder is saturated.
        let x = (current_a * self.per_rated_current).clamp(0.0, 1.5);
        let square = x * x;
        let mean = self.rated_torque_nm * (1.0 + self.saturation) * square / (square + self.saturation);
        (mean, mean * self.hysteresis * (1.0 - x * (1.0 / 1.5)))
    }

    /// (rising, falling) torque, N·m, without drag.
    pub fn at(&self, current_a: f64) -> (f64, f64) {
        let (mean, half) = self.mean_and_half_width(current_a);
        (mean - half, mean + half)
    }
}

/// The magnetic memory of the brake.
#[derive(Debug, Clone)]
pub(super) struct Hysteresis {
    branches: Branches,
    plays_nm: [f64; 3],
}

impl Hysteresis {
    pub fn new(branches: Branches) -> Self {
        Self { branches, plays_nm: [0.0; 3] }
    }

    /// Static torque at `current_a` after all that went before, N·m, without drag.
    #[inline]
    pub fn torque_nm(&mut self, current_a: f64) -> f64 {
        let (mean, half) = self.branches.mean_and_half_width(current_a);
        let mut sum = 0.0;
        for (play, width) in self.plays_nm.iter_mut().zip(PLAY_WIDTHS) {
            *play = play.clamp(mean - width * half, mean + width * half);
            sum += *play;
        }
        sum * (1.0 / 3.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brake() -> Hysteresis {
        Hysteresis::new(Branches { rated_torque_nm: 25.0, per_rated_current: 1.0, saturation: 0.8, hysteresis: 0.06 })
    }

    fn sweep(brake: &mut Hysteresis, from: f64, to: f64) -> f64 {
        let mut torque = 0.0;
        for n in 0..=1000 {
            torque = brake.torque_nm(from + (to - from) * f64::from(n) / 1000.0);
        }
        torque
    }

    #[test]
    fn rising_current_follows_the_rising_branch_and_falling_the_falling_one() {
        let mut brake = brake();
        let up = sweep(&mut brake, 0.0, 0.5);
        assert!((up - brake.branches.at(0.5).0).abs() < 1e-12);
        sweep(&mut brake, 0.5, 1.2);
        let down = sweep(&mut brake, 1.2, 0.5);
        assert!((down - brake.branches.at(0.5).1).abs() < 1e-12);
        assert!(down > up * 1.05);
        assert!(sweep(&mut brake, 0.5, 0.0).abs() < 1e-12);
    }

    #[test]
    fn after_a_reversal_the_torque_lies_between_the_branches() {
        let mut brake = brake();
        sweep(&mut brake, 0.0, 0.6);
        let torque = sweep(&mut brake, 0.6, 0.58);
        let (rising, falling) = brake.branches.at(0.58);
        assert!(torque > rising + 1e-3 && torque < falling - 1e-3);
    }

    #[test]
    fn minor_loops_close() {
        let mut brake = brake();
        sweep(&mut brake, 0.0, 0.7);
        let first = sweep(&mut brake, 0.7, 0.66);
        sweep(&mut brake, 0.66, 0.7);
        let second = sweep(&mut brake, 0.7, 0.66);
        assert!((first - second).abs() < 1e-12);
    }

    #[test]
    fn both_branches_rise_with_the_current() {
        let branches = brake().branches;
        let points: Vec<(f64, f64)> = (0..=150).map(|n| branches.at(f64::from(n) * 0.01)).collect();
        for pair in points.windows(2) {
            assert!(pair[1].0 > pair[0].0 && pair[1].1 > pair[0].1);
            assert!(pair[0].1 >= pair[0].0);
        }
    }
}
