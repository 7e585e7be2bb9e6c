//! What a pattern is called, and its signature.

use super::nuisance_patterns::{Pattern, Weight};
use gearmodel::effect::{Accumulates, Carrier, Parity, Shaft, Signature};

impl Pattern {
    /// In words.
    #[must_use]
    pub fn describe(&self) -> String {
        let shaft_name = |shaft: &Shaft| if *shaft == Shaft::Input { "driver" } else { "driven shaft" };
        let scaled = |odd: bool, weight: Weight| {
            let size = match weight {
                Weight::One => "at any load and speed",
                Weight::Load => "growing with the load",
                Weight::Speed => "growing with the speed",
                Weight::Time => "changing with time",
            };
            format!("{}, {size}", if odd { "opposite in the two senses" } else { "alike in both senses" })
        };
        match self {
            Self::Order { shaft, order, odd, weight, .. } => {
                format!("order {order} of the {}, {}", shaft_name(shaft), scaled(*odd, *weight))
            }
            Self::Comb { shaft, orders, odd, .. } => {
                let orders: Vec<String> = orders.iter().map(ToString::to_string).collect();
                let parity = scaled(*odd, Weight::One);
                format!("orders {} of the {}, {parity}", orders.join(", "), shaft_name(shaft))
            }
            Self::OneSense { shaft, order, sense } => {
                let sense = if *sense > 0.0 { "ccw" } else { "cw" };
                format!("order {order} of the {} when driving {sense} only", shaft_name(shaft))
            }
            Self::Smooth { sense, .. } => {
                let sense = if *sense > 0.0 { "ccw" } else { "cw" };
                format!("a smooth pattern over the driver's turn when driving {sense} only")
            }
            Self::Level { odd, weight, .. } => format!("an offset, {}", scaled(*odd, *weight)),
            Self::RunLevels { .. } => "an offset that differs from run to run".to_owned(),
            Self::Tone { frequency_hz } => format!("a tone of {frequency_hz:.4} Hz in time"),
            Self::Step { time_s, until_s, .. } if until_s.is_finite() => {
                format!("a step at {time_s:.2} s and back at {until_s:.2} s")
            }
            Self::Step { time_s, .. } => format!("a step at {time_s:.2} s"),
            Self::Settling { tau_s, .. } => format!("a level that settles anew in each run, within about {tau_s:.1} s"),
            Self::RandomWalk { .. } => "a level that wanders with time".to_owned(),
        }
    }

    /// Its signature row.
    #[must_use]
    pub fn signature(&self) -> Signature {
        let parity_of = |odd: bool| if odd { Parity::Odd } else { Parity::Even };
        let scaled = |carrier, odd, weight| {
            let steady = Signature::steady(carrier, parity_of(odd));
            match weight {
                Weight::One => steady,
                Weight::Load => steady.with_load(1.0),
                Weight::Speed => steady.with_speed(Some(1.0)),
                Weight::Time => steady.accumulating(Accumulates::PerTime),
            }
        };
        match self {
            Self::Order { shaft, odd, weight, .. } => scaled(shaft.carrier(), *odd, *weight),
            Self::Comb { shaft, odd, .. } => scaled(shaft.carrier(), *odd, Weight::One),
            Self::OneSense { shaft, .. } => Signature::steady(shaft.carrier(), Parity::OneFlank),
            Self::Smooth { .. } => Signature::steady(Carrier::Input, Parity::OneFlank),
            Self::Level { odd, weight, .. } => scaled(Carrier::None, *odd, *weight),
            Self::RunLevels { .. } | Self::Step { .. } => Signature::steady(Carrier::None, Parity::Mixed),
            Self::Tone { .. } | Self::Settling { .. } | Self::RandomWalk { .. } => {
                Signature::steady(Carrier::Time, Parity::Mixed)
            }
        }
    }
}
