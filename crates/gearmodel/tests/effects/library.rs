//! What the library holds, against lists kept by hand: the one place of the tests that a new effect may have to be added to.

use std::collections::BTreeMap;

use gearmodel::effect::{Accumulates, Parity};

use super::*;

#[test]
fn a_drive_without_teeth_has_no_effects_of_teeth() {
    let rig = rig(&GearPair::constant(101.0).unwrap());
    let mut left_out: Vec<_> = LIBRARY.iter().filter(|e| !e.applies(&rig)).map(|e| e.name()).collect();
    left_out.sort_unstable();
    let mut expected = [
        "bearing_compliance",
        "centre_distance_error",
        "gear1_eccentricity",
        "gear2_eccentricity",
        "mesh_compliance",
        "mesh_stiffness_variation",
        "pitch_errors",
        "profile_error",
        "thermal_drift",
        "tooth_damage",
        "wear_drift",
    ];
    expected.sort_unstable();
    assert_eq!(left_out, expected);
    // r2 = 1 mm and α = 0 stand in: a play of 1 mm along the normal is 1 rad.
    let at = operating_point(&rig, 0.3, Direction::Ccw);
    assert!((row(&rig, "bearing_clearance", &[], &at)[0] + 1.0).abs() < 1e-15);
    assert!((row(&rig, "backlash_error", &[], &at)[0] + 0.5).abs() < 1e-15);
    let stiff = NominalRig::new(rig.pair().clone(), Errors::default(), [None; 2], None);
    assert_eq!(row(&stiff, "friction_windup", &[], &at), [-1.0]);
}

#[test]
fn what_grows_says_so() {
    let grows: Vec<_> =
        LIBRARY.iter().filter(|e| e.signature().accumulates != Accumulates::No).map(|e| e.name()).collect();
    assert_eq!(grows, ["count_loss", "slip", "thermal_drift", "wear_drift"]);
    let rig = rig(&elliptic(0.3287));
    let closure = by_name("pitch_curve_error").unwrap().signature_of(&rig, &vec![1.0]);
    assert_eq!((closure.accumulates, closure.parity), (Accumulates::PerRevolution, Parity::Odd));
    for effect in LIBRARY.iter().filter(|e| e.signature().accumulates != Accumulates::No) {
        assert!(effect.evolves(&Vec::new()), "{}", effect.name());
    }
}

#[test]
fn an_effect_has_words_of_its_own_and_shares_a_family_with_one_other() {
    let mut plain_names: Vec<_> = LIBRARY.iter().map(|effect| effect.words().plain_name).collect();
    plain_names.sort_unstable();
    plain_names.dedup();
    assert_eq!(plain_names.len(), LIBRARY.len());
    let mut families: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for effect in LIBRARY {
        let words = effect.words();
        assert!(!words.remedy.is_empty() && words.plain_name != effect.name(), "{}", effect.name());
        if let Some(family) = words.family {
            families.entry(family).or_default().push(effect.name());
        }
    }
    assert_eq!(families.len(), 6);
    for names in families.values() {
        // One name is the other's with the other shaft in it.
        let other = |name: &str| name.replace('1', "2").replace("_input", "_output");
        assert!(matches!(names[..], [input, output] if other(input) == output), "{names:?}");
    }
}
