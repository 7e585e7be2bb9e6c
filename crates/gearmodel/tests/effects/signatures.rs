//! Angles between effects, parity and exponents.

use gearmodel::effect::{Accumulates, Parity};

use super::*;

/// Principal angles between two effects' columns with a free zero, deg, ascending.
fn principal_deg(rig: &NominalRig, a: (&str, &[f64]), b: (&str, &[f64])) -> Vec<f64> {
    let basis = |(name, shape): (&str, &[f64])| {
        let rows: Vec<Vec<f64>> = turn(rig).iter().map(|at| row(rig, name, shape, at)).collect();
        let mut columns = DMatrix::from_fn(rows.len(), rows[0].len(), |n, m| rows[n][m]);
        for mut column in columns.column_iter_mut() {
            let mean = column.mean();
            column.add_scalar_mut(-mean);
        }
        columns.qr().q()
    };
    let mut cosines: Vec<f64> = basis(a).tr_mul(&basis(b)).singular_values().iter().copied().collect();
    cosines.sort_by(|x, y| y.total_cmp(x));
    cosines.iter().map(|c| c.min(1.0).acos().to_degrees()).collect()
}

#[test]
fn what_elliptic_gears_cannot_tell_apart_and_what_they_can() {
    let [e1, e2] = ["encoder1_eccentricity", "encoder2_eccentricity"].map(|name| (name, &[] as &[f64]));
    for k in [0.1, 0.3287, 0.6] {
        let rig = rig(&elliptic(k));
        assert!(principal_deg(&rig, e1, e2).iter().all(|deg| *deg < 0.2), "k = {k}");
        assert!(principal_deg(&rig, ("phasing_error", &[]), e2)[0] < 0.2);
        assert!(principal_deg(&rig, ("pitch_curve_error", &[0.0]), e1)[0] < 0.2);
    }
    let near = |found: &[f64], expected: &[f64]| {
        assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 0.3), "{found:?} {expected:?}");
    };
    let document = rig(&elliptic(0.3287));
    near(&principal_deg(&document, ("gear1_eccentricity", &[]), e2), &[20.0, 21.1]);
    near(&principal_deg(&document, ("gear2_eccentricity", &[]), e1), &[20.3, 20.9]);
    near(&principal_deg(&document, ("centre_distance_error", &[]), ("bearing_clearance", &[])), &[30.2]);
    near(&principal_deg(&document, ("shaft_compliance_input", &[]), ("mesh_compliance", &[])), &[20.8]);
    near(&principal_deg(&document, ("shaft_compliance_output", &[]), ("mesh_compliance", &[])), &[27.5]);
    assert!(principal_deg(&document, ("encoder2_ellipticity", &[]), e2)[0] > 45.0);
    for pair in toothed() {
        let rig = rig(&pair);
        let same = |a: &str, b: &str| principal_deg(&rig, (a, &[]), (b, &[]))[0] < 1e-4;
        assert!(same("bearing_clearance", "backlash_error") && same("bearing_compliance", "mesh_compliance"));
        assert!(principal_deg(&rig, ("coupling_misalignment_output", &[]), ("encoder2_ellipticity", &[]))[1] < 1e-4);
    }
    // Two lobes carry order 2 over, not order 1: the document's theorem is not every pair's.
    let lobes = rig_of_lobes();
    assert!(principal_deg(&lobes, e1, e2)[1] > 3.0);
}

fn rig_of_lobes() -> NominalRig {
    rig(&free((44, 44), &CurveSpec::Lobed { eccentricity: 0.2, lobes: (2, 2) }))
}

/// One shape of every effect that does not evolve, with amplitudes.
fn sampled(rig: &NominalRig) -> Vec<(&'static str, Vec<f64>, Vec<f64>)> {
    let mut cases = Vec::new();
    for effect in LIBRARY.iter().filter(|e| e.applies(rig)) {
        let mut shapes = effect.shapes(rig, &plan());
        match effect.name() {
            "pitch_curve_error" => shapes.retain(|s| s[..] == [0.0]),
            "encoder1_interpolation" | "encoder2_interpolation" => shapes = vec![vec![1.0, 30.0]],
            "torsional_resonance" => {
                shapes = vec![vec![1.0, 120.0, 1e-4, 1.0], vec![0.0, 5.0, 1e-4, 3.0], vec![2.0, 50.0, 0.05]];
            }
            _ if effect.signature().accumulates == Accumulates::PerRevolution => shapes.clear(),
            _ => {}
        }
        for shape in shapes {
            let beta = (0..effect.width(rig, &shape)).map(|n| (1.0 + 2.3 * n as f64).cos()).collect();
            cases.push((effect.name(), shape, beta));
        }
    }
    cases
}

#[test]
fn parity_and_exponents_are_those_of_the_signature() {
    for pair in [circular((47, 47)), elliptic(0.3287)] {
        let rig = rig(&pair);
        let round = pair.kind() == "circular";
        for (name, shape, beta) in sampled(&rig) {
            let what = format!("{name} {:?} on {}", &shape[..shape.len().min(3)], pair.kind());
            let trace = |at: &OperatingPoint| -> f64 {
                row(&rig, name, &shape, at).iter().zip(&beta).map(|(x, b)| x * b).sum()
            };
            let points_of_operation = turn(&rig);
            let (mut even, mut odd) = (0.0, 0.0);
            for pair in points_of_operation.chunks(2) {
                let (ccw, cw) = (trace(&pair[0]), trace(&pair[1]));
                even += (ccw + cw) * (ccw + cw);
                odd += (ccw - cw) * (ccw - cw);
            }
            if even + odd == 0.0 {
                // No ratio to be uneven with.
                assert!(round && (name == "torsional_resonance"), "{what} is nothing");
                continue;
            }
            let share = odd / (even + odd);
            let signature = by_name(name).unwrap().signature_of(&rig, &shape);
            // On a circular pair both flanks have one arm and parity is exact; elsewhere the arms differ.
            let slack = if round { 1e-9 } else { 0.12 };
            match signature.parity {
                Parity::Even => assert!(share < slack, "{what}: odd part {share}"),
                Parity::Odd => assert!(share > 1.0 - slack, "{what}: odd part {share}"),
                // With next to no damping an excitation comes through in one phase: damping is what mixes its senses.
                Parity::Mixed if name == "torsional_resonance" => {}
                Parity::Mixed => assert!(share > 1e-3 && share < 1.0 - 1e-3, "{what}: odd part {share}"),
                Parity::OneFlank => {
                    let sizes = [0, 1]
                        .map(|n| points_of_operation.iter().skip(n).step_by(2).map(|at| trace(at).abs()).sum::<f64>());
                    assert!((sizes[0] == 0.0) != (sizes[1] == 0.0), "{what}: {sizes:?}");
                }
            }
            let size = |change: &dyn Fn(&mut OperatingPoint)| {
                let values: Vec<f64> = points_of_operation
                    .iter()
                    .map(|at| {
                        let mut at = *at;
                        change(&mut at);
                        trace(&at)
                    })
                    .collect();
                rms(&values)
            };
            let base = size(&|_| {});
            let load = (size(&|at| at.load_nm *= 2.0) / base).log2();
            let speed = (size(&|at| at.speed_rad_per_s *= 2.0) / base).log2();
            assert!((load - signature.load_exponent.unwrap()).abs() < 1e-9, "{what}: load^{load}");
            assert!((speed - signature.speed_exponent.unwrap()).abs() < 0.05, "{what}: speed^{speed}");
        }
    }
}
