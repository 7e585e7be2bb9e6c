//! Patterns that no effect of the library makes: they compete in the evidence, so that what they are is not forced on an effect
//! that merely resembles it.

use std::f64::consts::{PI, TAU};

use gearmodel::effect::{Accumulates, Carrier, OperatingPoint, Parity, Plan, Shaft, Signature};

/// Part of its turn that a shaft must cover for its orders to be tried.
const LEAST_TURN: f64 = 0.9;
/// Highest order of a shaft that is always tried.
pub(super) const HIGHEST_ORDER: usize = 8;
/// Highest order of waves that do not close with the turn.
const HIGHEST_WANDERING: f64 = 3.5;

/// Orders of a smooth pattern.
const SMOOTH_ORDERS: usize = 18;

/// What a wave that does not close with the turn costs, nats: it was chosen from many, and the scatter of the low orders runs on from
/// turn to turn as such waves do.
const WANDERING_COST_NATS: f64 = 12.0;

/// Time constants of settling tried, and the ratio of neighbours.
const SETTLING_TIMES: usize = 8;
const SETTLING_RATIO: f64 = 1.5;
/// Fewest and most terms of a random walk.
const LEAST_TERMS: usize = 6;
const MOST_TERMS: usize = 48;
/// What a level that runs on with time costs, nats: scatter does too, a little.
const RUNNING_ON_COST_NATS: f64 = 6.0;

/// What an order that was chosen from all high ones costs, nats.
const GHOST_COST_NATS: f64 = 4.0;
/// The same of each further one that goes with it, nats.
const ANOTHER_GHOST_COST_NATS: f64 = 1.0;

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
    /// Several orders of a shaft together.
    Comb {
        /// Shaft.
        shaft: Shaft,
        /// Orders.
        orders: Vec<usize>,
        /// How large they are seen, against one another.
        sizes: Vec<f64>,
        /// True where the sign turns with the sense.
        odd: bool,
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
    /// A step at a time, and back at another.
    Step {
        /// Time since the campaign's start, s.
        time_s: f64,
        /// The same of the way back, infinite where it stays.
        until_s: f64,
        /// What the choice of the times costs, nats.
        cost_nats: f64,
    },
    /// Settles anew in each run: an exponential of the time since it began, of any size.
    Settling {
        /// Time constant, s.
        tau_s: f64,
        /// When the runs begin, s since the campaign's start.
        starts_s: Vec<f64>,
    },
    /// A level that wanders with time: a random walk by its Karhunen-Loeve series.
    RandomWalk {
        /// Terms.
        terms: usize,
        /// From the first to the last sample, s.
        duration_s: f64,
    },
}

