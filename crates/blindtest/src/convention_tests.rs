//! Labels mean what the contract says: what each effect adds on the running rig is its first-order formula, with the label's names,
//! signs and phases, written down here from theory.

use std::f64::consts::TAU;

use gearmodel::{Direction, NominalModel};

use super::campaign::{self, RunPlan, WithheldCampaign, WithheldPlan};
use rigsim::plant::faults::{FaultRng, Parameters, find};

/// Where the formula is evaluated.
struct At {
    theta1: f64,
    theta2: f64,
    dir: f64,
    load_nm: f64,
    rad_per_s: f64,
    time_s: f64,
    ratio: f64,
    /// r2 and the effective pressure angle α ∓ μ of the flank.
    r2_mm: f64,
    angle: f64,
    /// C_out + C_in i² + C_mesh/arm², rad/(N·m).
    compliance: f64,
    ratio_slope: f64,
}

impl At {
    fn arm_mm(&self) -> f64 {
        self.r2_mm * self.angle.cos()
    }
}

fn at(model: &NominalModel, run: &RunPlan, [theta1, theta2]: [f64; 2], time_s: f64) -> At {
    let (pair, dir) = (&model.pair, run.direction.sign());
    let angle = pair.pressure_angle_rad() - dir * pair.inclination(theta1);
    let (ratio, r2_mm) = (pair.ratio(theta1), pair.driven_radius(theta1));
    let errors = &model.errors;
    At {
        theta1,
        theta2,
        dir,
        load_nm: run.load_nm,
        rad_per_s: run.speed_rpm * TAU / 60.0,
        time_s,
        ratio,
        r2_mm,
        angle,
        compliance: errors.shaft_compliance_output_rad_per_nm
            + errors.shaft_compliance_input_rad_per_nm * ratio * ratio
            + errors.mesh_compliance_mm2_rad_per_nm / (r2_mm * angle.cos()).powi(2),
        ratio_slope: (pair.ratio(theta1 + 1e-5) - pair.ratio(theta1 - 1e-5)) / 2e-5,
    }
}

/// TE that an effect adds, from theory.md §3 and §6 and the contract's table.
fn formula(name: &str, p: &Parameters, x: &At) -> f64 {
    let n = |key: &str| p.number(key);
    let displaced = |dx: f64, dy: f64, turn: f64| (dx.hypot(dy), turn + dy.atan2(dx));
    let wind_up = |compliance: f64| -x.dir * x.load_nm * compliance;
    let cardan = |turn: f64| (0.5 * n("beta_rad")).tan().powi(2) * (2.0 * turn - n("phase_rad")).sin();
    match name {
        // [e1 sin(u ± (α∓μ)) + e2 sin(v ∓ (α∓μ))]/(r2 cos(α∓μ)), upper sign ccw.
        "gear1_eccentricity" => {
            let (e, u) = displaced(n("dx_mm"), n("dy_mm"), x.theta1);
            e * (u + x.dir * x.angle).sin() / x.arm_mm()
        }
        "gear2_eccentricity" => {
            let (e, v) = displaced(n("dx_mm"), n("dy_mm"), x.theta2);
            e * (v - x.dir * x.angle).sin() / x.arm_mm()
        }
        "centre_distance_error" => -x.dir * n("da_mm") * x.angle.tan() / x.r2_mm,
        "thermal_drift" => -x.dir * n("da_mm") * -(-x.time_s / n("tau_s")).exp_m1() * x.angle.tan() / x.r2_mm,
        "backlash_error" => -x.dir * 0.5 * n("dj_mm") * 20f64.to_radians().cos() / x.arm_mm(),
        "bearing_clearance" => -x.dir * n("c_mm") / x.arm_mm(),
        "pitch_curve_error" => {
            let k: f64 = 0.3287;
            n("dk") * 2.0 * x.theta1.sin() / (1.0 - 2.0 * k * x.theta1.cos() + k * k)
        }
        "phasing_error" => x.ratio * n("delta_rad"),
        "encoder1_eccentricity" => -x.ratio * n("eps") * (x.theta1 - n("phase_rad")).sin(),
        "encoder2_eccentricity" => n("eps") * (x.theta2 - n("phase_rad")).sin(),
        "encoder1_ellipticity" => -x.ratio * n("eps") * (2.0 * x.theta1 - n("phase_rad")).sin(),
        "encoder2_ellipticity" => n("eps") * (2.0 * x.theta2 - n("phase_rad")).sin(),
        "encoder1_interpolation" => -x.ratio * n("a_rad") * (n("lines") * x.theta1 - n("phase_rad")).sin(),
        "encoder2_interpolation" => n("a_rad") * (n("lines") * x.theta2 - n("phase_rad")).sin(),
        "coupling_misalignment_input" => x.ratio * cardan(x.theta1),
        "coupling_misalignment_output" => cardan(x.theta2),
        // θ2 read dt later has turned on by then.
        "time_skew" => n("dt_s") * x.dir * x.rad_per_s * x.ratio,
        "shaft_compliance_input" => wind_up(n("c_rad_per_nm") * x.ratio * x.ratio),
        "shaft_compliance_output" => wind_up(n("c_rad_per_nm")),
        "mesh_compliance" => wind_up(n("c_mm2_rad_per_nm") / x.arm_mm().powi(2)),
        "bearing_compliance" => wind_up(1000.0 * n("c_mm_per_n") / x.arm_mm().powi(2)),
        "friction_windup" => -x.dir * n("torque_nm") * x.compliance,
        "brake_torque_ripple" => wind_up(x.compliance) * n("rho") * (n("n") * x.theta2 - n("phase_rad")).sin(),
        "torsional_resonance" => -x.rad_per_s.powi(2) * x.ratio_slope / (TAU * n("f_hz")).powi(2),
        other => panic!("no formula for {other}"),
    }
}

