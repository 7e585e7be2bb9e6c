//! Limits and symmetries that hold for every pair, and refusals of every invalid one.

#![allow(clippy::unwrap_used)] // helpers of tests may

use std::f64::consts::{PI, TAU};

use gearmodel::increment::common_normal;
use gearmodel::{CircularSpec, Direction, EllipticalSpec, Errors, GearPair, NominalModel, PairFile, ToothSpec};
use proptest::prelude::*;

fn any_pair() -> impl Strategy<Value = GearPair> {
    (0.0..0.85_f64, 17_u32..80, 0.5..8.0_f64, 14.5..25.0_f64, 0.0..0.3_f64).prop_map(
        |(k, teeth, module, alpha, backlash)| {
            GearPair::elliptical(&EllipticalSpec {
                eccentricity: k,
                teeth: ToothSpec {
                    module_mm: module,
                    teeth: (teeth, teeth),
                    pressure_angle_deg: alpha,
                    backlash_mm: backlash,
                    ..Default::default()
                },
            })
            .unwrap()
        },
    )
}

fn any_errors() -> impl Strategy<Value = Errors> {
    (0.0..0.1_f64, -PI..PI, 0.0..0.1_f64, -PI..PI, 0.0..1e-4_f64, 0.0..1e-4_f64, 0.0..1e-2_f64).prop_map(
        |(e1_mm, phi1_rad, e2_mm, phi2_rad, output, input, mesh)| Errors {
            e1_mm,
            phi1_rad,
            e2_mm,
            phi2_rad,
            shaft_compliance_output_rad_per_nm: output,
            shaft_compliance_input_rad_per_nm: input,
            mesh_compliance_mm2_rad_per_nm: mesh,
        },
    )
}

/// Numbers that break things.
fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(0.0),
        Just(-0.0),
        Just(f64::MIN_POSITIVE),
        Just(f64::MAX),
        Just(-1.0),
        -1e3..1e3_f64,
        0.0..2.0_f64,
        any::<f64>(),
    ]
}

/// A pair that was accepted must give finite numbers everywhere.
fn assert_finite(pair: &GearPair) {
    for theta1 in [-10.0, -PI, 0.0, 0.1, 1.0, PI, TAU, 1e4] {
        let at = pair.at(theta1);
        for value in [at.theta2_rad, at.ratio, at.r1_mm, at.r2_mm, at.mu_rad, pair.arc_length_mm(theta1)] {
            assert!(value.is_finite(), "{pair:?} at {theta1}: {at:?}");
        }
        for direction in Direction::BOTH {
            assert!(common_normal::te_rad(pair, &Errors::default(), theta1, direction).is_finite());
        }
    }
}

