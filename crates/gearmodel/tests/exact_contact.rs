//! Exact contact against the reference tables, the closed form of eccentric involute gears, and the first-order model.

#![allow(clippy::unwrap_used)] // helpers of tests may

use std::f64::consts::{PI, TAU};

use gearmodel::contact::{ContactModel, Profile, ToothDamage, ToothErrors};
use gearmodel::increment::common_normal;
use gearmodel::{CircularSpec, Direction, EllipticalSpec, Errors, GearPair, ToothSpec};
use proptest::prelude::*;

const ERRORS: Errors = Errors { e1_mm: 0.05, phi1_rad: 0.3, e2_mm: 0.03, phi2_rad: 1.1, ..Errors::NONE };

fn elliptic(k: f64) -> GearPair {
    GearPair::elliptical(&EllipticalSpec { eccentricity: k, ..Default::default() }).unwrap()
}

#[test]
fn reference_tables() {
    let tables = [
        (elliptic(0.3287), concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/reference/te_elliptic_k0.3287.csv")),
        (elliptic(1e-12), concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/reference/te_circular_k0.csv")),
    ];
    for (pair, path) in tables {
        let model = ContactModel::new(pair, &ERRORS).unwrap();
        let mut worst = 0.0_f64;
        for line in std::fs::read_to_string(path).unwrap().lines().filter(|line| !line.starts_with('#')).skip(1) {
            let values: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
            for (direction, expected) in [(Direction::Ccw, values[2]), (Direction::Cw, values[3])] {
                worst = worst.max((model.te_rad(values[0], direction).unwrap() - expected).abs());
            }
        }
        assert!(worst < 1e-8, "{path}: {worst:e}");
        println!("{path}: {worst:e} rad");
    }
}

/// Driven angle of eccentric involute gears in closed form: rb1 ψ1 − rb2 ψ2 = (rb1 + rb2)(γ ± inv α') + const.
fn eccentric_involute_te(teeth: (u32, u32), errors: &Errors, theta1: f64, direction: Direction) -> f64 {
    let (r1, r2) = (1.5 * f64::from(teeth.0), 1.5 * f64::from(teeth.1));
    let alpha = 20.0_f64.to_radians();
    let (base1, base2) = (r1 * alpha.cos(), r2 * alpha.cos());
    let involute = |angle: f64| angle.tan() - angle;
    let nominal = theta1 * f64::from(teeth.0) / f64::from(teeth.1);
    let mut psi2 = nominal;
    for _ in 0..50 {
        let (u, v) = (theta1 + errors.phi1_rad, psi2 + errors.phi2_rad);
        let x = r1 + r2 + errors.e2_mm * v.cos() - errors.e1_mm * u.cos();
        let y = -errors.e2_mm * v.sin() - errors.e1_mm * u.sin();
        let working = ((base1 + base2) / x.hypot(y)).acos();
        let shift = y.atan2(x) + direction.sign() * (involute(working) - involute(alpha));
        psi2 = (base1 * theta1 - (base1 + base2) * shift) / base2;
    }
    psi2 - nominal
}

#[test]
fn circular_gears_obey_the_closed_form() {
    for teeth in [(47, 47), (20, 33), (33, 20), (80, 17)] {
        let pair = GearPair::circular(&CircularSpec { teeth, ..Default::default() }).unwrap();
        for errors in [ERRORS, Errors { e1_mm: 0.1, e2_mm: 0.1, phi1_rad: -2.0, phi2_rad: 0.4, ..ERRORS }] {
            let model = ContactModel::new(pair.clone(), &errors).unwrap();
            for step in 0..500 {
                let theta1 = 0.037 * f64::from(step) - 3.0;
                for direction in Direction::BOTH {
                    let expected = eccentric_involute_te(teeth, &errors, theta1, direction);
                    let found = model.te_rad(theta1, direction).unwrap();
                    assert!((found - expected).abs() < 1e-9, "{teeth:?} {direction} {theta1}: {found} {expected}");
                }
            }
        }
    }
}

#[test]
fn a_perfect_pair_has_no_error_and_designed_backlash_follows_the_first_order() {
    for k in [0.0, 0.3287, 0.6] {
        let spec = EllipticalSpec { eccentricity: k, teeth: ToothSpec { backlash_mm: 0.1, ..Default::default() } };
        let thin = ContactModel::new(GearPair::elliptical(&spec).unwrap(), &Errors::default()).unwrap();
        let perfect = ContactModel::new(elliptic(k), &Errors::default()).unwrap();
        for step in 0..200 {
            let theta1 = TAU * f64::from(step) / 200.0;
            for direction in Direction::BOTH {
                assert!(perfect.te_rad(theta1, direction).unwrap().abs() < 1e-12);
                let exact = thin.te_rad(theta1, direction).unwrap();
                let first_order = common_normal::te_rad(thin.pair(), &Errors::default(), theta1, direction);
                assert!((exact / first_order - 1.0).abs() < 1e-3, "k = {k}, {theta1}: {exact} {first_order}");
            }
        }
    }
}

#[test]
fn first_order_stays_within_a_thousandth() {
    // RMS(exact − common normal)/RMS(exact): 0.03 % at k = 0.3287, 0.07 % at k = 0.6
    for (k, limit) in [(0.3287, 4e-4), (0.6, 8e-4)] {
        let model = ContactModel::new(elliptic(k), &ERRORS).unwrap();
        let (mut difference, mut size) = (0.0, 0.0);
        for step in 0..720 {
            let theta1 = TAU * f64::from(step) / 720.0;
            for direction in Direction::BOTH {
                let exact = model.te_rad(theta1, direction).unwrap();
                difference += (exact - model.first_order_te_rad(theta1, direction).unwrap()).powi(2);
                size += exact * exact;
            }
        }
        let ratio = f64::sqrt(difference / size);
        assert!(ratio < limit && ratio > 0.1 * limit, "k = {k}: {ratio}");
    }
}

#[test]
fn a_pitch_error_of_every_tooth_alike_is_a_lead() {
    let lead = 0.01;
    for direction in Direction::BOTH {
        let side = usize::from(direction == Direction::Cw);
        let mut teeth = ToothErrors::default();
        teeth.driver_pitch_mm[side] = vec![lead; 47];
        let model = ContactModel::new(elliptic(0.3287), &Errors::default()).unwrap().with_tooth_errors(teeth).unwrap();
        for step in 0..100 {
            let theta1 = 0.1 * f64::from(step);
            let at = model.pair().at(theta1);
            let expected = lead / common_normal::driven_base_arm_mm(model.pair(), &at, direction);
            let found = model.te_rad(theta1, direction).unwrap();
            assert!((found / expected - 1.0).abs() < 1e-3, "{direction} {theta1}: {found} {expected}");
            assert!(model.te_rad(theta1, direction.reversed()).unwrap().abs() < 1e-12);
        }
    }
}

#[test]
fn the_most_advanced_tooth_carries_while_it_is_in_contact() {
    let lead = 0.01;
    for direction in Direction::BOTH {
        let side = usize::from(direction == Direction::Cw);
        let mut table = vec![0.0; 47];
        table[5] = direction.sign() * lead;
        let mut teeth = ToothErrors::default();
        teeth.driver_pitch_mm[side] = table;
        let model = ContactModel::new(elliptic(0.3287), &Errors::default()).unwrap().with_tooth_errors(teeth).unwrap();
        let (mut carried, mut steps) = (0, 0);
        for step in 0..4700 {
            let theta1 = TAU * f64::from(step) / 4700.0;
            let contact = model.contact(theta1, direction).unwrap();
            assert!((1..=2).contains(&contact.pairs_in_zone), "{contact:?}");
            assert!(
                (contact.te_rad != 0.0 && contact.te_rad.abs() > 1e-6)
                    == (contact.tooth.rem_euclid(47) == 5 && contact.te_rad.abs() > 1e-6)
            );
            if contact.te_rad.abs() > 1e-6 {
                assert_eq!(contact.te_rad.signum(), direction.sign());
                carried += 1;
            }
            steps += 1;
        }
        // A tooth stays in contact for the contact ratio's share of a 47th of the perimeter (over θ1 it varies with r1).
        let share = f64::from(carried) / f64::from(steps) * 47.0;
        assert!((1.0..3.0).contains(&share), "{share}");
    }
}

#[test]
fn a_lagging_or_damaged_tooth_shows_only_while_it_is_alone() {
    let damage = ToothDamage { tooth: 10, flank: Direction::Cw, depth_mm: 0.02, width: 2.0 };
    let teeth = ToothErrors { damage: vec![damage], ..Default::default() };
    let model = ContactModel::new(elliptic(0.3287), &Errors::default()).unwrap().with_tooth_errors(teeth).unwrap();
    let mut lags = 0;
    for step in 0..9400 {
        let theta1 = TAU * f64::from(step) / 9400.0;
        assert!(model.te_rad(theta1, Direction::Ccw).unwrap().abs() < 1e-12);
        let contact = model.contact(theta1, Direction::Cw).unwrap();
        // A lag in cw rotation is a positive TE.
        assert!(contact.te_rad > -1e-12);
        if contact.te_rad > 1e-6 {
            assert_eq!((contact.pairs_in_zone, contact.tooth), (1, 10));
            lags += 1;
        }
    }
    let share = f64::from(lags) / 200.0;
    assert!((0.05..0.9).contains(&share), "{share}");
}

#[test]
fn a_long_wave_on_the_profile_moves_the_contact_a_little() {
    let amplitude = 0.002;
    let profile = Profile { waves: vec![(amplitude, 0.3)], ..Default::default() };
    let teeth = ToothErrors { profile: [profile.clone(), profile], ..Default::default() };
    let model = ContactModel::new(elliptic(0.3287), &ERRORS).unwrap().with_tooth_errors(teeth).unwrap();
    let mut apart = 0;
    for step in 0..300 {
        let theta1 = TAU * f64::from(step) / 300.0;
        for direction in Direction::BOTH {
            let exact = model.te_rad(theta1, direction).unwrap();
            let first_order = model.first_order_te_rad(theta1, direction).unwrap();
            // The displaced gears hand over a little earlier or later than the nominal ones.
            apart += u32::from((exact - first_order).abs() > 5e-6);
        }
    }
    assert!(apart < 12, "{apart} of 600");
}

#[test]
fn bad_tooth_errors_are_refused() {
    let model = || ContactModel::new(elliptic(0.3), &Errors::default()).unwrap();
    let short = ToothErrors { driver_pitch_mm: [vec![0.0; 46], vec![]], ..Default::default() };
    assert!(model().with_tooth_errors(short).unwrap_err().to_string().contains("46"));
    let nan = ToothErrors { driven_pitch_mm: [vec![f64::NAN; 47], vec![]], ..Default::default() };
    assert!(model().with_tooth_errors(nan).is_err());
    let damage = ToothDamage { tooth: 47, flank: Direction::Ccw, depth_mm: 0.1, width: 1.0 };
    assert!(model().with_tooth_errors(ToothErrors { damage: vec![damage], ..Default::default() }).is_err());
    assert!(model().with_displacement(f64::NAN, 0.0).is_err());
    assert!(model().te_rad(f64::NAN, Direction::Ccw).is_err());
    let constant = ContactModel::new(GearPair::constant(81.0).unwrap(), &Errors::default()).unwrap();
    assert!(constant.te_rad(0.0, Direction::Ccw).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn first_order_holds_over_the_range(
        k in 0.0..0.6_f64, teeth in 24_u32..80, e1 in 0.0..0.1_f64, phi1 in -PI..PI, e2 in 0.0..0.1_f64, phi2 in -PI..PI,
        delta in (-0.1..0.1_f64, -0.1..0.1_f64),
    ) {
        let spec = EllipticalSpec { eccentricity: k, teeth: ToothSpec { teeth: (teeth, teeth), ..Default::default() } };
        let errors = Errors { e1_mm: e1, phi1_rad: phi1, e2_mm: e2, phi2_rad: phi2, ..Default::default() };
        let model = ContactModel::new(GearPair::elliptical(&spec).unwrap(), &errors).unwrap().with_displacement(delta.0, delta.1).unwrap();
        let size = (e1 + e2 + delta.0.hypot(delta.1)) / model.pair().driven_radius(0.0);
        for step in 0..36 {
            let theta1 = TAU * f64::from(step) / 36.0;
            for direction in Direction::BOTH {
                let exact = model.te_rad(theta1, direction).unwrap();
                let first_order = model.first_order_te_rad(theta1, direction).unwrap();
                prop_assert!((exact - first_order).abs() < 0.03 * size, "{theta1} {direction}: {exact} {first_order}");
            }
        }
    }
}
