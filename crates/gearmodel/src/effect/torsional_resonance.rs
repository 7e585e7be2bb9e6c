//! Something on the drive train is soft enough to ring. Three kinds; the shape is [kind, f, ζ, response].
//!
//! Kinds 0 and 1: an excitation once a turn (0) or at the mesh (1) of unknown amplitude â comes through amplified. With D = 1 − x² +
//! 2jζx, x = ν/f, a part of it at the frequency ν comes through with one of four responses, a fourth number of the shape:
//! 0 whole 1/D (damped against the rig), 1 what that adds to the excitation, 1/D − 1, 2 carried (1 + 2jζx)/D (damped by what it hangs
//! on), 3 what that adds, x²/D. Once a turn TE = Re[H(ν) â e^{jθ1}]. The mesh of a pair whose radius varies changes its frequency
//! faster than a resonance follows, so each of its orders comes through with its own response:
//! e^{j2πu} = Σ E_n e^{jnθ1}, TE = Re[â Σ H(nω) E_n e^{jnθ1}], ω the driver's speed with its sign.
//!
//! Kind 2: the output encoder hangs on a soft coupling, and the pair's own uneven motion excites it: ẍ + 2ζω0 ẋ + ω0² x = −q̈ for the
//! disc's lead x, with q = f(θ1) and ω0 = 2πf. At the driver's speed ω, with the orders of the ratio i = Σ Re(c_n e^{jnθ1}), the steady motion is
//! TE = x = −Re Σ jn ω² c_n e^{jnθ1}/(ω0² − (nω)² + 2jζω0 nω), far below f −ω² (di/dθ1)/ω0²: alike in both senses, at every load.
//! Nothing is free in it but f and ζ, so the amplitude found must be 1: where it is β, the coupling's f is f/√β.

use std::f64::consts::TAU;

use super::{
    Carrier, Effect, Estimate, Given, Grain, MeasurementPlan, MeshOrders, NominalRig, OperatingPoint, Parameter,
    Parity, Rows, Shape, Signature, Stated, StatedEffect, StatedError, Words,
};

/// What a shape says.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Resonance {
    excitation: Excitation,
    f_hz: f64,
    zeta: f64,
}

/// What excites it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Excitation {
    /// Something once a turn of the driver.
    Turn(Response),
    /// Something at the tooth mesh.
    Mesh(Response),
    /// The pair's own uneven motion, the output encoder on its coupling.
    Encoder,
}

/// How an excitation comes through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Response {
    /// 1/D.
    Whole,
    /// 1/D − 1.
    WholeLessExcitation,
    /// (1 + 2jζx)/D.
    Carried,
    /// x²/D.
    CarriedLessExcitation,
}

/// Responses by their number in a shape.
const RESPONSES: [Response; 4] =
    [Response::Whole, Response::WholeLessExcitation, Response::Carried, Response::CarriedLessExcitation];
/// Responses as a file states them, in the same order.
const RESPONSE_WORDS: [&str; 4] = ["whole", "whole less excitation", "carried", "carried less excitation"];
/// What excites it, as a file states it.
const EXCITED_BY: [&str; 3] = ["mesh", "turn", "encoder"];

impl Excitation {
    /// How it comes through, where it comes from outside.
    fn response(self) -> Option<Response> {
        match self {
            Self::Turn(response) | Self::Mesh(response) => Some(response),
            Self::Encoder => None,
        }
    }

    /// The same with another response; an encoder has none.
    fn with(self, response: Response) -> Self {
        match self {
            Self::Turn(_) => Self::Turn(response),
            Self::Mesh(_) => Self::Mesh(response),
            Self::Encoder => Self::Encoder,
        }
    }
}

impl Resonance {
    /// From the shape [kind, f, ζ, response], the last of kinds 0 and 1 alone.
    fn of(shape: &Shape) -> Option<Self> {
        let response = |number: f64| RESPONSES.get(number as usize).copied();
        let (excitation, f_hz, zeta) = match shape[..] {
            [0.0, f_hz, zeta, number] => (Excitation::Turn(response(number)?), f_hz, zeta),
            [1.0, f_hz, zeta, number] => (Excitation::Mesh(response(number)?), f_hz, zeta),
            [2.0, f_hz, zeta] => (Excitation::Encoder, f_hz, zeta),
            _ => return None,
        };
        Some(Self { excitation, f_hz, zeta })
    }

    /// The way back.
    fn shape(&self) -> Shape {
        let Self { excitation, f_hz, zeta } = *self;
        match excitation {
            Excitation::Turn(response) => vec![0.0, f_hz, zeta, f64::from(response as u8)],
            Excitation::Mesh(response) => vec![1.0, f_hz, zeta, f64::from(response as u8)],
            Excitation::Encoder => vec![2.0, f_hz, zeta],
        }
    }
}

