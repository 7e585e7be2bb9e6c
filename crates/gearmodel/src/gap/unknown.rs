//! Patterns that no effect of the library makes: they compete in the evidence, so that what they are is not forced on an effect
//! that merely resembles it.

use std::f64::consts::TAU;

use crate::effect::{Accumulates, Carrier, Parity, Plan, Shaft, Signature, Station};

/// Part of its turn that a shaft must cover for its orders to be tried.
const LEAST_TURN: f64 = 0.9;
/// Highest order of waves that do not close with the turn.
const HIGHEST_WANDERING: f64 = 3.5;

/// Orders of a smooth pattern.
const SMOOTH_ORDERS: usize = 18;

/// What the choice of a wave that does not close with the turn costs, nats.
const WANDERING_COST_NATS: f64 = 5.0;

/// How a pattern scales with the condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// Not at all.
    One,
    /// With the load over its mean.
    Load,
    /// With the speed over its mean.
    Speed,
    /// With time over the campaign, 0 to 1.
    Time,
}

/// A pattern of columns.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// sin and cos of an order of a shaft.
    Order {
        /// Shaft.
        shaft: Shaft,
        /// Order; 0.5, 2.37 … for what does not close with the turn.
        order: f64,
        /// True where the sign turns with the sense.
        odd: bool,
        /// Scaling.
        weight: Weight,
        /// Mean of what it scales with.
        mean: f64,
    },
    /// An order in one sense only.
    OneSense {
        /// Shaft.
        shaft: Shaft,
        /// Order; 0 is a constant.
        order: u32,
        /// Sense.
        sense: f64,
    },
    /// All low orders of the driver in one sense only: whatever is smooth over its turn.
    Smooth {
        /// Sense.
        sense: f64,
    },
    /// A constant that scales with the condition.
    Level {
        /// True where the sign turns with the sense.
        odd: bool,
        /// Scaling.
        weight: Weight,
        /// Mean of what it scales with.
        mean: f64,
    },
    /// A level a run, the first run's being the zero.
    RunLevels {
        /// Runs.
        runs: usize,
    },
    /// A sine and cosine at a frequency of time.
    Tone {
        /// Frequency, Hz.
        frequency_hz: f64,
    },
    /// A step at a time.
    Step {
        /// Time since the campaign's start, s.
        time_s: f64,
    },
}

impl Pattern {
    /// The patterns tried under a plan.
    #[must_use]
    pub fn all(plan: &Plan) -> Vec<Self> {
        let mut patterns = Vec::new();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let both = plan.senses == [true, true];
        // Orders of a shaft that hardly turns are not orders but bent lines.
        let shafts: Vec<Shaft> = [Shaft::Input, Shaft::Output]
            .into_iter()
            .zip(plan.turns)
            .filter(|(_, turns)| *turns > LEAST_TURN)
            .map(|(shaft, _)| shaft)
            .collect();
        let parities: &[bool] = if both { &[false, true] } else { &[false] };
        let mut weights = vec![(Weight::One, 1.0)];
        if plan.loads_nm.len() > 1 {
            weights.push((Weight::Load, mean(&plan.loads_nm)));
        }
        if plan.speeds_rad_per_s.len() > 1 {
            weights.push((Weight::Speed, mean(&plan.speeds_rad_per_s)));
        }
        if plan.revolutions > 2.0 {
            weights.push((Weight::Time, plan.duration_s));
        }
        for &odd in parities {
            for &(weight, mean) in &weights {
                if weight != Weight::One {
                    patterns.push(Self::Level { odd, weight, mean });
                }
                for &shaft in &shafts {
                    for order in 1..=8 {
                        patterns.push(Self::Order { shaft, order: f64::from(order), odd, weight, mean });
                    }
                }
            }
        }
        if both {
            patterns.push(Self::Level { odd: true, weight: Weight::One, mean: 1.0 });
            for sense in [1.0, -1.0] {
                if shafts.contains(&Shaft::Input) {
                    patterns.push(Self::Smooth { sense });
                }
                for &shaft in &shafts {
                    for order in 1..=4 {
                        patterns.push(Self::OneSense { shaft, order, sense });
                    }
                }
            }
        }
        if plan.runs > 2 {
            patterns.push(Self::RunLevels { runs: plan.runs });
        }
        patterns
    }

    /// Waves over the driver's angle that do not close with its turn: a grid of orders as fine as the angle covered tells apart.
    #[must_use]
    pub fn wandering(span_rev: f64) -> Vec<Self> {
        let step = (0.4 / span_rev.max(1.0)).clamp(0.02, 0.2);
        let count = (HIGHEST_WANDERING / step) as usize;
        (1..=count)
            .map(|n| n as f64 * step)
            .filter(|order| (order - order.round()).abs() > 0.25 * step || *order < 0.9)
            .map(|order| Self::Order { shaft: Shaft::Input, order, odd: false, weight: Weight::One, mean: 1.0 })
            .collect()
    }

