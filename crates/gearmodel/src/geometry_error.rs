//! Why a gear pair cannot be made or cannot run.

/// A gear pair that cannot be made, cannot run, or is not described by finite numbers.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// A number is NaN or infinite.
    #[error("{quantity} is {value}: a finite number is needed")]
    NotFinite {
        /// What was given.
        quantity: &'static str,
        /// The value.
        value: f64,
    },

    /// A number lies outside what a gear can have.
    #[error("{quantity} = {value}{u} is outside {lower} to {upper}{u}: {advice}", u = spaced(unit))]
    OutOfRange {
        /// What was given.
        quantity: &'static str,
        /// The value.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// Smallest value accepted.
        lower: f64,
        /// Largest value accepted.
        upper: f64,
        /// What to do next.
        advice: &'static str,
    },

    /// A documented effect that does not fit the pair or is not fixed by its parameters.
    #[error("documented {0}")]
    Documented(#[from] crate::stated::StatedError),

    /// A tooth number outside the limits.
    #[error("gear {gear} has {teeth} teeth: {lower} to {upper} are accepted")]
    Teeth {
        /// 1 = driver, 2 = driven.
        gear: u8,
        /// Number of teeth given.
        teeth: u32,
        /// Smallest number accepted.
        lower: u32,
        /// Largest number accepted.
        upper: u32,
    },

    /// The kind of pitch curve needs another tooth number on gear 2.
    #[error(
        "a pair of {kind} pitch curves with {teeth1} teeth on gear 1 needs {needed} teeth on gear 2, not {teeth2}: \
         give both gears teeth in the ratio of their turns"
    )]
    TeethRatio {
        /// Kind of pitch curve.
        kind: &'static str,
        /// Teeth of gear 1.
        teeth1: u32,
        /// Teeth given for gear 2.
        teeth2: u32,
        /// Teeth that gear 2 must have (a whole number, or the pair cannot be cut).
        needed: f64,
    },

    /// The driven gear would not turn a whole turn for a whole turn.
    #[error(
        "centre distance {centre_distance_mm} mm does not close: the driven gear turns {closure_sum:.6} times a turn of \
         the driver instead of {closure_needed:.6}; this pitch curve closes at {closing_mm:.6} mm"
    )]
    NotClosing {
        /// Centre distance given, mm.
        centre_distance_mm: f64,
        /// Turns of the driven gear a turn of the driver at that distance, (1/2π) ∮ i21 dθ1.
        closure_sum: f64,
        /// Turns of the driven gear a turn of the driver that the tooth numbers ask for.
        closure_needed: f64,
        /// Centre distance that closes, mm.
        closing_mm: f64,
    },

    /// The driver's pitch curve reaches the driven shaft.
    #[error(
        "centre distance {centre_distance_mm} mm is not larger than the driver's largest radius {radius_mm:.6} mm at \
         theta1 = {theta1_rad:.6} rad: no driven pitch curve exists (closure sum infinite); this pitch curve closes at \
         {closing_mm:.6} mm"
    )]
    NoDrivenCurve {
        /// Centre distance given, mm.
        centre_distance_mm: f64,
        /// The driver's largest radius, mm.
        radius_mm: f64,
        /// Where it is, rad.
        theta1_rad: f64,
        /// Centre distance that closes, mm.
        closing_mm: f64,
    },

    /// A drive of which no teeth are known.
    #[error("a constant-ratio drive has no known teeth to draw: describe the gears as circular")]
    NoTeeth,

    /// A pitch curve that a rack cannot roll on.
    #[error(
        "the pitch curve of gear {gear} is concave at theta1 = {theta1_rad:.6} rad (radius of curvature {radius_mm:.3} mm): no rack or hob reaches it; shape or erode the gear, or take a rounder curve"
    )]
    Concave {
        /// 1 = driver, 2 = driven.
        gear: u8,
        /// Where, rad.
        theta1_rad: f64,
        /// Radius of curvature there, mm, negative.
        radius_mm: f64,
    },

    /// The rack cuts away the foot of its own flank.
    #[error(
        "gear {gear} is undercut at theta1 = {theta1_rad:.6} rad: radius of curvature {radius_mm:.3} mm of the pitch curve is below the limit {limit_mm:.3} mm = addendum/sin^2(pressure angle); take more teeth, a rounder curve, a larger pressure angle or a smaller addendum"
    )]
    Undercut {
        /// 1 = driver, 2 = driven.
        gear: u8,
        /// Where, rad.
        theta1_rad: f64,
        /// Radius of curvature of the pitch curve, mm.
        radius_mm: f64,
        /// Smallest radius without undercut, mm.
        limit_mm: f64,
    },

    /// A tooth whose flanks meet before its tip.
    #[error(
        "a tooth of gear {gear} cut at theta1 = {theta1_rad:.6} rad is {thickness_mm:.3} mm thick at its tip, below the limit {limit_mm:.3} mm; take a smaller addendum or pressure angle, or less backlash"
    )]
    Pointed {
        /// 1 = driver, 2 = driven.
        gear: u8,
        /// Where, rad.
        theta1_rad: f64,
        /// Thickness at the tip, mm.
        thickness_mm: f64,
        /// Smallest thickness accepted, mm.
        limit_mm: f64,
    },

    /// The mate's tips want to touch where a gear has no flank any more.
    #[error(
        "the tips of gear {mate} run into the feet of gear {gear}'s teeth at theta1 = {theta1_rad:.6} rad: they would touch {reach_mm:.3} mm of rolling from the pitch point, where the flank ends at {limit_mm:.3} mm; take more teeth, a smaller addendum or a larger pressure angle"
    )]
    Interference {
        /// Gear whose flank ends too early: 1 = driver, 2 = driven.
        gear: u8,
        /// The other gear.
        mate: u8,
        /// Rolling position of the contact, rad.
        theta1_rad: f64,
        /// Rolling from the pitch point to the contact with the mate's tip, mm.
        reach_mm: f64,
        /// Rolling from the pitch point to the end of the flank, mm.
        limit_mm: f64,
    },

    /// The tooth spaces reach the shaft.
    #[error(
        "the tooth spaces of gear {gear} reach its axis at theta1 = {theta1_rad:.6} rad: pitch radius {radius_mm:.3} mm, dedendum {dedendum_mm:.3} mm; take more teeth or a rounder curve"
    )]
    NoRoot {
        /// 1 = driver, 2 = driven.
        gear: u8,
        /// Where, rad.
        theta1_rad: f64,
        /// Pitch radius there, mm.
        radius_mm: f64,
        /// Dedendum, mm.
        dedendum_mm: f64,
    },

    /// A pitch curve whose radius or ratio is not positive.
    #[error(
        "{quantity} of the pitch curve is {value:.6} at theta1 = {theta1_rad:.6} rad: it must stay positive; take smaller amplitudes"
    )]
    NotPositive {
        /// Radius or ratio, relative to its mean.
        quantity: &'static str,
        /// Smallest value.
        value: f64,
        /// Where it occurs, rad.
        theta1_rad: f64,
    },

    /// A curve whose mate does not repeat after its own turn.
    #[error(
        "harmonic {order} does not fit {teeth1} : {teeth2} teeth: the mate closes only if every harmonic is a multiple of {needed}; take equal teeth, or harmonics that repeat {needed} times a turn"
    )]
    Harmonic {
        /// Order of θ1 that does not fit.
        order: u32,
        /// Teeth of gear 1.
        teeth1: u32,
        /// Teeth of gear 2.
        teeth2: u32,
        /// Repetitions a turn that closure needs.
        needed: u32,
    },

    /// No centre distance closes.
    #[error(
        "no centre distance makes this pitch curve turn its mate {closure_needed:.6} times a turn: its largest radius is too sharp a peak"
    )]
    NoClosingDistance {
        /// Turns of the driven gear a turn of the driver that the tooth numbers ask for.
        closure_needed: f64,
    },

    /// Samples that do not describe a curve.
    #[error("sample {index} of the pitch curve: {problem}")]
    Sample {
        /// Index from 0.
        index: usize,
        /// What is wrong, and what is needed.
        problem: &'static str,
    },

    /// A parameter of another kind of pair.
    #[error(
        "a pair of kind \"{kind}\" has no {parameter}: eccentricity belongs to elliptical and lobed pairs, harmonic_scale to fourier and transmission, the sizes of teeth to all but constant"
    )]
    ForeignParameter {
        /// The parameter.
        parameter: &'static str,
        /// The kind of pair.
        kind: &'static str,
    },

    /// A list of the wrong length.
    #[error("{quantity} has {given} values: {lower} to {upper} are needed")]
    Length {
        /// The list.
        quantity: &'static str,
        /// Values given.
        given: usize,
        /// Fewest accepted.
        lower: usize,
        /// Most accepted.
        upper: usize,
    },

    /// A table by tooth of the wrong length.
    #[error("a table of pitch errors for gear {gear} has {given} values: {teeth} (one a tooth) or none are needed")]
    ToothTable {
        /// 1 = driver, 2 = driven.
        gear: u8,
        /// Values given.
        given: usize,
        /// Teeth of that gear.
        teeth: u32,
    },

    /// A tooth that the gear does not have.
    #[error("tooth {tooth} does not exist: the driver's teeth are numbered 0 to {teeth} - 1")]
    NoSuchTooth {
        /// The tooth given.
        tooth: u32,
        /// Teeth of the driver.
        teeth: u32,
    },

    /// Flank and centre line stand so that the flank cannot drive.
    #[error(
        "effective pressure angle {effective_deg:.3} deg at theta1 = {theta1_rad:.6} rad exceeds {limit_deg} deg: the \
         flank pushes along the centre line and cannot drive; take a rounder pitch curve or a smaller pressure angle"
    )]
    FlankTooSteep {
        /// Largest |α ± μ|, deg.
        effective_deg: f64,
        /// Where it occurs, rad.
        theta1_rad: f64,
        /// Largest angle accepted, deg.
        limit_deg: f64,
    },
}

/// Passes a finite `value` in `lower..=upper`.
pub(crate) fn check_range(
    quantity: &'static str,
    value: f64,
    unit: &'static str,
    (lower, upper): (f64, f64),
    advice: &'static str,
) -> Result<f64, GeometryError> {
    if !value.is_finite() {
        return Err(GeometryError::NotFinite { quantity, value });
    }
    if value < lower || value > upper {
        return Err(GeometryError::OutOfRange { quantity, value, unit, lower, upper, advice });
    }
    Ok(value)
}

/// Fewest teeth that the model accepts: fewer cannot roll on a rack cutter without losing their flanks.
pub(crate) const MIN_TEETH: u32 = 5;
/// Most teeth that the model accepts.
pub(crate) const MAX_TEETH: u32 = 10_000;

/// Passes a tooth number within the limits.
pub(crate) fn check_teeth(gear: u8, teeth: u32) -> Result<u32, GeometryError> {
    if (MIN_TEETH..=MAX_TEETH).contains(&teeth) {
        Ok(teeth)
    } else {
        Err(GeometryError::Teeth { gear, teeth, lower: MIN_TEETH, upper: MAX_TEETH })
    }
}

/// A unit behind its number; nothing for numbers that have none.
fn spaced(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" {unit}") }
}