impl Response {
    /// At x = ν/f of either sign, [re, im].
    fn at(self, x: f64, zeta: f64) -> [f64; 2] {
        let (re, im) = (1.0 - x * x, 2.0 * zeta * x);
        let size = re * re + im * im;
        let over = |a: f64, b: f64| [(a * re + b * im) / size, (b * re - a * im) / size];
        match self {
            Self::Whole => over(1.0, 0.0),
            Self::WholeLessExcitation => over(x * x, -im),
            Self::Carried => over(1.0, im),
            Self::CarriedLessExcitation => over(x * x, 0.0),
        }
    }
}

/// H(nω) E_n of the mesh's orders, `x` the turn's frequency over f.
fn through(orders: &MeshOrders, response: Response, x: f64, zeta: f64) -> Vec<[f64; 2]> {
    (orders.first..)
        .zip(&orders.amplitudes)
        .map(|(order, [a, b])| {
            let [h, g] = response.at(f64::from(order) * x, zeta);
            [h * a - g * b, h * b + g * a]
        })
        .collect()
}

/// Σ c_n e^{jnθ} from n = `first` on.
fn sum_of_orders(first: i32, amplitudes: &[[f64; 2]], theta_rad: f64) -> (f64, f64) {
    let (step_sin, step_cos) = theta_rad.sin_cos();
    // Horner's rule in e^{jLθ}, for every L-th order on its own: the sums do not wait for one another.
    let (mut sin, mut cos) = (step_sin, step_cos);
    for _ in 0..LANES.ilog2() {
        (sin, cos) = (2.0 * sin * cos, cos * cos - sin * sin);
    }
    let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
    for group in amplitudes.chunks(LANES).rev() {
        let mut next = [[0.0; 2]; LANES];
        next[..group.len()].copy_from_slice(group);
        for lane in 0..LANES {
            let [a, b] = next[lane];
            (re[lane], im[lane]) = (re[lane] * cos - im[lane] * sin + a, re[lane] * sin + im[lane] * cos + b);
        }
    }
    let (mut sum_re, mut sum_im) = (0.0, 0.0);
    let (mut sin, mut cos) = (f64::from(first) * theta_rad).sin_cos();
    for (re, im) in re.into_iter().zip(im) {
        sum_re += re * cos - im * sin;
        sum_im += re * sin + im * cos;
        (cos, sin) = (cos * step_cos - sin * step_sin, sin * step_cos + cos * step_sin);
    }
    (sum_re, sum_im)
}

/// Orders summed side by side, a power of 2.
const LANES: usize = 8;
/// First resonances of the encoder tried, in turns of the driver; the amplitude found moves them to where it is 1.
const ENCODER_ORDERS: [f64; 3] = [6.0, 15.0, 100.0];
/// Damping ratio of the encoder's coupling tried first: far below the resonance it does not show.
const ENCODER_ZETA: f64 = 0.05;
/// Lowest and highest resonance tried, in parts of the excitation's highest frequency, and ratios of neighbours.
const FREQUENCIES: [f64; 2] = [0.4, 3.3];
const TURN_RATIO: f64 = 1.35;
const MESH_RATIO: f64 = 1.07;
/// Damping ratio tried first where the mesh rings it.
const MESH_ZETA: f64 = 0.05;
/// How far the amplitude of an encoder may be from 1, as a factor of f.
const CONSISTENT: f64 = 0.01;

/// Torsional resonance of the drive train.
pub(super) struct TorsionalResonance;

