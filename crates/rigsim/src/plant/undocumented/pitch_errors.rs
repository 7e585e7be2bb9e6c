//! Each tooth of the driver stands off its place, each flank by its own amount; of the pairs in contact the most advanced carries.

use super::{FaultRng, Parameters, PlantSpec, Undocumented, Value};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "pitch_errors",
    summary: "teeth displaced by 2 µm RMS",
    usual,
    draw,
    amounts: &[("ccw_mm", 1.0), ("cw_mm", 1.0)],
    develops: false,
    apply,
};

/// 2 µm RMS in a fixed pattern.
fn usual(spec: &PlantSpec) -> Parameters {
    draw(spec, &mut FaultRng::new(47))
}

/// Random in all but the size.
fn draw(spec: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    const RMS_MM: f64 = 2e-3;
    let count = spec.gears.teeth[0] as usize;
    // Half of the variance is the tooth's place, which both flanks share, half each flank's own.
    let common: Vec<f64> = (0..count).map(|_| rng.normal()).collect();
    let mut flank = || {
        let own: Vec<f64> = common.iter().map(|place| RMS_MM * 0.5f64.sqrt() * (place + rng.normal())).collect();
        // A mean would be a backlash.
        let mean = own.iter().sum::<f64>() / count.max(1) as f64;
        Value::Numbers(own.iter().map(|error| error - mean).collect())
    };
    let ccw = flank();
    Parameters::default().with("ccw_mm", ccw).with("cw_mm", flank())
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    (spec.teeth.ccw_mm, spec.teeth.cw_mm) = (parameters.numbers("ccw_mm"), parameters.numbers("cw_mm"));
}
