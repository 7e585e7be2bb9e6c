//! What rings, against its equation of motion.

use super::*;

/// ẍ + 2ζω0 ẋ + ω0² x = force(t) from rest by Runge and Kutta, after `time_s`.
fn ring(f_hz: f64, zeta: f64, time_s: f64, force: impl Fn(f64) -> f64) -> f64 {
    let omega0 = TAU * f_hz;
    let steps = (time_s * f_hz * 200.0) as usize;
    let h = time_s / steps as f64;
    let rate = |t: f64, [x, v]: [f64; 2]| [v, force(t) - 2.0 * zeta * omega0 * v - omega0 * omega0 * x];
    let mut y = [0.0; 2];
    for n in 0..steps {
        let t = n as f64 * h;
        let step = |k: [f64; 2], part: f64| [y[0] + part * h * k[0], y[1] + part * h * k[1]];
        let k1 = rate(t, y);
        let k2 = rate(t + 0.5 * h, step(k1, 0.5));
        let k3 = rate(t + 0.5 * h, step(k2, 0.5));
        let k4 = rate(t + h, step(k3, 1.0));
        y = [0, 1].map(|n| y[n] + h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n]));
    }
    y[0]
}

#[test]
fn an_excitation_rings_as_its_equation_of_motion_does() {
    let rig = rig(&elliptic(0.3287));
    let (omega, zeta) = (RPM * TAU / 60.0, 0.1);
    for direction in Direction::BOTH {
        for part in [0.4, 1.0, 2.5] {
            let f_hz = RPM / 60.0 / part;
            // Away by many time constants, at an angle of no symmetry.
            let time_s = 30.3 / (zeta * f_hz);
            let theta = |t: f64| direction.sign() * omega * t;
            // ÿ + 2ζω0 ẏ + ω0² y = ω0² sin θ1: what the train makes of sin θ1, beyond sin θ1 itself.
            let omega0 = TAU * f_hz;
            let full = ring(f_hz, zeta, time_s, |t| omega0 * omega0 * theta(t).sin());
            let at = station(&rig, theta(time_s), direction);
            let trace = row(&rig, "torsional_resonance", &[0.0, f_hz, zeta], &at)[0];
            assert!((trace - (full - theta(time_s).sin())).abs() < 1e-4, "{direction} {part}: {trace} {full}");
        }
    }
    let size = |part: f64, zeta: f64| {
        let row =
            row(&rig, "torsional_resonance", &[0.0, RPM / 60.0 / part, zeta], &station(&rig, 0.3, Direction::Ccw));
        row[0].hypot(row[1])
    };
    assert!(size(1e-4, 0.05) < 2e-5, "nothing far below");
    assert!((size(1e4, 0.05) - 1.0).abs() < 1e-3, "far above the excitation does not come through");
    let peak = (1..400).map(|n| 0.01 * f64::from(n)).max_by(|a, b| size(*a, 0.05).total_cmp(&size(*b, 0.05))).unwrap();
    assert!((peak - 1.0).abs() < 0.02, "{peak}");
}

#[test]
fn an_encoder_on_its_coupling_swings_as_its_equation_of_motion_does() {
    for pair in toothed().into_iter().filter(|pair| pair.kind() != "circular") {
        let rig = rig(&pair);
        let omega = RPM * TAU / 60.0;
        for direction in Direction::BOTH {
            let slope = |theta: f64| (pair.ratio(theta + 1e-5) - pair.ratio(theta - 1e-5)) / 2e-5;
            // Near the fourth order of the driver, and well damped.
            let (f_hz, zeta) = (4.3 * RPM / 60.0, 0.1);
            for time_s in [300.0, 303.1, 307.7] {
                let theta = |t: f64| direction.sign() * omega * t;
                let lead = ring(f_hz, zeta, time_s, |t| -omega * omega * slope(theta(t)));
                let at = station(&rig, theta(time_s), direction);
                let trace = row(&rig, "torsional_resonance", &[2.0, f_hz, zeta], &at)[0];
                assert!((trace - lead).abs() < 2e-4, "{} {direction}: {trace} {lead}", pair.kind());
            }
            // Far below it lags where the driven shaft speeds up, by the acceleration over ω0².
            let f_hz = 12.0;
            compare(
                &rig,
                "torsional_resonance",
                2e-3,
                |at| row(&rig, "torsional_resonance", &[2.0, f_hz, 0.05], at)[0],
                |theta, _| -(omega / (TAU * f_hz)).powi(2) * slope(theta),
            );
        }
        // From a first guess the amplitude leads to the coupling's own frequency.
        let effect = by_name("torsional_resonance").unwrap();
        let guess = vec![2.0, 16.0, 0.05];
        let of = |shape: &[f64]| {
            turn(&rig).iter().map(|at| row(&rig, "torsional_resonance", shape, at)[0]).collect::<Vec<_>>()
        };
        let (seen, guessed) = (of(&[2.0, 7.0, 0.1]), of(&guess));
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let beta = dot(&seen, &guessed) / dot(&guessed, &guessed);
        let next = effect.refine(&rig, &guess, &[beta]).unwrap();
        assert!((next[1] - 7.0).abs() < 0.02, "{next:?}");
        assert_eq!(effect.refine(&rig, &next, &[1.0]), None);
        assert_eq!(effect.refine(&rig, &next, &[-0.5]), None);
        let found = effect.parameters(&rig, &guess, &estimate(vec![beta]));
        assert!(matches!(found[0].value, Value::Number(f) if (f - 7.0).abs() < 0.02), "{found:?}");
    }
    // A constant ratio excites nothing.
    let round = rig(&circular((23, 47)));
    assert!(round.ratio_orders().is_empty());
    assert!(by_name("torsional_resonance").unwrap().shapes(&round, &plan()).iter().all(|shape| shape[0] != 2.0));
}
