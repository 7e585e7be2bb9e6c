//! The model against the reference tables and the numbers of the theory.

#![allow(clippy::unwrap_used)] // helpers of tests may

use gearmodel::increment::{common_normal, published};
use gearmodel::{CircularSpec, Direction, EllipticalSpec, Errors, GearPair, GeometryError, ToothSpec};

const ERRORS: Errors = Errors { e1_mm: 0.05, phi1_rad: 0.3, e2_mm: 0.03, phi2_rad: 1.1, ..Errors::NONE };

const ELLIPTIC: &str =
    include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/reference/te_elliptic_k0.3287.csv"));
const CIRCULAR: &str =
    include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/reference/te_circular_k0.csv"));

/// Rows of a table: theta1, theta2, exact ccw/cw, common normal ccw/cw, published ccw/cw, backlash variation.
fn rows(table: &str) -> impl Iterator<Item = [f64; 9]> {
    table.lines().filter(|line| !line.starts_with('#')).skip(1).map(|line| {
        let values: Vec<f64> = line.split(',').map(|field| field.trim().parse().unwrap()).collect();
        values.try_into().unwrap()
    })
}

fn source_pair() -> GearPair {
    GearPair::elliptical(&EllipticalSpec::default()).unwrap()
}

fn check_table(table: &str, pair: &GearPair) {
    let mut count = 0;
    for [theta1, theta2, _, _, ccw, cw, published_ccw, published_cw, backlash] in rows(table) {
        let close = |name: &str, value: f64, expected: f64| {
            assert!((value - expected).abs() < 1e-10, "{name} at {theta1}: {value} {expected}");
        };
        close("f", pair.theta2(theta1), theta2);
        close("ccw", common_normal::te_rad(pair, &ERRORS, theta1, Direction::Ccw), ccw);
        close("cw", common_normal::te_rad(pair, &ERRORS, theta1, Direction::Cw), cw);
        close("published ccw", published::te_rad(pair, &ERRORS, theta1, Direction::Ccw), published_ccw);
        close("published cw", published::te_rad(pair, &ERRORS, theta1, Direction::Cw), published_cw);
        close("b_v", common_normal::backlash_variation_rad(pair, &ERRORS, theta1), backlash);
        close("b_v as a difference", common_normal::backlash_rad(pair, &ERRORS, theta1), backlash);
        count += 1;
    }
    assert!(count >= 60, "{count} rows");
}

#[test]
fn elliptic_table() {
    check_table(ELLIPTIC, &source_pair());
}

#[test]
fn circular_table_by_both_kinds_of_pair() {
    check_table(CIRCULAR, &GearPair::circular(&CircularSpec::default()).unwrap());
    check_table(
        CIRCULAR,
        &GearPair::elliptical(&EllipticalSpec { eccentricity: 1e-12, ..Default::default() }).unwrap(),
    );
}

#[test]
fn sizes_of_the_elliptic_pairs() {
    // k, A, a, p, largest ratio, largest inclination in deg, closure sum at 150 mm
    let table = [
        (0.0, 70.5, 141.0, 70.5, 1.0, 0.0, 0.886_792),
        (0.2, 71.217_608, 142.435_217, 68.368_904, 1.5, 11.537, 0.900_555),
        (0.3287, 72.499_859, 144.999_717, 64.666_706, 1.979_294, 19.190, 0.928_484),
        (0.4, 73.536_145, 147.072_290, 61.770_362, 2.333_333, 23.578, 0.954_905),
        (0.6, 78.092_122, 156.184_243, 49.978_958, 4.0, 36.870, 1.145_328),
    ];
    for (k, semi_major, distance, parameter, ratio, inclination, closure) in table {
        let spec = EllipticalSpec { eccentricity: k, ..Default::default() };
        let pair = GearPair::elliptical(&spec).unwrap();
        let close = |value: f64, expected: f64, tolerance: f64| {
            assert!((value - expected).abs() <= tolerance, "k = {k}: {value} {expected}");
        };
        close(pair.semi_major_mm(), semi_major, 6e-7);
        close(pair.centre_distance_mm(), distance, 6e-7);
        close(pair.radius(std::f64::consts::FRAC_PI_2), parameter, 6e-7);
        close(pair.ratio(0.0), ratio, 6e-7);
        close(pair.inclination(-k.acos()).to_degrees(), inclination, 6e-4);
        close(pair.perimeter_mm(), std::f64::consts::PI * 3.0 * 47.0, 1e-9);
        let with_distance = |mm: f64| EllipticalSpec {
            eccentricity: k,
            teeth: ToothSpec { centre_distance_mm: Some(mm), ..Default::default() },
        };
        match GearPair::elliptical(&with_distance(150.0)) {
            Err(GeometryError::NotClosing { closure_sum, closing_mm, .. }) => {
                close(closure_sum, closure, 6e-7);
                close(closing_mm, distance, 6e-7);
            }
            other => panic!("k = {k}: {other:?}"),
        }
        // A drawing may round to the hundredth.
        let rounded_mm = (distance * 100.0).round() / 100.0;
        assert_eq!(GearPair::elliptical(&with_distance(rounded_mm)), Ok(pair));
    }
}

#[test]
fn the_error_of_a_pair_that_does_not_close_says_what_closes() {
    let of = |teeth: ToothSpec| EllipticalSpec { teeth, ..Default::default() };
    let spec = of(ToothSpec { centre_distance_mm: Some(150.0), ..Default::default() });
    let text = GearPair::elliptical(&spec).unwrap_err().to_string();
    assert!(text.contains("150") && text.contains("0.928484") && text.contains("144.999717"), "{text}");
    let spec = of(ToothSpec { centre_distance_mm: Some(90.0), ..Default::default() });
    let text = GearPair::elliptical(&spec).unwrap_err().to_string();
    assert!(text.contains("96.33") && text.contains("144.999717"), "{text}");
    let spec = CircularSpec { centre_distance_mm: Some(150.0), ..Default::default() };
    let text = GearPair::circular(&spec).unwrap_err().to_string();
    assert!(text.contains("0.886792") && text.contains("141.0"), "{text}");
    let spec = of(ToothSpec { teeth: (47, 48), ..Default::default() });
    let text = GearPair::elliptical(&spec).unwrap_err().to_string();
    assert!(text.contains("47") && text.contains("48"), "{text}");
}

#[test]
fn constant_ratio_stand_ins() {
    let pair = GearPair::constant(81.0).unwrap();
    assert_eq!(pair.theta2(81.0), 1.0);
    assert_eq!(pair.theta2_inverse(1.0), 81.0);
    assert_eq!((pair.ratio(3.0), pair.driven_radius(2.0)), (1.0 / 81.0, 1.0));
    assert_eq!((pair.pressure_angle_rad(), pair.inclination(1.0), pair.pitch_mm()), (0.0, 0.0, None));
    // A millimetre along the normal is a radian of the driven shaft.
    let at = pair.at(1.0);
    assert_eq!(common_normal::displacement_te_rad(&pair, &at, (0.0, 1.0), Direction::Ccw), 1.0);
    for ratio in [0.0, -3.0, f64::NAN, f64::INFINITY] {
        assert!(GearPair::constant(ratio).is_err());
    }
}