/// Step of wandering waves' orders: a part of what the angle covered tells apart.
fn order_step(span_rev: f64) -> f64 {
    (0.4 / span_rev.max(1.0)).clamp(0.02, 0.2)
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
                    for order in 1..=HIGHEST_ORDER as u32 {
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
        let step = order_step(span_rev);
        let count = (HIGHEST_WANDERING / step) as usize;
        (1..=count)
            .map(|n| n as f64 * step)
            .filter(|order| (order - order.round()).abs() > 0.25 * step || *order < 0.9)
            .map(|order| Self::Order { shaft: Shaft::Input, order, odd: false, weight: Weight::One, mean: 1.0 })
            .collect()
    }

    /// Levels that run on with time: those that settle in each run, from a fortieth of a run to half of it, and a random walk.
    #[must_use]
    pub fn running_on(plan: &Plan) -> (Vec<Self>, Option<Self>) {
        let run_s = plan.duration_s / plan.runs.max(1) as f64;
        let settling = (0..SETTLING_TIMES).map(|n| Self::Settling {
            tau_s: 0.5 * run_s / SETTLING_RATIO.powf(n as f64),
            starts_s: plan.starts_s.clone(),
        });
        let terms = (plan.revolutions as usize).min(MOST_TERMS);
        let walk = (terms >= LEAST_TERMS).then_some(Self::RandomWalk { terms, duration_s: plan.duration_s });
        (settling.collect(), walk)
    }

    /// The same with its order or time constant closer about its own, a step being a part of the grid's; none where it has neither.
    #[must_use]
    pub fn nearer(&self, step: f64, span_rev: f64) -> Vec<Self> {
        match self {
            Self::Order { shaft, order, odd, weight, mean } if order.fract() != 0.0 => [-0.5, -0.25, 0.25, 0.5]
                .into_iter()
                .map(|part| Self::Order {
                    shaft: *shaft,
                    order: order + part * step * order_step(span_rev),
                    odd: *odd,
                    weight: *weight,
                    mean: *mean,
                })
                .collect(),
            Self::Settling { tau_s, starts_s } => [-0.5, 0.5]
                .into_iter()
                .map(|part: f64| Self::Settling {
                    tau_s: tau_s * SETTLING_RATIO.powf(part * step),
                    starts_s: starts_s.clone(),
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
            Self::Comb { orders, .. } => 2 * orders.len(),
            Self::RunLevels { runs } => runs - 1,
            Self::Settling { starts_s, .. } => starts_s.len(),
            Self::RandomWalk { terms, .. } => *terms,
        }
    }

    /// What it costs that it was chosen from many, nats.
    #[must_use]
    pub fn cost_nats(&self) -> f64 {
        match self {
            // The grid of orders and those between.
            Self::Order { order, .. } if order.fract() != 0.0 => WANDERING_COST_NATS,
            Self::Settling { .. } | Self::RandomWalk { .. } | Self::Tone { .. } => RUNNING_ON_COST_NATS,
            Self::Order { order, .. } if *order > HIGHEST_ORDER as f64 => GHOST_COST_NATS,
            Self::Step { cost_nats, .. } => *cost_nats,
            Self::Comb { orders, .. } => GHOST_COST_NATS + ANOTHER_GHOST_COST_NATS * (orders.len() as f64 - 1.0),
            _ => 0.0,
        }
    }

    /// True where it moves the level from revolution to revolution or run to run.
    #[must_use]
    pub fn moves_levels(&self) -> bool {
        matches!(
            self,
            Self::RunLevels { .. }
                | Self::Level { .. }
                | Self::Step { .. }
                | Self::Settling { .. }
                | Self::RandomWalk { .. }
                | Self::Tone { .. }
        )
    }

    /// True where the columns' own sizes say how much of each is expected.
    #[must_use]
    pub fn keeps_sizes(&self) -> bool {
        matches!(self, Self::RandomWalk { .. } | Self::Comb { .. })
    }

    /// True where the pattern differs between revolutions of one condition.
    #[must_use]
    pub fn evolves(&self) -> bool {
        match self {
            Self::Order { order, weight, .. } => *weight == Weight::Time || order.fract() != 0.0,
            Self::Level { weight, .. } => *weight == Weight::Time,
            Self::Tone { .. } | Self::Step { .. } | Self::Settling { .. } | Self::RandomWalk { .. } => true,
            _ => false,
        }
    }

    /// What grows evenly with time: the pattern that does, and the time over which it grows by its size, s.
    #[must_use]
    pub fn growing(&self) -> Option<(Self, f64)> {
        match self {
            Self::Order { shaft, order, odd, weight: Weight::Time, mean } if order.fract() == 0.0 => {
                let steady = Self::Order { shaft: *shaft, order: *order, odd: *odd, weight: Weight::One, mean: 1.0 };
                Some((steady, *mean))
            }
            _ => None,
        }
    }

    /// Values at an operating point.
    pub fn row(&self, at: &OperatingPoint, row: &mut [f64]) {
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
            Self::Comb { shaft, orders, sizes, odd } => {
                for ((order, size), columns) in orders.iter().zip(sizes).zip(row.chunks_exact_mut(2)) {
                    at.wave(*shaft, *order as f64, if *odd { at.sense * size } else { *size }, columns);
                }
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
            Self::Step { time_s, until_s, .. } => {
                row[0] = f64::from(u8::from((*time_s..*until_s).contains(&at.time_s)));
            }
            Self::Settling { tau_s, starts_s } => {
                row[at.run] = (-(at.time_s - starts_s[at.run]) / tau_s).exp();
            }
            Self::RandomWalk { duration_s, .. } => {
                // W(t) = Σ ζ_n √2 sin((n − ½)πt/T)/((n − ½)π), ζ_n independent and of unit variance.
                for (n, column) in row.iter_mut().enumerate() {
                    let k = (n as f64 + 0.5) * PI;
                    *column = (k * at.time_s / duration_s).sin() / k;
                }
            }
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
            Self::Comb { shaft, orders, odd, .. } => {
                let orders: Vec<String> = orders.iter().map(ToString::to_string).collect();
                let parity = scaled(*odd, Weight::One);
                format!("orders {} of the {}, {parity}", orders.join(", "), shaft_name(shaft))
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