proptest! {
    #[test]
    fn f_is_increasing_periodic_odd_and_inverts(pair in any_pair(), theta in -30.0..30.0_f64, step in 1e-6..1.0_f64) {
        let f = pair.theta2(theta);
        prop_assert!(pair.theta2(theta + step) > f);
        prop_assert!((pair.theta2(theta + TAU) - f - TAU).abs() < 1e-12);
        prop_assert!((pair.theta2(-theta) + f).abs() < 1e-13);
        prop_assert!((pair.theta2_inverse(f) - theta).abs() < 1e-11);
    }

    #[test]
    fn ratio_is_the_slope_of_f_and_radii_add_up(pair in any_pair(), theta in -7.0..7.0_f64) {
        let h = 1e-5;
        let slope = (pair.theta2(theta + h) - pair.theta2(theta - h)) / (2.0 * h);
        prop_assert!((slope / pair.ratio(theta) - 1.0).abs() < 1e-5);
        let at = pair.at(theta);
        prop_assert!((at.r1_mm + at.r2_mm - pair.centre_distance_mm()).abs() < 1e-10);
        prop_assert_eq!(at.r1_mm, at.r1_mm.clamp(0.0, pair.centre_distance_mm()));
        // ds = r1/cos mu dtheta
        let speed = (pair.arc_length_mm(theta + h) - pair.arc_length_mm(theta - h)) / (2.0 * h);
        prop_assert!((speed * at.mu_rad.cos() / at.r1_mm - 1.0).abs() < 1e-5);
    }

    #[test]
    fn the_driven_gear_rolls_the_same_arc(pair in any_pair(), theta in 0.0..TAU) {
        // The driven gear is the driver's twin, half a turn on: s measured on either curve is the same.
        let on_driven = pair.arc_length_mm(PI) - pair.arc_length_mm(PI - pair.theta2(theta));
        prop_assert!((on_driven - pair.arc_length_mm(theta)).abs() < 1e-9 * pair.perimeter_mm());
        let turn = pair.arc_length_mm(theta + TAU) - pair.arc_length_mm(theta);
        prop_assert!((turn - PI * pair.module_mm() * f64::from(pair.teeth().0)).abs() < 1e-10 * turn);
    }

    #[test]
    fn backlash_is_the_difference_of_the_senses(
        pair in any_pair(), errors in any_errors(), theta in -7.0..7.0_f64, load in 0.0..50.0_f64,
    ) {
        let designed_at = pair.at(theta);
        let designed = common_normal::designed_backlash_te_rad(&pair, &designed_at, Direction::Cw)
            - common_normal::designed_backlash_te_rad(&pair, &designed_at, Direction::Ccw);
        prop_assert!(designed >= 0.0);
        let variation = common_normal::backlash_variation_rad(&pair, &errors, theta);
        let difference = common_normal::backlash_rad(&pair, &errors, theta);
        prop_assert!((difference - variation - designed).abs() < 1e-12);
        let model = NominalModel::new(pair, errors).unwrap();
        let loaded = model.te_rad(theta, Direction::Cw, load) - model.te_rad(theta, Direction::Ccw, load);
        prop_assert_eq!(model.backlash_rad(theta, load), loaded);
        // The wind-up always adds to what a reversal finds.
        prop_assert!(loaded >= difference - 1e-15);
    }

    #[test]
    fn eccentricity_is_a_rigid_displacement(pair in any_pair(), errors in any_errors(), theta in -7.0..7.0_f64) {
        let at = pair.at(theta);
        let (u, v) = (theta + errors.phi1_rad, at.theta2_rad + errors.phi2_rad);
        // The pitch curves' centres: gear 1 at e1 (cos u, sin u), gear 2 at e2 (cos v, -sin v); TE follows from the difference.
        let delta = (errors.e1_mm * u.cos() - errors.e2_mm * v.cos(), errors.e1_mm * u.sin() + errors.e2_mm * v.sin());
        for direction in Direction::BOTH {
            let te = common_normal::eccentricity_te_rad(&pair, &errors, &at, direction);
            let moved = common_normal::displacement_te_rad(&pair, &at, delta, direction);
            prop_assert!((te - moved).abs() < 1e-13);
        }
    }

    #[test]
    fn a_round_ellipse_is_a_circle(teeth in 17_u32..80, k in 0.0..1e-9_f64, theta in -7.0..7.0_f64, errors in any_errors()) {
        let equal = ToothSpec { teeth: (teeth, teeth), ..Default::default() };
        let ellipse = GearPair::elliptical(&EllipticalSpec { eccentricity: k, teeth: equal }).unwrap();
        let circle = GearPair::circular(&CircularSpec { teeth: (teeth, teeth), ..Default::default() }).unwrap();
        prop_assert!((ellipse.theta2(theta) - circle.theta2(theta)).abs() <= 3.0 * k + 1e-14);
        for direction in Direction::BOTH {
            let difference = common_normal::te_rad(&ellipse, &errors, theta, direction)
                - common_normal::te_rad(&circle, &errors, theta, direction);
            prop_assert!(difference.abs() < 1e-11);
        }
    }

    #[test]
    fn no_number_makes_a_pair_panic_or_nan(
        module_mm in any_number(), teeth in (0_u32..200, 0_u32..200), same in any::<bool>(), eccentricity in any_number(),
        pressure_angle_deg in prop_oneof![Just(20.0), any_number()], distance in proptest::option::of(any_number()),
        rest in (any_number(), any_number(), any_number(), any_number()), sane in any::<bool>(),
    ) {
        let teeth = if same { (teeth.0, teeth.0) } else { teeth };
        let (backlash_mm, face_width_mm, addendum, dedendum_clearance) = if sane { (0.0, 30.0, 1.0, 0.25) } else { rest };
        let spec = ToothSpec {
            module_mm, teeth, pressure_angle_deg, centre_distance_mm: distance, backlash_mm, face_width_mm, addendum,
            dedendum_clearance,
        };
        match GearPair::elliptical(&EllipticalSpec { teeth: spec.clone(), eccentricity }) {
            Ok(pair) => assert_finite(&pair),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
        if let Ok(pair) = GearPair::circular(&spec) {
            assert_finite(&pair);
        }
        if let Ok(pair) = GearPair::constant(module_mm) {
            assert_finite(&pair);
        }
    }

    #[test]
    fn no_text_makes_a_pair_file_panic(text in "[a-z_]{0,12} ?= ?[-0-9.einfa\\[\\]\",]{0,12}\n[a-z_\\[\\]=0-9. \n]{0,40}") {
        if let Err(error) = PairFile::parse(&text) {
            prop_assert!(error.to_string().starts_with("pair file"));
        }
    }
}