impl Effect for TorsionalResonance {
    fn name(&self) -> &'static str {
        "torsional_resonance"
    }

    fn component(&self) -> &'static str {
        "drive train"
    }

    fn words(&self) -> Words {
        Words::new("torsional resonance", "keep away from the speed that excites it, or stiffen the train")
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Input, Parity::Even).with_speed(Some(2.0))
    }

    fn signature_of(&self, _rig: &NominalRig, shape: &Shape) -> Signature {
        match Resonance::of(shape).map(|resonance| resonance.excitation) {
            // Phase and gain of what is excited from outside turn with the sense.
            Some(Excitation::Turn(_)) => Signature { parity: Parity::Mixed, ..self.signature() },
            Some(Excitation::Mesh(_)) => {
                Signature { carrier: Carrier::Mesh, parity: Parity::Mixed, ..self.signature() }
            }
            Some(Excitation::Encoder) | None => self.signature(),
        }
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    fn shapes(&self, rig: &NominalRig, plan: &MeasurementPlan) -> Vec<Shape> {
        let (Some(low), Some(high)) = (plan.speeds_rad_per_s.first(), plan.speeds_rad_per_s.last()) else {
            return Vec::new();
        };
        // At one speed nothing tells a resonance from its excitation.
        if *high < 1.2 * low {
            return Vec::new();
        }
        let mut tried: Vec<Resonance> = Vec::new();
        let turn_hz = high / TAU;
        for f_hz in frequencies(turn_hz, TURN_RATIO) {
            let excitation = Excitation::Turn(Response::Whole);
            tried.extend([0.02, 0.1].map(|zeta| Resonance { excitation, f_hz, zeta }));
        }
        // Where the mesh frequency sweeps over it, a resonance rings on in its own phase: the grid must be as fine as it is narrow.
        let teeth = f64::from(rig.pair().teeth().0);
        if teeth > 0.0 {
            let excitation = Excitation::Mesh(Response::Whole);
            let of = |f_hz| Resonance { excitation, f_hz, zeta: MESH_ZETA };
            tried.extend(frequencies(teeth * turn_hz, MESH_RATIO).map(of));
        }
        if !rig.ratio_orders().is_empty() {
            let of = |f_hz| Resonance { excitation: Excitation::Encoder, f_hz, zeta: ENCODER_ZETA };
            tried.extend(ENCODER_ORDERS.map(|order| of(order * high / TAU)));
        }
        tried.iter().map(Resonance::shape).collect()
    }

    fn neighbours(&self, shape: &Shape, step: f64) -> Vec<Shape> {
        let Some(own) = Resonance::of(shape) else { return Vec::new() };
        let mut near: Vec<Resonance> = Vec::new();
        for higher in [-0.16, -0.08, 0.0, 0.08, 0.16] {
            for softer in [-0.8, 0.0, 0.8] {
                if higher != 0.0 || softer != 0.0 {
                    let zeta = (own.zeta * f64::exp(softer * step.sqrt())).clamp(0.005, 0.5);
                    near.push(Resonance { f_hz: own.f_hz * f64::exp(higher * step), zeta, ..own });
                }
            }
        }
        if let Some(known) = own.excitation.response() {
            let others = RESPONSES.into_iter().filter(|response| *response != known);
            near.extend(others.map(|response| Resonance { excitation: own.excitation.with(response), ..own }));
        }
        near.iter().map(Resonance::shape).collect()
    }

    /// An encoder at the f whose amplitude is 1.
    fn refine(&self, _rig: &NominalRig, shape: &Shape, beta: &[f64]) -> Option<Shape> {
        let own = Resonance::of(shape).filter(|own| own.excitation == Excitation::Encoder)?;
        let [amplitude] = beta else { return None };
        let factor = 1.0 / amplitude.sqrt();
        // A negative amplitude has no f, an immense one means that there is nothing.
        (factor.is_finite() && (factor - 1.0).abs() > CONSISTENT)
            .then(|| Resonance { f_hz: own.f_hz * factor, ..own }.shape())
    }

    fn width(&self, _rig: &NominalRig, shape: &Shape) -> usize {
        match Resonance::of(shape).map(|resonance| resonance.excitation) {
            Some(Excitation::Encoder) => 1,
            _ => 2,
        }
    }

    /// Of an encoder, whose amplitude is (f/f_true)²; the others have two amplitudes, of either sign.
    fn one_sided(&self) -> bool {
        true
    }

    fn rings_hz(&self, shape: &Shape, found: &Estimate) -> Option<f64> {
        let Resonance { excitation, f_hz, .. } = Resonance::of(shape)?;
        Some(match excitation {
            // β = (f_shape/f)².
            Excitation::Encoder => f_hz / found.beta[0].max(f64::MIN_POSITIVE).sqrt(),
            Excitation::Turn(_) | Excitation::Mesh(_) => f_hz,
        })
    }

    fn grain(&self, shape: &Shape) -> Grain {
        // Orders of the turn are smooth, those of the mesh are not.
        match Resonance::of(shape).map(|resonance| resonance.excitation) {
            Some(Excitation::Mesh(_)) => Grain::Fine,
            _ => Grain::Smooth,
        }
    }

    fn row(&self, rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        self.rows(rig, shape)(at, row);
    }

    fn rows<'a>(&'a self, rig: &'a NominalRig, shape: &'a Shape) -> Rows<'a> {
        let Some(Resonance { excitation, f_hz, zeta }) = Resonance::of(shape) else { return Box::new(|_, _| ()) };
        let orders = rig.mesh_orders();
        // Amplitudes of the orders change with the speed only, which a run keeps.
        let mut last: Option<(f64, Vec<[f64; 2]>)> = None;
        let mut sum = move |first: i32, at: &OperatingPoint, amplitudes: &dyn Fn(f64) -> Vec<[f64; 2]>| {
            let hz = at.speed_rad_per_s / TAU;
            if last.as_ref().is_none_or(|(of, _)| *of != hz) {
                last = None;
            }
            let (_, known) = last.get_or_insert_with(|| (hz, amplitudes(hz)));
            sum_of_orders(first, known, at.theta1_rad)
        };
        match excitation {
            Excitation::Encoder => {
                Box::new(move |at, row| row[0] = sum(1, at, &|hz| encoder_lead(rig, f_hz, zeta, hz)).0)
            }
            Excitation::Mesh(response) => Box::new(move |at, row| {
                let (re, im) = sum(orders.first, at, &|hz| through(orders, response, hz / f_hz, zeta));
                // The cw flank stands half a pitch on.
                (row[0], row[1]) = (at.sense * im, at.sense * re);
            }),
            Excitation::Turn(response) => Box::new(move |at, row| {
                let (re, im) = sum(1, at, &|hz| vec![response.at(hz / f_hz, zeta)]);
                (row[0], row[1]) = (im, re);
            }),
        }
    }

    fn parameters(&self, _rig: &NominalRig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        let Some(Resonance { excitation, f_hz, zeta }) = Resonance::of(shape) else { return Vec::new() };
        if excitation == Excitation::Encoder {
            // β = (f_shape/f)², so f = f_shape/√β and df = f dβ/(2β).
            let amplitude = found.beta[0].max(f64::MIN_POSITIVE);
            let f_hz = f_hz / amplitude.sqrt();
            let std_hz = 0.5 * f_hz * found.std(0) / amplitude;
            return vec![Parameter::number("f_hz", f_hz, std_hz, "Hz"), Parameter::grid("zeta", zeta, "")];
        }
        let mut parameters = vec![Parameter::grid("f_hz", f_hz, "Hz"), Parameter::grid("zeta", zeta, "")];
        parameters.extend(found.polar(0).parameters("excitation_rad", "rad"));
        parameters
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["f_hz", "zeta", "excitation_rad", "phase_rad", "excited_by", "response"]
    }

    fn amplitudes(&self, _rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let excited_by = EXCITED_BY[given.word("excited_by", &EXCITED_BY, true)?];
        let (f_hz, zeta) = (given.number_in("f_hz", 1e-6, 1e9)?, given.number_in("zeta", 1e-6, 10.0)?);
        let of = |excitation| Resonance { excitation, f_hz, zeta }.shape();
        if excited_by == "encoder" {
            // Its own swing has no amplitude but what the ratio gives it.
            return Ok((of(Excitation::Encoder), vec![1.0]));
        }
        let response = RESPONSES[given.word("response", &RESPONSE_WORDS, true)?];
        let excitation = if excited_by == "turn" { Excitation::Turn(response) } else { Excitation::Mesh(response) };
        Ok((of(excitation), given.polar("excitation_rad")?))
    }

    fn stated(&self, rig: &NominalRig, shape: &Shape, beta: &[f64]) -> StatedEffect {
        let mut stated = self.reported(rig, shape, beta);
        let Some(Resonance { excitation, .. }) = Resonance::of(shape) else { return stated };
        let by = match excitation {
            Excitation::Turn(_) => "turn",
            Excitation::Mesh(_) => "mesh",
            Excitation::Encoder => "encoder",
        };
        stated.insert("excited_by".to_owned(), Stated::Text(by.to_owned()));
        if let Some(response) = excitation.response() {
            stated.insert("response".to_owned(), Stated::Text(RESPONSE_WORDS[response as usize].to_owned()));
        }
        stated
    }
}

