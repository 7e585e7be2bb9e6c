//! What can be wrong with a plant before it turns.

/// A plant that cannot be built, with the quantity at fault and what to change.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// A parameter lies outside the range in which the plant is meaningful.
    #[error("simulated plant: {quantity} is {value} {unit}, allowed is {min} to {max} {unit}: {hint}")]
    OutOfRange {
        /// The parameter, by its name in the specification.
        quantity: &'static str,
        /// The value given.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
        /// What to do next.
        hint: &'static str,
    },
    /// Elliptic gears turning about their foci only close when both are alike.
    #[error(
        "simulated plant: an elliptical pair (eccentricity {eccentricity}) needs equal tooth numbers, got {z1} and {z2}: \
         make them equal, or set eccentricity = 0 for a circular pair"
    )]
    UnequalTeeth {
        /// Eccentricity of the pitch ellipse.
        eccentricity: f64,
        /// Teeth of the driver.
        z1: u32,
        /// Teeth of the driven gear.
        z2: u32,
    },
    /// The two flanks leave the driven gear no room: the pair cannot be assembled.
    #[error(
        "simulated plant: the teeth jam at driver angle {theta1_rad:.4} rad, where the flanks overlap by {overlap_mm:.4} mm along \
         the normal: raise backlash_mm by {backlash_needed_mm:.4} mm or more, or make e1_mm, e2_mm smaller, or the centre \
         distance larger"
    )]
    TeethJam {
        /// Driver angle of the worst overlap, rad.
        theta1_rad: f64,
        /// Overlap along the normal, mm.
        overlap_mm: f64,
        /// Further tooth thinning along the pitch curve that just removes it, mm.
        backlash_needed_mm: f64,
    },
    /// Newton's method found no contact of the two flanks.
    #[error(
        "simulated plant: no tooth contact found on the {flank} flank at driver angle {theta1_rad:.4} rad (last step \
         {residual_rad:.1e} rad, wanted {limit_rad:.0e} rad): the displacements are too large for the teeth, make e1_mm, e2_mm, \
         centre_distance_error_mm or backlash_mm smaller"
    )]
    NoContact {
        /// Which flank.
        flank: &'static str,
        /// Driver angle, rad.
        theta1_rad: f64,
        /// Size of the last Newton step, rad.
        residual_rad: f64,
        /// Size at which it counts as converged, rad.
        limit_rad: f64,
    },
    /// The contact table stays too coarse at the finest grid.
    #[error(
        "simulated plant: the contact table misses exact contact by {error_rad:.1e} rad at driver angle {theta1_rad:.4} rad \
         (allowed {limit_rad:.0e} rad) with {cells} cells: use a smaller eccentricity"
    )]
    CoarseTable {
        /// Interpolation error, rad.
        error_rad: f64,
        /// Driver angle, rad.
        theta1_rad: f64,
        /// Error allowed, rad.
        limit_rad: f64,
        /// Cells a period at which refinement ended.
        cells: usize,
    },
}

/// Refuses `value` outside `min..=max` (and NaN).
pub(super) fn in_range(
    quantity: &'static str,
    value: f64,
    unit: &'static str,
    (min, max): (f64, f64),
    hint: &'static str,
) -> Result<(), PlantError> {
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(PlantError::OutOfRange { quantity, value, unit, min, max, hint })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_error_says_what_where_and_what_next() {
        let error = in_range("gears.e1_mm", 7.0, "mm", (0.0, 1.0), "give the eccentricity in mm").unwrap_err();
        assert_eq!(
            error.to_string(),
            "simulated plant: gears.e1_mm is 7 mm, allowed is 0 to 1 mm: give the eccentricity in mm"
        );
        assert!(in_range("x", f64::NAN, "mm", (0.0, 1.0), "").is_err());
        assert!(in_range("x", 1.0, "mm", (0.0, 1.0), "").is_ok());
    }
}
