//! Errors of single teeth and of their flanks, against exact contact.

use gearmodel::contact::{Profile, ToothDamage, ToothErrors};

use super::*;

fn table(value: &Value) -> Vec<f64> {
    match value {
        Value::Table(values) => values.clone(),
        other => panic!("{other:?} is no table"),
    }
}

#[test]
fn the_most_advanced_tooth_carries_as_in_exact_contact() {
    for pair in [elliptic(0.3287), circular((23, 47))] {
        let (rig, effect) = (rig(&pair), by_name("pitch_errors").unwrap());
        let teeth = pair.teeth().0 as usize;
        // Waves of alternating sizes, both flanks unlike.
        let beta: Vec<f64> = (0..effect.width(&rig, &Vec::new())).map(|n| 1e-3 * (1.7 * n as f64).sin()).collect();
        let found = effect.parameters(&rig, &Vec::new(), &estimate(beta.clone()));
        let tables = [table(&found[0].value), table(&found[1].value)];
        for errors in &tables {
            assert_eq!(errors.len(), teeth);
            assert!(errors.iter().sum::<f64>().abs() < 1e-12, "a mean is a backlash");
            assert!(rms(errors) > 3e-4);
        }
        let mut shape = tables.concat();
        shape.push(0.0);
        assert_eq!(effect.refine(&rig, &Vec::new(), &beta).unwrap(), shape);
        let exact = ContactModel::new(pair.clone(), &Errors::default()).unwrap();
        let teeth = ToothErrors { driver_pitch_mm: tables, ..ToothErrors::default() };
        let exact = exact.with_tooth_errors(teeth).unwrap();
        let (mut off, mut count) = (0, 0);
        let mut sizes = Vec::new();
        for (theta, direction) in places(900) {
            let at = operating_point(&rig, theta, direction);
            let trace: f64 = row(&rig, "pitch_errors", &shape, &at).iter().zip(&beta).map(|(x, b)| x * b).sum();
            let te = exact.te_rad(theta, direction).unwrap();
            sizes.push(te);
            off += usize::from((trace - te).abs() > 1e-7);
            count += 1;
        }
        assert!(rms(&sizes) > 3e-6);
        // Near a hand-over the exact tips stand a little elsewhere.
        assert!(off * 100 < 2 * count, "{}: {off} of {count} angles", pair.kind());
    }
}

#[test]
fn longer_tips_keep_two_pairs_in_contact_for_longer_up_to_a_racks() {
    for pair in [elliptic(0.3287), circular((23, 47))] {
        let rig = rig(&pair);
        let mean_pairs = |reach: f64| {
            let at: Vec<OperatingPoint> = places(900).map(|(theta, way)| operating_point(&rig, theta, way)).collect();
            at.iter().map(|at| rig.teeth_in_contact(at, reach).count()).sum::<usize>() as f64 / at.len() as f64
        };
        let ratios = [-0.5, 0.0, 0.5, 1.0].map(mean_pairs);
        assert!(ratios.windows(2).all(|pair| pair[0] < pair[1]), "{ratios:?}");
        // ε = 2 h_a/(π cos α sin α) of two racks: no gears have more.
        let (sin, cos) = pair.pressure_angle_rad().sin_cos();
        let of_racks = 2.0 * pair.addendum() / (std::f64::consts::PI * sin * cos);
        assert!((ratios[3] - of_racks).abs() < 0.02, "{} {of_racks}", ratios[3]);
    }
}

