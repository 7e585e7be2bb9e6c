//! Every effect of the library against an independent reference, a limit or a symmetry.

#![allow(clippy::unwrap_used)] // helpers of tests may

mod library;
mod ringing;
mod signatures;
mod teeth;

use std::f64::consts::TAU;

use gearmodel::contact::ContactModel;
use gearmodel::effect::{
    Estimate, LIBRARY, MeasurementPlan, NominalRig, OperatingPoint, ParameterKind, Value, by_name,
};
use gearmodel::increment::common_normal;
use gearmodel::{CircularSpec, CurveSpec, Direction, EllipticalSpec, Errors, GearPair, NominalModel, ToothSpec};
use nalgebra::DMatrix;

/// Documented compliances, so that friction and ripple have something to wind up.
const SOFT: Errors = Errors {
    e1_mm: 0.02,
    phi1_rad: 0.3,
    e2_mm: 0.01,
    phi2_rad: 1.1,
    shaft_compliance_output_rad_per_nm: 8e-6,
    shaft_compliance_input_rad_per_nm: 5e-6,
    mesh_compliance_mm2_rad_per_nm: 0.02,
};
const LOAD_NM: f64 = 10.0;
const RPM: f64 = 5.0;

fn elliptic(k: f64) -> GearPair {
    GearPair::elliptical(&EllipticalSpec { eccentricity: k, ..Default::default() }).unwrap()
}

fn circular(teeth: (u32, u32)) -> GearPair {
    GearPair::circular(&CircularSpec { teeth, ..Default::default() }).unwrap()
}

fn free(teeth: (u32, u32), curve: &CurveSpec) -> GearPair {
    GearPair::free(&ToothSpec { teeth, ..Default::default() }, curve).unwrap()
}

/// One of every kind that has teeth: the document's, unequal circles, unequal lobes, a curve without symmetry.
fn toothed() -> Vec<GearPair> {
    vec![
        elliptic(0.3287),
        circular((23, 47)),
        free((40, 60), &CurveSpec::Lobed { eccentricity: 0.2, lobes: (2, 3) }),
        free((47, 47), &CurveSpec::Fourier { cosines: vec![0.2, 0.03], sines: vec![0.05] }),
    ]
}

fn rig(pair: &GearPair) -> NominalRig {
    NominalModel::new(pair.clone(), SOFT).unwrap().rig([Some(3600.0), Some(3600.0)], Some(7.2e6))
}

fn plan() -> MeasurementPlan {
    let speeds_rad_per_s = [2.5, 5.0, 10.0].map(|rpm| rpm * TAU / 60.0).to_vec();
    MeasurementPlan {
        loads_nm: vec![0.5, 5.0, 10.0, 15.0],
        speeds_rad_per_s,
        senses: [true, true],
        duration_s: 600.0,
        starts_s: Vec::new(),
        runs: 12,
        revolutions: 48.0,
        turns: [1.0, 1.0],
    }
}

fn operating_point(rig: &NominalRig, theta1_rad: f64, direction: Direction) -> OperatingPoint {
    let mut at = rig.operating_point(theta1_rad, rig.pair().theta2(theta1_rad), direction);
    at.load_nm = LOAD_NM;
    at.speed_rad_per_s = direction.sign() * RPM * TAU / 60.0;
    at.time_s = 100.0;
    at
}

fn row(rig: &NominalRig, name: &str, shape: &[f64], at: &OperatingPoint) -> Vec<f64> {
    let (effect, shape) = (by_name(name).unwrap(), shape.to_vec());
    let mut row = vec![0.0; effect.width(rig, &shape)];
    effect.row(rig, &shape, at, &mut row);
    row
}

/// Angles that hit no symmetry, over more than a turn.
fn angles(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |n| 0.0137 - TAU + 2.5 * TAU * n as f64 / count as f64)
}

