//! Waves over a turn of a shaft or over time, steady or with the state of the rig: chucks and hubs, keyways and belts, tones.

use crate::plant::faults::fault::{Fault, any_phase};
use crate::plant::faults::parameters::Parameters;
use crate::plant::reading_error::{Abscissa, ReadingError, Weight};

/// A wave of 40 µrad, a size that shows; each fault says over what it runs.
const WAVE: Fault = Fault {
    name: "",
    summary: "",
    usual: |_| Parameters::of(&[("a_rad", 4e-5), ("phase_rad", 0.6)]),
    vary: any_phase,
    amounts: &[("a_rad", 1.0)],
    develops: false,
    signature: None,
    same_trace_as: None,
    apply: |_, _| {},
};

/// A wave of the fault's own size `a_rad` and phase `phase_rad`.
fn wave(parameters: &Parameters, abscissa: Abscissa, order: f64, weight: Weight) -> ReadingError {
    ReadingError::Wave {
        abscissa,
        order,
        amplitude_rad: parameters.number("a_rad"),
        phase_rad: parameters.number("phase_rad"),
        weight,
        square: false,
    }
}

/// A three-jaw chuck holds the output encoder's hub: the reading errs three times a turn.
pub const THREE_JAW_DISTORTION: Fault = Fault {
    name: "three_jaw_distortion",
    summary: "output encoder's hub squeezed by a three-jaw chuck",
    apply: |spec, parameters| {
        spec.reading_errors.push(wave(parameters, Abscissa::Output, 3.0, Weight::Constant));
    },
    ..WAVE
};

/// The hub of the output encoder is bolted in five places and gives way with the root of the load.
pub const HUB_DISTORTION: Fault = Fault {
    name: "hub_distortion",
    summary: "output hub gives way five times a turn with √T",
    apply: |spec, parameters| {
        spec.reading_errors.push(wave(parameters, Abscissa::Output, 5.0, Weight::RootLoad));
    },
    ..WAVE
};

/// A cable picks up a tone: the reading swings at a fixed frequency, whatever the shaft does.
pub const PICKUP: Fault = Fault {
    name: "pickup",
    summary: "reading picks up a tone of 13.7 Hz",
    usual: |spec| (WAVE.usual)(spec).with("f_hz", 13.7),
    vary: |spec, usual, rng| any_phase(spec, usual, rng).with("f_hz", rng.spread(2.0, 60.0)),
    develops: true,
    apply: |spec, parameters| {
        spec.reading_errors.push(wave(parameters, Abscissa::Time, parameters.number("f_hz"), Weight::Constant));
    },
    ..WAVE
};

/// The room's temperature swings and turns the encoder's mount slowly to and fro.
pub const AIR_CONDITIONING: Fault = Fault {
    name: "air_conditioning",
    summary: "encoder's mount swings once in 45 s",
    usual: |spec| (WAVE.usual)(spec).with("period_s", 45.0),
    vary: |spec, usual, rng| any_phase(spec, usual, rng).with("period_s", rng.spread(15.0, 90.0)),
    develops: true,
    apply: |spec, parameters| {
        let frequency_hz = 1.0 / parameters.number("period_s").max(1e-3);
        spec.reading_errors.push(wave(parameters, Abscissa::Time, frequency_hz, Weight::Constant));
    },
    ..WAVE
};

/// A belt in the input encoder's drive goes round less often than the shaft: an order that is no whole number.
pub const BELT_DRIVE: Fault = Fault {
    name: "belt_drive",
    summary: "belt errs at order 0.37 of the driver",
    usual: |spec| (WAVE.usual)(spec).with("order", 0.37),
    vary: |spec, usual, rng| any_phase(spec, usual, rng).with("order", rng.between(0.15, 0.85)),
    develops: true,
    apply: |spec, parameters| {
        spec.reading_errors.push(wave(parameters, Abscissa::Input, parameters.number("order"), Weight::Constant));
    },
    ..WAVE
};

/// A loose coupling spreads with the square of the speed, four times a turn of the driver.
pub const LOOSE_COUPLING: Fault = Fault {
    name: "loose_coupling",
    summary: "coupling spreads with the square of the speed",
    apply: |spec, parameters| {
        spec.reading_errors.push(wave(parameters, Abscissa::Input, 4.0, Weight::SpeedSquared));
    },
    ..WAVE
};

/// A worn keyway gives in one sense only, seven times a turn of the driver.
pub const KEYWAY: Fault = Fault {
    name: "keyway",
    summary: "keyway gives seven times a turn in one sense",
    usual: |spec| (WAVE.usual)(spec).with("sense", 1.0),
    vary: |spec, usual, rng| any_phase(spec, usual, rng).with("sense", rng.sign()),
    apply: |spec, parameters| {
        spec.reading_errors.push(wave(parameters, Abscissa::Input, 7.0, Weight::Sense(parameters.number("sense"))));
    },
    ..WAVE
};

/// A hub works loose: an error of six waves a turn grows with time.
pub const GROWING_WOBBLE: Fault = Fault {
    name: "growing_wobble",
    summary: "hub works loose, six waves a turn growing with time",
    develops: true,
    apply: |spec, parameters| {
        spec.reading_errors.push(wave(parameters, Abscissa::Output, 6.0, Weight::Age(300.0)));
    },
    ..WAVE
};

/// A converter weighs one bit wrongly: a square wave over the turn of the output encoder.
pub const BIT_WEIGHT: Fault = Fault {
    name: "bit_weight",
    summary: "a bit of the output's converter weighs wrongly",
    usual: |spec| (WAVE.usual)(spec).with("order", 32.0),
    vary: |spec, usual, rng| any_phase(spec, usual, rng).with("order", 2f64.powi(4 + rng.below(4) as i32)),
    apply: |spec, parameters| {
        spec.reading_errors.push(ReadingError::Wave {
            abscissa: Abscissa::Output,
            order: parameters.number("order"),
            amplitude_rad: parameters.number("a_rad"),
            phase_rad: parameters.number("phase_rad"),
            weight: Weight::Constant,
            square: true,
        });
    },
    ..WAVE
};