    /// The same wave with orders closer about its own; none where it closes with the turn.
    #[must_use]
    pub fn nearer(&self, step: f64) -> Vec<Self> {
        match self {
            Self::Order { shaft, order, odd, weight, mean } if order.fract() != 0.0 => [-0.5, -0.25, 0.25, 0.5]
                .into_iter()
                .map(|part| Self::Order {
                    shaft: *shaft,
                    order: order + part * step,
                    odd: *odd,
                    weight: *weight,
                    mean: *mean,
                })
                .collect(),
            _ => Vec::new(),
        }
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> usize {
        match self {
            Self::Order { .. } | Self::Tone { .. } => 2,
            Self::OneSense { order, .. } => {
                if *order == 0 {
                    1
                } else {
                    2
                }
            }
            Self::Level { .. } | Self::Step { .. } => 1,
            Self::Smooth { .. } => 2 * SMOOTH_ORDERS,
            Self::RunLevels { runs } => runs - 1,
        }
    }

    /// What it costs that it was chosen from many, nats.
    #[must_use]
    pub fn cost_nats(&self) -> f64 {
        match self {
            // The grid of orders and those between.
            Self::Order { order, .. } if order.fract() != 0.0 => WANDERING_COST_NATS,
            _ => 0.0,
        }
    }

    /// True where the pattern differs between revolutions of one condition.
    #[must_use]
    pub fn evolves(&self) -> bool {
        match self {
            Self::Order { order, weight, .. } => *weight == Weight::Time || order.fract() != 0.0,
            Self::Level { weight, .. } => *weight == Weight::Time,
            Self::Tone { .. } | Self::Step { .. } => true,
            _ => false,
        }
    }

    /// Values at a station.
    pub fn row(&self, at: &Station, row: &mut [f64]) {
        let scale = |weight: Weight, mean: f64, odd: bool| {
            let size = match weight {
                Weight::One => 1.0,
                Weight::Load => at.load_nm / mean,
                Weight::Speed => at.speed_rad_per_s.abs() / mean,
                Weight::Time => at.time_s / mean,
            };
            if odd { at.sense * size } else { size }
        };
        match self {
            Self::Order { shaft, order, odd, weight, mean } => {
                at.wave(*shaft, *order, scale(*weight, *mean, *odd), row);
            }
            Self::OneSense { shaft, order, sense } => {
                if at.sense * sense > 0.0 {
                    let (sin, cos) = (f64::from(*order) * at.angle_rad(*shaft)).sin_cos();
                    row[0] = cos;
                    if *order > 0 {
                        row[1] = sin;
                    }
                }
            }
            Self::Smooth { sense } => {
                if at.sense * sense > 0.0 {
                    for (order, columns) in (1_u32..).zip(row.chunks_exact_mut(2)) {
                        at.wave(Shaft::Input, f64::from(order), 1.0, columns);
                    }
                }
            }
            Self::Level { odd, weight, mean } => row[0] = scale(*weight, *mean, *odd),
            Self::RunLevels { .. } => {
                if at.run > 0 {
                    row[at.run - 1] = 1.0;
                }
            }
            Self::Tone { frequency_hz } => {
                let (sin, cos) = (TAU * frequency_hz * at.time_s).sin_cos();
                row[0] = sin;
                row[1] = cos;
            }
            Self::Step { time_s } => row[0] = f64::from(u8::from(at.time_s >= *time_s)),
        }
    }

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
            Self::OneSense { shaft, order, sense } => {
                let sense = if *sense > 0.0 { "ccw" } else { "cw" };
                format!("order {order} of the {} when driving {sense} only", shaft_name(shaft))
            }
            Self::Smooth { sense } => {
                let sense = if *sense > 0.0 { "ccw" } else { "cw" };
                format!("a smooth pattern over the driver's turn when driving {sense} only")
            }
            Self::Level { odd, weight, .. } => format!("an offset, {}", scaled(*odd, *weight)),
            Self::RunLevels { .. } => "an offset that differs from run to run".to_owned(),
            Self::Tone { frequency_hz } => format!("a tone of {frequency_hz:.4} Hz in time"),
            Self::Step { time_s } => format!("a step at {time_s:.2} s"),
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
            Self::OneSense { shaft, .. } => Signature::steady(shaft.carrier(), Parity::OneFlank),
            Self::Smooth { .. } => Signature::steady(Carrier::Input, Parity::OneFlank),
            Self::Level { odd, weight, .. } => scaled(Carrier::None, *odd, *weight),
            Self::RunLevels { .. } | Self::Step { .. } => Signature::steady(Carrier::None, Parity::Mixed),
            Self::Tone { .. } => Signature::steady(Carrier::Time, Parity::Mixed),
        }
    }
}
