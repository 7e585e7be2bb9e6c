//! The counter box latches one encoder later than the other.

/// The latest angles of a shaft, one a step, to look up where it stood a little earlier.
#[derive(Debug, Clone)]
pub(super) struct Delay {
    angles: Vec<f64>,
    newest: usize,
    steps_back: usize,
    fraction: f64,
}

impl Delay {
    /// A delay of `delay_s`, in steps of `dt_s`, of a shaft that stands at `angle_rad` and has been turning steadily.
    pub fn new(delay_s: f64, dt_s: f64, angle_rad: f64, speed_rad_per_s: f64) -> Self {
        let steps = delay_s / dt_s;
        let steps_back = steps.floor() as usize;
        let count = steps_back + 2;
        // The newest angle is the last of the ring.
        let past = (0..count).map(|n| angle_rad - speed_rad_per_s * dt_s * (count - 1 - n) as f64).collect();
        Self { angles: past, newest: count - 1, steps_back, fraction: steps - steps_back as f64 }
    }

    /// Notes the angle at the end of a step.
    #[inline]
    pub fn push(&mut self, angle_rad: f64) {
        self.newest = (self.newest + 1) % self.angles.len();
        self.angles[self.newest] = angle_rad;
    }

    /// The angle one delay ago, on a straight line between steps.
    #[inline]
    pub fn angle_rad(&self) -> f64 {
        let count = self.angles.len();
        let later = self.angles[(self.newest + count - self.steps_back) % count];
        let earlier = self.angles[(self.newest + count - self.steps_back - 1) % count];
        later + self.fraction * (earlier - later)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_is_that_of_one_delay_ago() {
        for delay in [0.0, 0.4e-3, 1e-3, 3.7e-3] {
            let mut shaft = Delay::new(delay, 1e-3, 0.0, 1.0);
            assert!((shaft.angle_rad() + delay).abs() < 1e-12, "{delay}");
            for n in 1..50 {
                shaft.push(f64::from(n) * 1e-3);
            }
            assert!((shaft.angle_rad() - (49e-3 - delay)).abs() < 1e-12, "{delay}");
        }
    }
}
