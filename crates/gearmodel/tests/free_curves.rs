//! Free pitch curves against the closed forms they contain.

#![allow(clippy::unwrap_used)] // helpers of tests may

use std::f64::consts::TAU;

use gearmodel::contact::ContactModel;
use gearmodel::{CurveSpec, Direction, EllipticalSpec, Errors, GearPair, GeometryError, ToothSpec};
use proptest::prelude::*;

fn teeth(z1: u32, z2: u32) -> ToothSpec {
    ToothSpec { teeth: (z1, z2), ..Default::default() }
}

fn assert_same(one: &GearPair, other: &GearPair, tolerance: f64) {
    assert!((one.centre_distance_mm() / other.centre_distance_mm() - 1.0).abs() < tolerance);
    for step in -60..60 {
        let theta = 0.21 * f64::from(step);
        let (a, b) = (one.roll(theta), other.roll(theta));
        let close = |name: &str, x: f64, y: f64, slack: f64| {
            assert!((x - y).abs() < slack * tolerance * (1.0 + y.abs()), "{name} at {theta}: {x} {y}");
        };
        close("f", a.at.theta2_rad, b.at.theta2_rad, 1.0);
        close("i", a.at.ratio, b.at.ratio, 10.0);
        close("mu", a.at.mu_rad, b.at.mu_rad, 100.0);
        close("mu'", a.mu_slope, b.mu_slope, 1e6);
        close("s", a.arc_mm, b.arc_mm, 1.0);
        close("inverse", one.theta2_inverse(b.at.theta2_rad), theta, 10.0);
    }
}

#[test]
fn an_ellipse_is_the_transmission_with_geometric_harmonics() {
    // (1 − k²)/(1 − 2k cos θ + k²) = 1 + 2 Σ kⁿ cos nθ
    let k = 0.3287_f64;
    let cosines: Vec<f64> = (1..40).map(|n| 2.0 * k.powi(n)).collect();
    let curve = CurveSpec::Transmission { cosines, sines: vec![] };
    let pair = GearPair::free(&teeth(47, 47), &curve).unwrap();
    let ellipse = GearPair::elliptical(&EllipticalSpec { eccentricity: k, ..Default::default() }).unwrap();
    assert_same(&pair, &ellipse, 1e-13);
}

#[test]
fn an_ellipse_by_its_radius_and_by_samples() {
    // 1/(1 − k cos θ) ∝ 1 + 2 Σ qⁿ cos nθ, q = (1 − √(1 − k²))/k
    let k = 0.4_f64;
    let q = (1.0 - (1.0 - k * k).sqrt()) / k;
    let cosines: Vec<f64> = (1..40).map(|n| 2.0 * q.powi(n)).collect();
    let ellipse = GearPair::elliptical(&EllipticalSpec { eccentricity: k, ..Default::default() }).unwrap();
    let fourier = GearPair::free(&teeth(47, 47), &CurveSpec::Fourier { cosines, sines: vec![] }).unwrap();
    assert_same(&fourier, &ellipse, 1e-12);
    let theta1_rad: Vec<f64> = (0..360).map(|n| TAU * f64::from(n) / 360.0).collect();
    let radius = theta1_rad.iter().map(|theta| 17.0 / (1.0 - k * theta.cos())).collect();
    let sampled = GearPair::free(&teeth(47, 47), &CurveSpec::Sampled { theta1_rad, radius }).unwrap();
    assert_same(&sampled, &ellipse, 1e-8);
}

#[test]
fn lobed_mates_of_different_tooth_numbers() {
    let k = 0.2_f64;
    let q = (1.0 - (1.0 - k * k).sqrt()) / k;
    for (lobes, z) in [((2, 3), (40, 60)), ((1, 2), (30, 60)), ((3, 2), (60, 40)), ((2, 2), (44, 44))] {
        let pair = GearPair::free(&teeth(z.0, z.1), &CurveSpec::Lobed { eccentricity: k, lobes }).unwrap();
        let mut cosines = vec![0.0; 24 * lobes.0 as usize];
        for n in 1..24 {
            cosines[n * lobes.0 as usize - 1] = 2.0 * q.powi(n as i32);
        }
        let fourier = GearPair::free(&teeth(z.0, z.1), &CurveSpec::Fourier { cosines, sines: vec![] }).unwrap();
        assert_same(&fourier, &pair, 1e-11);
        // A turn of the driven gear rolls π m Z2.
        let turn = pair.theta2_inverse(TAU);
        assert!((pair.arc_length_mm(turn) - std::f64::consts::PI * 3.0 * f64::from(z.1)).abs() < 1e-9);
        // Perfect teeth have no error, whatever the curve.
        let contact = ContactModel::new(pair, &Errors::default()).unwrap();
        for step in 0..200 {
            for direction in Direction::BOTH {
                assert!(contact.te_rad(0.1 * f64::from(step), direction).unwrap().abs() < 1e-12);
            }
        }
    }
}

