//! What differs from case to case and is no fault: noise, scatter between revolutions and runs, sampling, discs, stiffness.

use rigsim::plant::PlantSpec;
use rigsim::plant::faults::FaultRng;

/// Mean driven radius, over which a displacement along the pitch line turns the gear, mm.
const RADIUS_MM: f64 = 72.5;
/// Counts per revolution of every disc.
const COUNTS_PER_REV: u32 = 7_200_000;
/// Discs in use.
const LINES: [u32; 5] = [18_000, 9_000, 5_000, 3_600, 2_500];
/// Largest offset of the signals at which their second order stays small, in parts of the signal.
const LARGEST_OFFSET: f64 = 0.4;

/// The conditions of one case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// Sampling, Hz.
    pub rate_hz: f64,
    /// White noise of both encoders together, rad RMS a sample.
    pub white_rad: f64,
    /// Run-out that varies between revolutions, rad RMS.
    pub run_out_rad: f64,
    /// Over how many driver revolutions it remembers itself.
    pub run_out_rev: f64,
    /// Run-out that varies between runs, rad RMS.
    pub slow_run_out_rad: f64,
    /// Lines of both discs.
    pub lines: u32,
    /// Documented compliance of the mesh, mm²·rad/(N·m).
    pub mesh_compliance_mm2_rad_per_nm: f64,
    /// Seed of the rig's own noise.
    pub seed: u64,
}

impl Conditions {
    /// Draws them: floors of 8 to 25 µrad a sample. `interpolation_rad` and `stiffness_rad` are the sizes of such effects in the case;
    /// lines must be wide enough for the one, documented teeth soft enough for the other.
    pub fn draw(
        rng: &mut FaultRng,
        documented: f64,
        interpolation_rad: Option<f64>,
        stiffness_rad: Option<f64>,
    ) -> Self {
        let floor_rad = rng.spread(8e-6, 25e-6);
        let run_out_rad = floor_rad * rng.spread(0.03, 0.25);
        let slow_run_out_rad = run_out_rad * rng.spread(0.1, 0.6);
        let white_rad = (floor_rad.powi(2) - run_out_rad.powi(2) - slow_run_out_rad.powi(2)).sqrt();
        let usable: Vec<u32> = LINES
            .into_iter()
            .filter(|lines| interpolation_rad.is_none_or(|rms| 2f64.sqrt() * rms * f64::from(*lines) < LARGEST_OFFSET))
            .collect();
        let lines = usable.get(rng.below(usable.len())).copied().unwrap_or(2_500);
        // Some rigs have soft gears, and their drawing says so.
        let soft = if rng.between(0.0, 1.0) < 0.2 { rng.spread(1.0, 20.0) } else { 1.0 };
        let needed = stiffness_rad.map_or(0.0, |rms| 800.0 * rms);
        Self {
            rate_hz: [500.0, 1000.0, 2000.0][rng.below(3)],
            white_rad,
            run_out_rad,
            run_out_rev: rng.spread(0.15, 0.8),
            slow_run_out_rad,
            lines,
            mesh_compliance_mm2_rad_per_nm: (documented * soft).max(needed),
            seed: rng.seed(),
        }
    }

    /// Puts them into a rig.
    pub fn apply(&self, spec: &mut PlantSpec) {
        spec.mesh.compliance_mm2_rad_per_nm = self.mesh_compliance_mm2_rad_per_nm;
        let encoders = &mut spec.encoders;
        // The two discs share the noise as 3 to 4.
        (encoders.input.noise_rad, encoders.output.noise_rad) = (0.6 * self.white_rad, 0.8 * self.white_rad);
        for disc in [&mut encoders.input, &mut encoders.output] {
            (disc.lines, disc.counts_per_line) = (self.lines, COUNTS_PER_REV / self.lines);
        }
        let noise = &mut spec.noise;
        (noise.run_out_rms_mm, noise.run_out_correlation_rev) = (self.run_out_rad * RADIUS_MM, self.run_out_rev);
        (noise.slow_run_out_rms_mm, noise.slow_run_out_correlation_rev) = (self.slow_run_out_rad * RADIUS_MM, 6.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floors_stay_in_their_range_and_discs_count_alike() {
        let mut rng = FaultRng::new(2);
        for _ in 0..500 {
            let drawn = Conditions::draw(&mut rng, 1.7e-3, Some(3e-5), Some(3e-5));
            let floor = (drawn.white_rad.powi(2) + drawn.run_out_rad.powi(2) + drawn.slow_run_out_rad.powi(2)).sqrt();
            assert!((8e-6..=25.001e-6).contains(&floor), "{floor}");
            assert!(drawn.mesh_compliance_mm2_rad_per_nm >= 0.024);
            let mut spec = PlantSpec::default();
            drawn.apply(&mut spec);
            assert_eq!(spec.encoders.input.counts_per_rev(), 7_200_000);
            assert!(f64::from(drawn.lines) * 3e-5 * 2f64.sqrt() < LARGEST_OFFSET);
            assert_eq!(spec.validate(), Ok(()));
        }
    }
}
