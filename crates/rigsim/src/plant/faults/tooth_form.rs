//! Teeth that have another form than drawn: cut to another pitch curve, ground too thin, off their place, damaged.

use super::fault::Fault;
use super::fault_rng::FaultRng;
use super::parameters::{Parameters, Value};
use super::signature::{Carrier, Parity, Signature};
use crate::plant::flank::Flank;
use crate::plant::spec::PlantSpec;
use crate::plant::teeth::{DamageSpec, ProfileOrder};

/// The teeth were ground thinner than the drawing says, by 20 µm along the pitch curve: both flanks recede, whatever the load.
pub const BACKLASH_ERROR: Fault = Fault {
    name: "backlash_error",
    summary: "teeth 20 µm thinner than documented",
    usual: |_| Parameters::of(&[("dj_mm", 0.02)]),
    vary: |_, usual, rng| usual.times("dj_mm", rng.sign()),
    amounts: &[("dj_mm", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY_ODD),
    same_trace_as: None,
    apply: |spec, parameters| spec.gears.backlash_mm += parameters.number("dj_mm"),
};

/// The pitch curve was cut to another eccentricity, k + 3e-5; the pair is mounted at the distance at which it closes.
pub const PITCH_CURVE_ERROR: Fault = Fault {
    name: "pitch_curve_error",
    summary: "pitch curve cut to k + 3e-5",
    usual: |_| Parameters::of(&[("dk", 3e-5)]),
    vary: |_, usual, rng| usual.times("dk", rng.sign()),
    amounts: &[("dk", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY_EVEN),
    same_trace_as: Some("encoder1_eccentricity"),
    apply: |spec, parameters| spec.gears.eccentricity += parameters.number("dk"),
};

/// Each tooth of the driver stands off its place, each flank by its own amount, 2 µm RMS in a fixed pattern; of the pairs in
/// contact the most advanced carries.
pub const PITCH_ERRORS: Fault = Fault {
    name: "pitch_errors",
    summary: "teeth displaced by 2 µm RMS",
    usual: |spec| misplaced_teeth(spec, &mut FaultRng::new(47)),
    vary: |spec, _, rng| misplaced_teeth(spec, rng),
    amounts: &[("ccw_mm", 1.0), ("cw_mm", 1.0)],
    develops: false,
    signature: None,
    same_trace_as: None,
    apply: |spec, parameters| {
        (spec.teeth.ccw_mm, spec.teeth.cw_mm) = (parameters.numbers("ccw_mm"), parameters.numbers("cw_mm"));
    },
};

fn misplaced_teeth(spec: &PlantSpec, rng: &mut FaultRng) -> Parameters {
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

/// Every tooth has the same error of profile: the driven gear moves ahead by Σ a_n sin(n 2π s − ph_n) along the normal, s the pitch
/// arc from θ1 = 0 in pitches, in both senses alike.
pub const PROFILE_ERROR: Fault = Fault {
    name: "profile_error",
    summary: "all profiles off by 2 µm at the mesh order",
    usual: |_| {
        Parameters::of(&[
            ("a1_mm", 2e-3),
            ("ph1_rad", 0.7),
            ("a2_mm", 8e-4),
            ("ph2_rad", 2.0),
            ("a3_mm", 4e-4),
            ("ph3_rad", 4.0),
        ])
    },
    vary: |_, usual, rng| {
        usual
            .with("ph1_rad", rng.angle())
            .with("a2_mm", 1e-3 * rng.between(0.0, 1.0))
            .with("ph2_rad", rng.angle())
            .with("a3_mm", 5e-4 * rng.between(0.0, 1.0))
            .with("ph3_rad", rng.angle())
    },
    amounts: &[("a1_mm", 1.0), ("a2_mm", 1.0), ("a3_mm", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY_EVEN.over(Carrier::Mesh)),
    same_trace_as: None,
    apply: |spec, parameters| {
        spec.teeth.profile = [(1, "a1_mm", "ph1_rad"), (2, "a2_mm", "ph2_rad"), (3, "a3_mm", "ph3_rad")]
            .map(|(order, amplitude, phase)| ProfileOrder {
                order,
                amplitude_mm: parameters.number(amplitude),
                phase_rad: parameters.number(phase),
            })
            .to_vec();
    },
};

/// Material is missing on one flank of one tooth of the driver: the driven gear lags by depth · cos²(π u/(2 w)) along the normal
/// where the tooth is |u| < w pitches from the pitch point.
pub const TOOTH_DAMAGE: Fault = Fault {
    name: "tooth_damage",
    summary: "tooth 12's ccw flank is pitted 15 µm deep",
    usual: |_| Parameters::of(&[("tooth", 12.0), ("depth_mm", 0.015), ("width", 0.6)]).with("flank", "ccw"),
    vary: |spec, usual, rng| {
        usual
            .with("flank", if rng.sign() > 0.0 { "ccw" } else { "cw" })
            .with("tooth", rng.below(spec.gears.teeth[0] as usize) as f64)
            .with("width", rng.between(0.4, 1.2))
    },
    amounts: &[("depth_mm", 1.0)],
    develops: false,
    signature: Some(Signature { parity: Some(Parity::OneFlank), ..Signature::STEADY }),
    same_trace_as: None,
    apply: |spec, parameters| {
        spec.teeth.damage = Some(DamageSpec {
            tooth: parameters.number("tooth") as u32,
            flank: if parameters.word("flank") == "cw" { Flank::Cw } else { Flank::Ccw },
            depth_mm: parameters.number("depth_mm"),
            width: parameters.number("width"),
        });
    },
};