#[test]
fn what_cannot_close_is_refused_with_its_reason() {
    let lobed = CurveSpec::Lobed { eccentricity: 0.2, lobes: (2, 3) };
    let error = GearPair::free(&teeth(40, 50), &lobed).unwrap_err();
    assert!(matches!(error, GeometryError::TeethRatio { needed: 60.0, .. }), "{error}");
    let waves = CurveSpec::Fourier { cosines: vec![0.0, 0.1], sines: vec![] };
    let error = GearPair::free(&teeth(30, 20), &waves).unwrap_err();
    assert!(matches!(error, GeometryError::Harmonic { order: 2, needed: 3, .. }), "{error}");
    let deep = CurveSpec::Fourier { cosines: vec![1.0], sines: vec![0.5] };
    assert!(matches!(GearPair::free(&teeth(30, 30), &deep), Err(GeometryError::NotPositive { .. })));
    let spec = ToothSpec { centre_distance_mm: Some(100.0), ..teeth(40, 60) };
    let error = GearPair::free(&spec, &lobed).unwrap_err();
    assert!(matches!(error, GeometryError::NotClosing { .. }), "{error}");
    let backwards = CurveSpec::Sampled { theta1_rad: vec![0.0, 2.0, 1.0, 3.0], radius: vec![1.0; 4] };
    assert!(matches!(GearPair::free(&teeth(30, 30), &backwards), Err(GeometryError::Sample { index: 2, .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn the_first_order_holds_within_its_stated_limit(
        order in 1_u32..4, k in 0.0..0.6_f64, z in 17_u32..80, share in 0.0..1.0_f64, phi1 in -3.1..3.1_f64,
        phi2 in -3.1..3.1_f64, swap in any::<bool>(), delta in (0.0..1.0_f64, -3.1..3.1_f64),
    ) {
        // Concave above k = 1/(n² − 1).
        let z = z / order * order;
        let curve = CurveSpec::Lobed { eccentricity: k, lobes: (order, order) };
        let Ok(pair) = GearPair::free(&teeth(z, z), &curve) else { return Ok(()) };
        let Some(limit) = pair.first_order_limit_mm() else { return Ok(()) };
        let limit = limit.min(0.1);
        let large = limit / (1.0 + share + delta.0);
        let (small, displaced) = (share * large, delta.0 * large);
        let (e1_mm, e2_mm) = if swap { (small, large) } else { (large, small) };
        let errors = Errors { e1_mm, phi1_rad: phi1, e2_mm, phi2_rad: phi2, ..Default::default() };
        let alone = if swap { Errors { e1_mm: 0.0, ..errors } } else { Errors { e2_mm: 0.0, ..errors } };
        let model = ContactModel::new(pair.clone(), &errors).unwrap();
        let model = model.with_displacement(displaced * delta.1.cos(), displaced * delta.1.sin()).unwrap();
        for direction in Direction::BOTH {
            let (mut low, mut high, mut apart) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
            for step in 0..120 {
                let theta1 = TAU * f64::from(step) / 120.0;
                // Deeply concave curves lose contact between two pairs.
                let Ok(exact) = model.te_rad(theta1, direction) else { return Ok(()) };
                let single = gearmodel::increment::common_normal::te_rad(&pair, &alone, theta1, direction);
                low = low.min(single);
                high = high.max(single);
                let Ok(first_order) = model.first_order_te_rad(theta1, direction) else { return Ok(()) };
                apart = apart.max((exact - first_order).abs());
            }
            prop_assert!(apart <= 1e-3 * (high - low), "{} of {}: {}", apart, high - low, apart / (high - low));
        }
    }
}

fn any_list() -> impl Strategy<Value = Vec<f64>> {
    let number = prop_oneof![8 => -0.3..0.3_f64, 1 => Just(f64::NAN), 1 => any::<f64>(), 2 => Just(0.0)];
    proptest::collection::vec(number, 0..7)
}

fn assert_finite(pair: &GearPair) {
    for theta in [-4.0, 0.0, 1.0, 3.0, 100.0] {
        let roll = pair.roll(theta);
        let values = [
            roll.at.theta2_rad,
            roll.at.ratio,
            roll.at.r1_mm,
            roll.at.r2_mm,
            roll.at.mu_rad,
            roll.mu_slope,
            roll.arc_mm,
        ];
        assert!(values.iter().all(|value| value.is_finite()), "{roll:?}");
        assert!((pair.theta2(theta + TAU) - roll.at.theta2_rad - TAU * pair.closure()).abs() < 1e-9);
        assert!((pair.theta2_inverse(roll.at.theta2_rad) - theta).abs() < 1e-7);
    }
    match pair.check_teeth() {
        Ok(()) => {}
        Err(error) => assert!(!error.to_string().contains("NaN"), "{error}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn no_free_curve_panics(
        z in (4_u32..90, 4_u32..90), same in any::<bool>(), cosines in any_list(), sines in any_list(), k in -0.1..1.1_f64,
        lobes in (0_u32..5, 0_u32..5),
    ) {
        let spec = teeth(z.0, if same { z.0 } else { z.1 });
        let theta1_rad: Vec<f64> = (0..cosines.len()).map(|n| n as f64).collect();
        let curves = [
            CurveSpec::Lobed { eccentricity: k, lobes },
            CurveSpec::Fourier { cosines: cosines.clone(), sines: sines.clone() },
            CurveSpec::Transmission { cosines: cosines.clone(), sines },
            CurveSpec::Sampled { theta1_rad, radius: cosines.iter().map(|value| 1.0 + value).collect() },
        ];
        for curve in curves {
            if let Ok(pair) = GearPair::free(&spec, &curve) {
                assert_finite(&pair);
                if let Ok(contact) = ContactModel::new(pair, &Errors::default()) {
                    for direction in Direction::BOTH {
                        if let Ok(te) = contact.te_rad(1.0, direction) {
                            prop_assert!(te.abs() < 1e-9, "{te}");
                        }
                    }
                }
            }
        }
    }
}