/// Resonances tried about the excitation's highest frequency.
fn frequencies(highest_hz: f64, ratio: f64) -> impl Iterator<Item = f64> {
    let count = ((FREQUENCIES[1] / FREQUENCIES[0]).ln() / ratio.ln()).ceil() as i32;
    (0..=count).map(move |n| FREQUENCIES[0] * highest_hz * ratio.powi(n))
}

/// Amplitudes of e^{jnθ1} in the lead of the encoder's disc, rad, at a speed in turns a second.
fn encoder_lead(rig: &NominalRig, f_hz: f64, zeta: f64, hz: f64) -> Vec<[f64; 2]> {
    let (omega0, omega) = (TAU * f_hz, TAU * hz);
    (1_u32..)
        .zip(rig.ratio_orders())
        .map(|(n, [a, b])| {
            let order_omega = f64::from(n) * omega;
            // −q̈_n = −Re nω² (b + ja) e^{jnθ1}, over D = ω0² − (nω)² + 2jζω0 nω.
            let (re, im) = (omega0 * omega0 - order_omega * order_omega, 2.0 * zeta * omega0 * order_omega);
            let factor = -omega * order_omega / (re * re + im * im);
            [factor * (b * re + a * im), factor * (a * re - b * im)]
        })
        .collect()
}
