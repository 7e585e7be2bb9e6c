//! Where a recording reverses: a robot joint's goes to and fro.

use crate::Direction;

/// Way back that makes a reversal, rad: above encoder noise and velocity ripple, below any motion that is meant.
pub const REVERSAL_RAD: f64 = 0.01;

/// A segment of one sense: samples `from..to`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// First sample.
    pub from: usize,
    /// First sample after it.
    pub to: usize,
    /// The driver's sense.
    pub direction: Direction,
}

/// Index and angle of a lowest or highest sample.
type Extremum = Option<(usize, f64)>;

/// Cuts at the turning points of `theta1_rad` (NaN = gap). Empty where it never moves by more than [`REVERSAL_RAD`].
///
/// A turning point is an extremum from which the angle then comes back by more than [`REVERSAL_RAD`]; the sample of the
/// extremum begins the new segment.
#[must_use]
pub fn segments(theta1_rad: &[f64]) -> Vec<Segment> {
    let mut found: Vec<Segment> = Vec::new();
    let mut from = 0;
    // Lowest and highest sample since the last turning point.
    let (mut low, mut high): (Extremum, Extremum) = (None, None);
    let mut sense: Option<Direction> = None;
    for (index, &theta) in theta1_rad.iter().enumerate() {
        if theta.is_nan() {
            continue;
        }
        if low.is_none_or(|(_, value)| theta < value) {
            low = Some((index, theta));
        }
        if high.is_none_or(|(_, value)| theta > value) {
            high = Some((index, theta));
        }
        let (Some((low_at, lowest)), Some((high_at, highest))) = (low, high) else { continue };
        let turned = match sense {
            Some(Direction::Ccw) => (highest - theta > REVERSAL_RAD).then_some((high_at, Direction::Ccw)),
            Some(Direction::Cw) => (theta - lowest > REVERSAL_RAD).then_some((low_at, Direction::Cw)),
            None => {
                // The first clear motion shows the sense; what came before it belongs to it.
                if highest - lowest > REVERSAL_RAD {
                    sense = Some(if high_at > low_at { Direction::Ccw } else { Direction::Cw });
                }
                None
            }
        };
        if let Some((at, direction)) = turned {
            found.push(Segment { from, to: at, direction });
            from = at;
            sense = Some(direction.reversed());
            (low, high) = match direction {
                Direction::Ccw => (Some((index, theta)), Some((at, highest))),
                Direction::Cw => (Some((at, lowest)), Some((index, theta))),
            };
        }
    }
    if let Some(direction) = sense {
        found.push(Segment { from, to: theta1_rad.len(), direction });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing(samples: usize, noise_rad: f64) -> Vec<f64> {
        // A sawtooth on top stands for encoder noise.
        (0..samples).map(|i| (i as f64 * 0.01).sin() + noise_rad * f64::from(i as u32 % 2)).collect()
    }

    #[test]
    fn noise_below_the_limit_makes_no_reversal_and_motion_above_it_does() {
        let directions = |theta: &[f64]| segments(theta).iter().map(|part| part.direction).collect::<Vec<_>>();
        let there_and_back = [Direction::Ccw, Direction::Cw, Direction::Ccw];
        assert_eq!(directions(&swing(629, 0.0)), there_and_back);
        assert_eq!(directions(&swing(629, 0.9 * REVERSAL_RAD)), there_and_back);
        assert!(directions(&swing(629, 1.5 * REVERSAL_RAD)).len() > 3);
        assert!(segments(&[0.0, 0.5 * REVERSAL_RAD, 0.0]).is_empty());
    }

    #[test]
    fn stretches_cover_every_sample_once_and_meet_at_the_extrema() {
        let mut theta = swing(1000, 0.0);
        theta[300] = f64::NAN;
        let parts = segments(&theta);
        assert_eq!((parts[0].from, parts[parts.len() - 1].to), (0, 1000));
        assert!(parts.windows(2).all(|pair| pair[0].to == pair[1].from));
        let expected = [157, 471, 785];
        for (part, turn) in parts.iter().zip(expected) {
            assert!(part.to.abs_diff(turn) <= 1, "{part:?} {turn}");
        }
    }
}