fn plan() -> WithheldPlan {
    let condition = |direction, load_nm, speed_rpm| RunPlan { direction, load_nm, speed_rpm };
    let (ccw, cw) = (Direction::Ccw, Direction::Cw);
    WithheldPlan {
        runs: vec![
            condition(ccw, 2.0, 5.0),
            condition(cw, 2.0, 5.0),
            condition(ccw, 12.0, 10.0),
            condition(cw, 12.0, 10.0),
        ],
        revolutions: 1.0,
        rate_hz: 250.0,
    }
}

/// RMS of what the effect adds, and of what its formula leaves of it, the zero of either removed.
fn explained(name: &str, model: &NominalModel, sound: &WithheldCampaign) -> (f64, f64) {
    let mut spec = crate::plant_of_pair::plant_of_pair(model).unwrap().quiet();
    let fault = find(name).unwrap();
    let parameters = fault.draw(&spec, &mut FaultRng::new(77));
    (fault.apply)(&mut spec, &parameters);
    let changed = campaign::run(&spec, &plan(), 3).unwrap();
    let start = changed.runs[0].from;
    // Both rigs against the nominal model, so that they need not stand at the same angle.
    let te = |campaign: &WithheldCampaign, run: &RunPlan, sample: usize| {
        let [theta1, theta2] = campaign.angles_rad(sample);
        theta2 - model.pair.theta2(theta1) - model.te_rad(theta1, run.direction, run.load_nm)
    };
    let (mut added, mut left) = (Vec::new(), Vec::new());
    for (span, plain) in changed.runs.iter().zip(&sound.runs) {
        let offset =
            (plain.from..plain.to).map(|n| te(sound, &plain.plan, n)).sum::<f64>() / (plain.to - plain.from) as f64;
        for sample in span.from..span.to {
            let measured = te(&changed, &span.plan, sample) - offset;
            let time_s = (sample - start) as f64 / changed.rate_hz;
            let expected = formula(name, &parameters, &at(model, &span.plan, changed.angles_rad(sample), time_s));
            added.push(measured);
            left.push(measured - expected);
        }
    }
    let spread = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
    };
    (spread(&added), spread(&left))
}

#[test]
fn every_label_reproduces_what_it_did() {
    let (_, model) = riglog::pair::load(None).unwrap();
    let sound = campaign::run(&crate::plant_of_pair::plant_of_pair(&model).unwrap().quiet(), &plan(), 3).unwrap();
    let names = [
        "gear1_eccentricity",
        "gear2_eccentricity",
        "centre_distance_error",
        "thermal_drift",
        "backlash_error",
        "bearing_clearance",
        "pitch_curve_error",
        "phasing_error",
        "encoder1_eccentricity",
        "encoder2_eccentricity",
        "encoder1_ellipticity",
        "encoder2_ellipticity",
        "coupling_misalignment_input",
        "coupling_misalignment_output",
        "time_skew",
        "shaft_compliance_input",
        "shaft_compliance_output",
        "mesh_compliance",
        "bearing_compliance",
        "friction_windup",
        "brake_torque_ripple",
        "torsional_resonance",
    ];
    for name in names {
        let (added, left) = explained(name, &model, &sound);
        // 0.7 µrad of counting and second order of the sound rig are always left.
        assert!(left < 1e-6 + 0.04 * added, "{name}: {left:.2e} of {added:.2e} rad is left");
        assert!(added > 1e-5, "{name}: {added:.2e}");
    }
    // The offset of the signals is a third of them, and its second order half of that square.
    for name in ["encoder1_interpolation", "encoder2_interpolation"] {
        let (added, left) = explained(name, &model, &sound);
        assert!(left < 0.25 * added, "{name}: {left:.2e} of {added:.2e} rad is left");
    }
}