#[test]
fn a_profile_is_that_of_exact_contact_on_either_flank() {
    let (amplitude_mm, phi) = (2e-5, 0.7_f64);
    for pair in [elliptic(0.3287), circular((23, 47))] {
        let rig = rig(&pair);
        for order in 1..=3_u32 {
            let waves = |ccw: f64, cw: f64| {
                let of = |shift: f64| {
                    let mut waves = vec![(0.0, 0.0); order as usize];
                    waves[order as usize - 1] = (amplitude_mm, shift);
                    Profile { waves, ..Profile::default() }
                };
                let teeth = ToothErrors { profile: [of(ccw), of(cw)], ..ToothErrors::default() };
                ContactModel::new(pair.clone(), &Errors::default()).unwrap().with_tooth_errors(teeth).unwrap()
            };
            // a sin(x − φ) = a cos(x − φ − π/2); the cw flank's own tooth 0 passes half a pitch later.
            let quarter = 0.25 * TAU;
            let half = 0.5 * TAU * f64::from(order);
            let alike = waves(phi + quarter, phi + quarter - half);
            let own = waves(phi + quarter, phi + quarter);
            let first = 2 * (order as usize - 1);
            let trace = |shape: f64, at: &OperatingPoint| {
                let row = row(&rig, "profile_error", &[shape], at);
                amplitude_mm * (phi.cos() * row[first] - phi.sin() * row[first + 1])
            };
            for (shape, exact) in [(0.0, &alike), (2.0, &own)] {
                let what = format!("profile_error order {order} shape {shape}");
                compare(&rig, &what, 0.01, |at| trace(shape, at), |theta, dir| exact.te_rad(theta, dir).unwrap());
            }
            // With a deviation a flank the cw flank has columns of its own.
            let at = operating_point(&rig, 0.4, Direction::Cw);
            let (wide, narrow) = (row(&rig, "profile_error", &[1.0], &at), row(&rig, "profile_error", &[0.0], &at));
            assert_eq!((&wide[..6], &wide[6..]), (&[0.0; 6][..], &narrow[..]));
        }
    }
    let rig = rig(&elliptic(0.3287));
    let beta = [phi.cos(), -phi.sin(), 0.0, 0.0, 0.0, 0.0].map(|x| amplitude_mm * x).to_vec();
    let found = by_name("profile_error").unwrap().parameters(&rig, &vec![0.0], &estimate(beta));
    let number = |n: usize| match found[n].value {
        Value::Number(value) => value,
        _ => f64::NAN,
    };
    assert_eq!((found[0].name, found[1].name), ("a1_mm", "ph1_rad"));
    assert!((number(0) - amplitude_mm).abs() < 1e-15 && (number(1) - phi).abs() < 1e-12);
}

#[test]
fn a_damaged_tooth_lags_while_it_alone_carries_as_in_exact_contact() {
    let (depth_mm, width) = (5e-4, 0.3);
    // Low teeth: one pair alone over 0.8 of a pitch, so that nothing hides the damage.
    let ellipse = GearPair::elliptical(&EllipticalSpec {
        teeth: ToothSpec { addendum: 0.6, ..Default::default() },
        ..Default::default()
    })
    .unwrap();
    let circles = GearPair::circular(&CircularSpec { teeth: (23, 47), addendum: 0.6, ..Default::default() }).unwrap();
    for pair in [ellipse, circles] {
        let rig = rig(&pair);
        for (tooth, flank) in [(0, Direction::Ccw), (0, Direction::Cw), (17, Direction::Cw), (22, Direction::Ccw)] {
            let damage = vec![ToothDamage { tooth, flank, depth_mm, width }];
            let exact = ContactModel::new(pair.clone(), &Errors::default()).unwrap();
            let exact = exact.with_tooth_errors(ToothErrors { damage, ..ToothErrors::default() }).unwrap();
            let shape = [f64::from(tooth), flank.sign(), width];
            let (mut traces, mut exacts) = (Vec::new(), Vec::new());
            for (theta, direction) in places(1500) {
                let trace = depth_mm * row(&rig, "tooth_damage", &shape, &operating_point(&rig, theta, direction))[0];
                assert!(direction == flank || trace == 0.0);
                assert!(trace * direction.sign() <= 0.0, "material is missing: the driven gear lags");
                traces.push(trace);
                exacts.push(exact.te_rad(theta, direction).unwrap());
            }
            let rest = left(&traces, &exacts);
            assert!(rest < 0.01, "tooth {tooth} {flank} {}: {rest:.2e}", pair.kind());
            // The sector holds all of it, in the range of a turn about it.
            let [from, to] = by_name("tooth_damage").unwrap().signature_of(&rig, &shape.to_vec()).sector_deg.unwrap();
            let middle =
                row(&rig, "tooth_damage", &shape, &operating_point(&rig, (0.5 * (from + to)).to_radians(), flank))[0];
            let beyond = row(&rig, "tooth_damage", &shape, &operating_point(&rig, (to + 0.01).to_radians(), flank))[0];
            assert!(middle != 0.0 && beyond == 0.0 && from < to);
        }
    }
}
