//! What a drawing says about a pair, before it is checked.

/// A pair of identical elliptic gears, each turning about a focus.
///
/// The tooth condition (perimeter = π m Z) fixes the size of the ellipse; closure fixes the centre distance.
#[derive(Clone, Debug, PartialEq)]
pub struct EllipticalSpec {
    /// Teeth and sizes; a simple elliptic pair needs equal numbers of teeth.
    pub teeth: ToothSpec,
    /// Eccentricity k of the pitch ellipse, 0 (circle) to below 1.
    pub eccentricity: f64,
}

impl Default for EllipticalSpec {
    /// The usual teeth with k = 0.3287: the pair of the source document.
    fn default() -> Self {
        Self { teeth: ToothSpec::default(), eccentricity: 0.3287 }
    }
}

/// A pair of circular gears: teeth and sizes say everything.
pub type CircularSpec = ToothSpec;

/// Teeth and sizes of a pair, whatever its pitch curve.
#[derive(Clone, Debug, PartialEq)]
pub struct ToothSpec {
    /// Module m, mm.
    pub module_mm: f64,
    /// Teeth of the driver and of the driven gear; their ratio is the closure.
    pub teeth: (u32, u32),
    /// Pressure angle α of the rack, deg.
    pub pressure_angle_deg: f64,
    /// Centre distance of the drawing, mm; checked against closure, `None` = the one that closes.
    pub centre_distance_mm: Option<f64>,
    /// Designed backlash of both gears together along the pitch curve, mm.
    pub backlash_mm: f64,
    /// Face width, mm.
    pub face_width_mm: f64,
    /// Addendum in modules.
    pub addendum: f64,
    /// Clearance of the dedendum over the mate's addendum, in modules.
    pub dedendum_clearance: f64,
}

impl Default for ToothSpec {
    /// m = 3 mm, 47 teeth on both gears, α = 20°, no backlash.
    fn default() -> Self {
        Self {
            module_mm: 3.0,
            teeth: (47, 47),
            pressure_angle_deg: 20.0,
            centre_distance_mm: None,
            backlash_mm: 0.0,
            face_width_mm: 30.0,
            addendum: 1.0,
            dedendum_clearance: 0.25,
        }
    }
}

/// A free pitch curve of the driver; the tooth condition scales it, closure fixes its mate.
#[derive(Clone, Debug, PartialEq)]
pub enum CurveSpec {
    /// Ellipses of higher order, r1 = p/(1 − k cos n1 θ1), n1 lobes driving n2; the teeth stand in the same ratio.
    Lobed {
        /// Eccentricity k, 0 to below 1.
        eccentricity: f64,
        /// Lobes (n1, n2).
        lobes: (u32, u32),
    },
    /// r1 ∝ 1 + Σ cosines\[n−1\] cos n θ1 + sines\[n−1\] sin n θ1.
    Fourier {
        /// Cosine amplitudes from order 1.
        cosines: Vec<f64>,
        /// Sine amplitudes from order 1.
        sines: Vec<f64>,
    },
    /// r1 through samples, in any unit, by a periodic cubic spline.
    Sampled {
        /// Angles, rad, strictly increasing within one turn.
        theta1_rad: Vec<f64>,
        /// Radii at these angles, any unit.
        radius: Vec<f64>,
    },
    /// A given transmission: i21 ∝ 1 + Σ cosines\[n−1\] cos n θ1 + sines\[n−1\] sin n θ1, scaled to the closure of the teeth.
    Transmission {
        /// Cosine amplitudes from order 1.
        cosines: Vec<f64>,
        /// Sine amplitudes from order 1.
        sines: Vec<f64>,
    },
}

impl CurveSpec {
    /// Name as in `kind` of `pair.toml`.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Lobed { .. } => "lobed",
            Self::Fourier { .. } => "fourier",
            Self::Sampled { .. } => "sampled",
            Self::Transmission { .. } => "transmission",
        }
    }
}
