//! TE of many angles at once is the TE of each.

#![allow(clippy::unwrap_used)] // helpers of tests may

use std::f64::consts::TAU;

use gearmodel::contact::{ContactError, ContactModel, Profile, ToothDamage, ToothErrors};
use gearmodel::{CircularSpec, CurveSpec, Direction, EllipticalSpec, Errors, GearPair, ToothSpec};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const ERRORS: Errors = Errors { e1_mm: 0.05, phi1_rad: 0.3, e2_mm: 0.03, phi2_rad: 1.1, ..Errors::NONE };

/// A pair of every kind.
fn pairs() -> Vec<GearPair> {
    let mut pairs: Vec<GearPair> = [0.0, 0.2, 0.3287, 0.6, 0.8]
        .map(|k| GearPair::elliptical(&EllipticalSpec { eccentricity: k, ..Default::default() }).unwrap())
        .into();
    for teeth in [(47, 47), (20, 33), (33, 20)] {
        pairs.push(GearPair::circular(&CircularSpec { teeth, backlash_mm: 0.1, ..Default::default() }).unwrap());
    }
    let teeth = |z1, z2| ToothSpec { teeth: (z1, z2), ..Default::default() };
    let fourier = CurveSpec::Fourier { cosines: vec![0.1, 0.02], sines: vec![0.0, 0.01] };
    let theta1_rad: Vec<f64> = (0..40).map(|n| TAU * f64::from(n) / 40.0).collect();
    let radius = theta1_rad.iter().map(|theta| 40.0 + 3.0 * theta.cos()).collect();
    for (curve, teeth) in [
        (CurveSpec::Lobed { eccentricity: 0.1, lobes: (2, 3) }, teeth(48, 72)),
        (CurveSpec::Lobed { eccentricity: 0.05, lobes: (3, 3) }, teeth(60, 60)),
        (fourier, teeth(40, 40)),
        (CurveSpec::Sampled { theta1_rad, radius }, teeth(41, 41)),
    ] {
        pairs.push(GearPair::free(&teeth, &curve).unwrap());
    }
    pairs
}

/// Leads of every tooth of both gears, −1 to 1 times `size_mm`.
fn uneven(pair: &GearPair, size_mm: f64, random: &mut Pcg64Mcg) -> ToothErrors {
    let mut table = |teeth: u32| (0..teeth).map(|_| size_mm * random.random_range(-1.0..1.0)).collect::<Vec<f64>>();
    let (z1, z2) = pair.teeth();
    ToothErrors {
        driver_pitch_mm: [table(z1), table(z1)],
        driven_pitch_mm: [table(z2), table(z2)],
        ..Default::default()
    }
}

/// Largest difference between the curve and the single angles, rad.
fn worst(model: &ContactModel, theta1_rad: &[f64]) -> f64 {
    let mut worst = 0.0_f64;
    for direction in Direction::BOTH {
        let te_rad = model.te_curve_rad(theta1_rad, direction).unwrap();
        for (theta, te) in theta1_rad.iter().zip(te_rad) {
            worst = worst.max((te - model.te_rad(*theta, direction).unwrap()).abs());
        }
    }
    worst
}

#[test]
fn a_curve_is_its_angles_for_every_kind_of_pair_and_error() {
    let mut random = Pcg64Mcg::seed_from_u64(7);
    for pair in pairs() {
        let rigid = ContactModel::new(pair.clone(), &ERRORS).unwrap().with_displacement(0.02, -0.03).unwrap();
        // Sorted over a turn, and in any order over as many as the teeth take to meet again.
        let sorted: Vec<f64> = (0..1500).map(|n| TAU * f64::from(n) / 1500.0).collect();
        let scattered: Vec<f64> = (0..3000).map(|_| random.random_range(-30.0..30.0)).collect();
        for size_mm in [0.0, 0.002, 0.05, 0.3] {
            let model = if size_mm == 0.0 {
                rigid.clone()
            } else {
                rigid.clone().with_tooth_errors(uneven(&pair, size_mm, &mut random)).unwrap()
            };
            for angles in [&sorted, &scattered] {
                let worst = worst(&model, angles);
                assert!(worst < 1e-10, "{} {:?}, {size_mm} mm: {worst:e}", pair.kind(), pair.teeth());
            }
        }
    }
}

#[test]
fn all_pairs_of_rigidly_displaced_gears_agree() {
    // Equal leads on all teeth but one, whose lead differs by what cannot matter: whichever pair carries, ψ2 is the same.
    for pair in pairs() {
        let rigid = ContactModel::new(pair.clone(), &ERRORS).unwrap();
        let mut teeth = ToothErrors::default();
        teeth.driver_pitch_mm = [0, 1].map(|_| (0..pair.teeth().0).map(|n| 1e-12 * f64::from(n % 2)).collect());
        let each_for_itself = rigid.clone().with_tooth_errors(teeth).unwrap();
        for step in 0..200 {
            let theta1 = TAU * f64::from(step) / 200.0;
            for direction in Direction::BOTH {
                let difference =
                    rigid.te_rad(theta1, direction).unwrap() - each_for_itself.te_rad(theta1, direction).unwrap();
                assert!(difference.abs() < 1e-12, "{} {theta1}: {difference:e}", pair.kind());
            }
        }
    }
}

#[test]
fn shapes_along_the_flank_gaps_and_few_angles_are_solved_one_by_one() {
    let pair = GearPair::elliptical(&EllipticalSpec::default()).unwrap();
    let damage = ToothDamage { tooth: 3, flank: Direction::Cw, depth_mm: 0.02, width: 1.0 };
    let profile = Profile { crown_mm: 0.01, ..Default::default() };
    let teeth = ToothErrors { damage: vec![damage], profile: [profile, Profile::default()], ..Default::default() };
    let model = ContactModel::new(pair, &ERRORS).unwrap().with_tooth_errors(teeth).unwrap();
    let angles: Vec<f64> = (0..400).map(|n| TAU * f64::from(n) / 400.0).collect();
    assert_eq!(worst(&model, &angles), 0.0);
    assert_eq!(worst(&model, &angles[..5]), 0.0);

    let rigid = ContactModel::new(model.pair().clone(), &ERRORS).unwrap();
    let mut gaps = angles;
    (gaps[7], gaps[300]) = (f64::NAN, f64::INFINITY);
    let te_rad = rigid.te_curve_rad(&gaps, Direction::Ccw).unwrap();
    for (index, te) in te_rad.iter().enumerate() {
        assert_eq!(te.is_nan(), index == 7 || index == 300, "{index}");
    }
    assert!(rigid.te_curve_rad(&[], Direction::Cw).unwrap().is_empty());
}

#[test]
fn angles_between_the_tips_are_the_error_that_one_alone_is() {
    // Stub teeth: the contact ratio is below 1, so that some angles have no pair.
    let spec = CircularSpec { teeth: (20, 20), addendum: 0.4, ..Default::default() };
    let model = ContactModel::new(GearPair::circular(&spec).unwrap(), &Errors::default()).unwrap();
    let angles: Vec<f64> = (0..2000).map(|n| TAU * f64::from(n) / 2000.0).collect();
    let first = angles.iter().find_map(|theta| model.te_rad(*theta, Direction::Ccw).err()).unwrap();
    assert!(matches!(first, ContactError::NoPairInZone { .. }));
    assert_eq!(model.te_curve_rad(&angles, Direction::Ccw), Err(first));
    let drive = ContactModel::new(GearPair::constant(3.0).unwrap(), &Errors::default()).unwrap();
    assert_eq!(drive.te_curve_rad(&angles, Direction::Ccw), Err(ContactError::NoTeeth));
}
