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

/// What becomes of an excitation by its equation of motion, for each response of the shape: ÿ + 2ζω0 ẏ + ω0² y = ω0² e, or with the
/// damping to what moves, + 2ζω0 ė.
fn responses(f_hz: f64, zeta: f64, time_s: f64, excitation: impl Fn(f64) -> f64) -> [f64; 4] {
    let omega0 = TAU * f_hz;
    let slope = |t: f64| (excitation(t + 1e-6) - excitation(t - 1e-6)) / 2e-6;
    let whole = ring(f_hz, zeta, time_s, |t| omega0 * omega0 * excitation(t));
    let carried = ring(f_hz, zeta, time_s, |t| omega0 * omega0 * excitation(t) + 2.0 * zeta * omega0 * slope(t));
    let now = excitation(time_s);
    [whole, whole - now, carried, carried - now]
}

#[test]
fn an_excitation_rings_as_its_equation_of_motion_does() {
    let rig = rig(&elliptic(0.3287));
    let (omega, zeta) = (RPM * TAU / 60.0, 0.1);
    for direction in Direction::BOTH {
        let theta = |t: f64| direction.sign() * omega * t;
        for part in [0.4, 1.0, 2.5] {
            let f_hz = RPM / 60.0 / part;
            // Away by many time constants, at an angle of no symmetry.
            let time_s = 30.3 / (zeta * f_hz);
            let at = operating_point(&rig, theta(time_s), direction);
            for (number, full) in responses(f_hz, zeta, time_s, |t| theta(t).sin()).into_iter().enumerate() {
                let trace = row(&rig, "torsional_resonance", &[0.0, f_hz, zeta, number as f64], &at)[0];
                assert!((trace - full).abs() < 1e-4, "{direction} {part} {number}: {trace} {full}");
            }
        }
    }
    let size = |part: f64, zeta: f64, number: f64| {
        let at = operating_point(&rig, 0.3, Direction::Ccw);
        let row = row(&rig, "torsional_resonance", &[0.0, RPM / 60.0 / part, zeta, number], &at);
        row[0].hypot(row[1])
    };
    for added in [1.0, 3.0] {
        assert!(size(1e-4, 0.05, added) < 2e-5, "nothing far below");
        assert!((size(1e4, 0.05, added) - 1.0).abs() < 1e-3, "far above the excitation does not come through");
    }
    for number in [0.0, 1.0, 2.0, 3.0] {
        let of = |n: &i32| size(0.01 * f64::from(*n), 0.05, number);
        let peak = (1..400).max_by(|a, b| of(a).total_cmp(&of(b))).unwrap();
        assert!((peak - 100).abs() <= 2, "{number}: {peak}");
    }
}

#[test]
fn the_mesh_of_an_elliptic_pair_rings_as_its_equation_of_motion_does() {
    // Its frequency sweeps over the resonance faster than that follows.
    let pair = elliptic(0.3287);
    let rig = rig(&pair);
    let teeth = f64::from(pair.teeth().0);
    let (omega, zeta) = (RPM * TAU / 60.0, 0.05);
    for direction in Direction::BOTH {
        let theta = |t: f64| direction.sign() * omega * t;
        let mesh = |t: f64| (TAU * operating_point(&rig, theta(t), direction).pitches).sin();
        for part in [0.8, 1.1] {
            let f_hz = teeth * RPM / 60.0 / part;
            for time_s in [20.0, 20.9, 22.3] {
                let at = operating_point(&rig, theta(time_s), direction);
                for (number, full) in responses(f_hz, zeta, time_s, mesh).into_iter().enumerate() {
                    let trace = row(&rig, "torsional_resonance", &[1.0, f_hz, zeta, number as f64], &at)[0];
                    assert!((trace - full).abs() < 5e-3, "{direction} {part} {number}: {trace} {full}");
                }
            }
        }
    }
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
                let at = operating_point(&rig, theta(time_s), direction);
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