fn places(count: usize) -> impl Iterator<Item = (f64, Direction)> {
    angles(count).flat_map(|theta| Direction::BOTH.map(|direction| (theta, direction)))
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// What is left of `exact` after `trace`, in parts of its RMS.
fn left(trace: &[f64], exact: &[f64]) -> f64 {
    let size = rms(exact);
    assert!(size > 0.0 && size.is_finite());
    rms(&trace.iter().zip(exact).map(|(t, e)| t - e).collect::<Vec<_>>()) / size
}

/// A trace against an exact one, both a function of rig, angle and sense.
fn compare(
    rig: &NominalRig,
    what: &str,
    tolerance: f64,
    trace: impl Fn(&OperatingPoint) -> f64,
    exact: impl Fn(f64, Direction) -> f64,
) {
    let (mut traces, mut exacts) = (Vec::new(), Vec::new());
    for (theta, direction) in places(60) {
        traces.push(trace(&operating_point(rig, theta, direction)));
        exacts.push(exact(theta, direction));
    }
    let rest = left(&traces, &exacts);
    assert!(rest < tolerance, "{what}, {}: {rest:.2e} is left", rig.pair().kind());
}

#[test]
fn every_trace_is_finite_on_every_kind_of_pair() {
    let mut pairs = toothed();
    pairs.push(GearPair::constant(101.0).unwrap());
    for pair in pairs {
        let rig = rig(&pair);
        for effect in LIBRARY.iter().filter(|effect| effect.applies(&rig)) {
            for shape in effect.shapes(&rig, &plan()) {
                for (theta, direction) in places(12) {
                    let values = row(&rig, effect.name(), &shape, &operating_point(&rig, theta, direction));
                    assert!(values.iter().all(|x| x.is_finite()), "{} {shape:?} on {}", effect.name(), pair.kind());
                }
                let found = estimate(vec![1e-3; effect.width(&rig, &shape)]);
                let parameters = effect.parameters(&rig, &shape, &found);
                assert!(!parameters.is_empty());
                for parameter in parameters {
                    let fitted = matches!(parameter.kind, ParameterKind::Fitted | ParameterKind::Phase);
                    let fitted_number = fitted && matches!(parameter.value, Value::Number(_));
                    assert_eq!(parameter.std.is_some(), fitted_number, "{} of {}", parameter.name, effect.name());
                }
            }
        }
    }
}

fn estimate(beta: Vec<f64>) -> Estimate {
    let covariance = DMatrix::identity(beta.len(), beta.len()) * 1e-12;
    Estimate { beta, covariance }
}

/// (te(+) − te(−))/2 of exact contact, which is free of second order.
fn slope([more, less]: &[ContactModel; 2], theta: f64, direction: Direction) -> f64 {
    0.5 * (more.te_rad(theta, direction).unwrap() - less.te_rad(theta, direction).unwrap())
}

#[test]
fn displaced_gears_are_those_of_exact_contact() {
    let amount_mm = 0.004;
    for pair in toothed() {
        let rig = rig(&pair);
        let displaced = |gear: usize, dx: f64, dy: f64| {
            let vector = |e: f64, phi: f64, own: bool| {
                let add = if own { [dx, dy] } else { [0.0; 2] };
                let (x, y) = (e * phi.cos() + add[0], e * phi.sin() + add[1]);
                (x.hypot(y), y.atan2(x))
            };
            let (e1_mm, phi1_rad) = vector(SOFT.e1_mm, SOFT.phi1_rad, gear == 1);
            let (e2_mm, phi2_rad) = vector(SOFT.e2_mm, SOFT.phi2_rad, gear == 2);
            let errors = Errors { e1_mm, phi1_rad, e2_mm, phi2_rad, ..Errors::default() };
            ContactModel::new(pair.clone(), &errors).unwrap()
        };
        for (gear, name) in [(1, "gear1_eccentricity"), (2, "gear2_eccentricity")] {
            for axis in 0..2 {
                let models = [1.0, -1.0]
                    .map(|sign| displaced(gear, sign * amount_mm * (1 - axis) as f64, sign * amount_mm * axis as f64));
                compare(
                    &rig,
                    name,
                    0.01,
                    |at| amount_mm * row(&rig, name, &[], at)[axis],
                    |theta, direction| slope(&models, theta, direction),
                );
            }
        }
        let perfect = ContactModel::new(pair.clone(), &Errors::default()).unwrap();
        let moved =
            |dx: f64, dy: f64| [1.0, -1.0].map(|sign| perfect.clone().with_displacement(sign * dx, sign * dy).unwrap());
        let apart = moved(-amount_mm, 0.0);
        compare(
            &rig,
            "centre_distance_error",
            0.01,
            |at| amount_mm * row(&rig, "centre_distance_error", &[], at)[0],
            |theta, direction| slope(&apart, theta, direction),
        );
        // The load pushes the gear back along the normal of the flank that drives.
        compare(
            &rig,
            "bearing_clearance",
            0.01,
            |at| amount_mm * row(&rig, "bearing_clearance", &[], at)[0],
            |theta, direction| {
                let angle = common_normal::effective_pressure_angle_rad(&pair, &pair.at(theta), direction);
                let (nx, ny) = (angle.sin(), direction.sign() * angle.cos());
                slope(&moved(-amount_mm * nx, -amount_mm * ny), theta, direction)
            },
        );
    }
}

#[test]
fn thinner_teeth_are_those_of_exact_contact() {
    let dj_mm = 0.01;
    type Build<'a> = &'a dyn Fn(f64) -> GearPair;
    let ellipse: Build = &|backlash_mm| {
        GearPair::elliptical(&EllipticalSpec {
            teeth: ToothSpec { backlash_mm, ..Default::default() },
            ..Default::default()
        })
        .unwrap()
    };
    let circles: Build = &|backlash_mm| {
        GearPair::circular(&CircularSpec { teeth: (23, 47), backlash_mm, ..Default::default() }).unwrap()
    };
    for build in [ellipse, circles] {
        let rig = rig(&build(0.05));
        let exact = [1.0, -1.0].map(|sign| ContactModel::new(build(0.05 + sign * dj_mm), &Errors::default()).unwrap());
        compare(
            &rig,
            "backlash_error",
            0.01,
            |at| dj_mm * row(&rig, "backlash_error", &[], at)[0],
            |theta, direction| slope(&exact, theta, direction),
        );
    }
}

#[test]
fn curves_and_clocking_are_differences_of_the_transmission() {
    for k in [0.05, 0.3287, 0.6] {
        let (rig, dk) = (rig(&elliptic(k)), 1e-5);
        let (more, less) = (elliptic(k + dk), elliptic(k - dk));
        compare(
            &rig,
            "pitch_curve_error",
            1e-6,
            |at| dk * row(&rig, "pitch_curve_error", &[0.0], at)[0],
            |theta, _| 0.5 * (more.theta2(theta) - less.theta2(theta)),
        );
    }
    for (teeth, lobes) in [((40, 60), (2, 3)), ((60, 40), (3, 2)), ((30, 60), (1, 2)), ((44, 44), (2, 2))] {
        let lobed = |eccentricity: f64| free(teeth, &CurveSpec::Lobed { eccentricity, lobes });
        let (rig, dk) = (rig(&lobed(0.15)), 1e-5);
        let (more, less) = (lobed(0.15 + dk), lobed(0.15 - dk));
        compare(
            &rig,
            "pitch_curve_error",
            1e-6,
            |at| dk * row(&rig, "pitch_curve_error", &[0.0], at)[0],
            |theta, _| 0.5 * (more.theta2(theta) - less.theta2(theta)),
        );
    }
    for pair in toothed() {
        let (rig, delta) = (rig(&pair), 1e-5);
        compare(
            &rig,
            "phasing_error",
            1e-6,
            |at| delta * row(&rig, "phasing_error", &[], at)[0],
            |theta, _| 0.5 * (pair.theta2(theta + delta) - pair.theta2(theta - delta)),
        );
        // A wrong ratio is the same angle every turn.
        let at = |theta: f64| row(&rig, "pitch_curve_error", &[1.0], &operating_point(&rig, theta, Direction::Cw))[0];
        assert!((at(1.3 + TAU) - at(1.3) - TAU).abs() < 1e-12);
    }
    // Another k has no meaning where there is no k.
    let shapes = by_name("pitch_curve_error").unwrap().shapes(&rig(&circular((23, 47))), &plan());
    assert_eq!(shapes, [[1.0]]);
}

#[test]
fn wind_up_is_the_nominal_models() {
    for pair in toothed() {
        let rig = rig(&pair);
        let te = |errors: Errors, theta: f64, direction: Direction, load_nm: f64| {
            NominalModel::new(pair.clone(), errors).unwrap().te_rad(theta, direction, load_nm)
        };
        let mut cases = vec![("shaft_compliance_output", SOFT, 1e-6, 1.0); 4];
        cases[0].1.shaft_compliance_output_rad_per_nm += 1e-6;
        cases[1].0 = "shaft_compliance_input";
        cases[1].1.shaft_compliance_input_rad_per_nm += 1e-6;
        cases[2] = ("mesh_compliance", Errors { mesh_compliance_mm2_rad_per_nm: 0.02 + 1e-3, ..SOFT }, 1e-3, 1.0);
        // 1000 c_b is a mesh compliance.
        cases[3] = ("bearing_compliance", Errors { mesh_compliance_mm2_rad_per_nm: 0.02 + 1e-3, ..SOFT }, 1e-3, 1e-3);
        for (name, softer, amount, unit) in cases {
            compare(
                &rig,
                name,
                1e-9,
                |at| amount * unit * row(&rig, name, &[], at)[0],
                |theta, direction| te(softer, theta, direction, LOAD_NM) - te(SOFT, theta, direction, LOAD_NM),
            );
        }
        // Drag winds the train up as a load of its size would.
        compare(
            &rig,
            "friction_windup",
            1e-12,
            |at| 1.5 * row(&rig, "friction_windup", &[], at)[0],
            |theta, direction| te(SOFT, theta, direction, 1.5) - te(SOFT, theta, direction, 0.0),
        );
        let (rho, order, phase) = (0.05, 3.0, 0.8_f64);
        compare(
            &rig,
            "brake_torque_ripple",
            1e-9,
            |at| {
                let row = row(&rig, "brake_torque_ripple", &[order], at);
                rho * (phase.cos() * row[0] - phase.sin() * row[1])
            },
            |theta, direction| {
                let torque_nm = LOAD_NM * (1.0 + rho * (order * pair.theta2(theta) - phase).sin());
                te(SOFT, theta, direction, torque_nm) - te(SOFT, theta, direction, LOAD_NM)
            },
        );
    }
}

/// a sin(x − φ) in columns sin x, cos x.
fn polar(amplitude: f64, phase: f64, row: &[f64]) -> f64 {
    amplitude * (phase.cos() * row[0] - phase.sin() * row[1])
}

#[test]
fn discs_and_couplings_are_those_of_exact_geometry() {
    let phase = 0.9_f64;
    let wrap = |angle: f64| angle - TAU * (angle / TAU).round();
    // Reading errors: angle of a point of the track about the displaced centre; of a squeezed track; of displaced signals.
    let disc = |eps: f64| move |t: f64| wrap((t.sin() - eps * phase.sin()).atan2(t.cos() - eps * phase.cos()) - t);
    let squeezed = |eps: f64| {
        move |t: f64| {
            let x = t - 0.5 * phase;
            wrap(((1.0 + eps) * x.sin()).atan2((1.0 - eps) * x.cos()) - x)
        }
    };
    let lines = 3600.0;
    let signals = |a: f64| {
        move |t: f64| {
            let (x, o) = (lines * t, a * lines);
            wrap((x.sin() - o * phase.sin()).atan2(x.cos() - o * phase.cos()) - x) / lines
        }
    };
    // tan θ' = tan θ/cos β.
    let cardan = |beta: f64| {
        move |t: f64| {
            let x = t - 0.5 * phase;
            wrap(x.sin().atan2(x.cos() * beta.cos()) - x)
        }
    };
    for pair in toothed() {
        let rig = rig(&pair);
        type Reading<'a> = &'a dyn Fn(f64) -> f64;
        let cases: [(&str, &str, Vec<f64>, f64, Reading); 3] = [
            ("encoder1_eccentricity", "encoder2_eccentricity", vec![], 4e-5, &disc(4e-5)),
            ("encoder1_ellipticity", "encoder2_ellipticity", vec![], 4e-5, &squeezed(4e-5)),
            ("encoder1_interpolation", "encoder2_interpolation", vec![1.0, lines], 1e-6, &signals(1e-6)),
        ];
        for (input, output, shape, amount, reading) in cases {
            let trace = |name: &str, at: &OperatingPoint| polar(amount, phase, &row(&rig, name, &shape, at));
            // The input encoder reads too much, so that less is expected to have been driven.
            compare(
                &rig,
                input,
                0.01,
                |at| trace(input, at),
                |theta, _| pair.theta2(theta) - pair.theta2(theta + reading(theta)),
            );
            compare(&rig, output, 0.01, |at| trace(output, at), |theta, _| reading(pair.theta2(theta)));
        }
        let beta = 0.02_f64;
        let (turned, amount) = (cardan(beta), 0.25 * beta * beta);
        let trace = |name: &str, at: &OperatingPoint| polar(amount, phase, &row(&rig, name, &[], at));
        compare(
            &rig,
            "coupling_misalignment_input",
            1e-3,
            |at| trace("coupling_misalignment_input", at),
            |theta, _| pair.theta2(theta + turned(theta)) - pair.theta2(theta),
        );
        compare(
            &rig,
            "coupling_misalignment_output",
            1e-3,
            |at| trace("coupling_misalignment_output", at),
            |theta, _| turned(pair.theta2(theta)),
        );
        let found = estimate(vec![amount * phase.cos(), -amount * phase.sin()]);
        let found = by_name("coupling_misalignment_input").unwrap().parameters(&rig, &vec![], &found);
        let Value::Number(angle) = found[0].value else { panic!("an angle is a number") };
        assert!((angle / beta - 1.0).abs() < 1e-9);
        let dt_s = 1e-4;
        compare(
            &rig,
            "time_skew",
            1e-3,
            |at| dt_s * row(&rig, "time_skew", &[], at)[0],
            |theta, direction| {
                let step = direction.sign() * RPM * TAU / 60.0 * dt_s;
                pair.theta2(theta + step) - pair.theta2(theta)
            },
        );
    }
}

/// Stations of a turn in both senses.
fn turn(rig: &NominalRig) -> Vec<OperatingPoint> {
    (0..720).flat_map(|n| Direction::BOTH.map(|d| operating_point(rig, TAU * f64::from(n) / 720.0, d))).collect()
}

#[test]
fn stiffness_varies_about_its_mean_where_the_teeth_change() {
    for pair in toothed() {
        let rig = rig(&pair);
        for direction in Direction::BOTH {
            for shape in [vec![0.3, -0.15], vec![0.6, 0.0], vec![]] {
                let (mut sum, mut most) = (0.0, 0.0_f64);
                let count = 4000;
                for n in 0..count {
                    let pitches = f64::from(n) * f64::from(pair.teeth().0) / f64::from(count);
                    let theta = pair.theta1_at_arc_length(pitches * pair.pitch_mm().unwrap());
                    let at = operating_point(&rig, theta, direction);
                    let scaled =
                        row(&rig, "mesh_stiffness_variation", &shape, &at)[0] * at.arm_mm * at.arm_mm / LOAD_NM;
                    sum += scaled;
                    most = most.max(scaled.abs());
                }
                assert!((sum / f64::from(count)).abs() < 0.01, "{shape:?} {}: {sum}", pair.kind());
                assert!(most > 0.3);
            }
            // One pair alone at the pitch point is softer: a lag.
            let half = if direction == Direction::Ccw { 0.0 } else { 0.5 };
            let at =
                operating_point(&rig, pair.theta1_at_arc_length((3.0 + half) * pair.pitch_mm().unwrap()), direction);
            for shape in [vec![0.3, -0.15], vec![]] {
                assert!(row(&rig, "mesh_stiffness_variation", &shape, &at)[0] * direction.sign() < 0.0, "{shape:?}");
            }
        }
    }
}

#[test]
fn heat_grows_the_centre_distance_and_saturates() {
    for pair in toothed() {
        let (rig, tau_s) = (rig(&pair), 40.0);
        for (theta, direction) in places(20) {
            let mut at = operating_point(&rig, theta, direction);
            let full = row(&rig, "centre_distance_error", &[], &at)[0];
            for (time_s, share) in [(0.0, 0.0), (tau_s, 1.0 - (-1.0_f64).exp()), (1e5, 1.0)] {
                at.time_s = time_s;
                at.load_nm = 3.0 + time_s;
                assert!((row(&rig, "thermal_drift", &[tau_s], &at)[0] - share * full).abs() < 1e-12);
            }
        }
    }
}
