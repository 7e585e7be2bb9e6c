//! Patterns that no effect of the library makes: they compete in the evidence, so that what they are is not forced on an effect
//! that merely resembles it.

use std::f64::consts::{PI, TAU};

use super::settings::{NuisanceSettings, RunningOnSettings, Settings};
use gearmodel::effect::{MeasurementPlan, OperatingPoint, Shaft};

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
        /// Orders, from the first on.
        orders: usize,
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
fn order_step(span_rev: f64, settings: &NuisanceSettings) -> f64 {
    let [least, largest] = settings.wandering_steps;
    (settings.wandering_step / span_rev.max(1.0)).clamp(least, largest)
}

impl Pattern {
    /// The patterns tried under a plan.
    #[must_use]
    pub fn all(plan: &MeasurementPlan, settings: &NuisanceSettings) -> Vec<Self> {
        let mut patterns = Vec::new();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let both = plan.senses == [true, true];
        // Orders of a shaft that hardly turns are not orders but bent lines.
        let shafts: Vec<Shaft> = [Shaft::Input, Shaft::Output]
            .into_iter()
            .zip(plan.turns)
            .filter(|(_, turns)| *turns > settings.least_turn)
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
                    for order in 1..=settings.highest_order as u32 {
                        patterns.push(Self::Order { shaft, order: f64::from(order), odd, weight, mean });
                    }
                }
            }
        }
        if both {
            patterns.push(Self::Level { odd: true, weight: Weight::One, mean: 1.0 });
            for sense in [1.0, -1.0] {
                if shafts.contains(&Shaft::Input) {
                    patterns.push(Self::Smooth { sense, orders: settings.smooth_orders });
                }
                for &shaft in &shafts {
                    for order in 1..=settings.highest_one_sense {
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
    pub fn wandering(span_rev: f64, settings: &NuisanceSettings) -> Vec<Self> {
        let step = order_step(span_rev, settings);
        let count = (settings.highest_wandering / step) as usize;
        (1..=count)
            .map(|n| n as f64 * step)
            .filter(|order| (order - order.round()).abs() > 0.25 * step || *order < 0.9)
            .map(|order| Self::Order { shaft: Shaft::Input, order, odd: false, weight: Weight::One, mean: 1.0 })
            .collect()
    }

    /// Levels that run on with time: those that settle in each run, from a fortieth of a run to half of it, and a random walk.
    #[must_use]
    pub fn running_on(plan: &MeasurementPlan, settings: &RunningOnSettings) -> (Vec<Self>, Option<Self>) {
        let run_s = plan.duration_s / plan.runs.max(1) as f64;
        let settling = (0..settings.settling_times).map(|n| Self::Settling {
            tau_s: 0.5 * run_s / settings.settling_ratio.powf(n as f64),
            starts_s: plan.starts_s.clone(),
        });
        let terms = (plan.revolutions as usize).min(settings.most_terms);
        let walk = (terms >= settings.least_terms).then_some(Self::RandomWalk { terms, duration_s: plan.duration_s });
        (settling.collect(), walk)
    }

    /// The same with its order or time constant closer about its own, a step being a part of the grid's; none where it has neither.
    #[must_use]
    pub fn nearer(&self, step: f64, span_rev: f64, settings: &Settings) -> Vec<Self> {
        match self {
            Self::Order { shaft, order, odd, weight, mean } if order.fract() != 0.0 => [-0.5, -0.25, 0.25, 0.5]
                .into_iter()
                .map(|part| Self::Order {
                    shaft: *shaft,
                    order: order + part * step * order_step(span_rev, &settings.nuisance),
                    odd: *odd,
                    weight: *weight,
                    mean: *mean,
                })
                .collect(),
            Self::Settling { tau_s, starts_s } => [-0.5, 0.5]
                .into_iter()
                .map(|part: f64| Self::Settling {
                    tau_s: tau_s * settings.running_on.settling_ratio.powf(part * step),
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
            Self::Smooth { orders, .. } => 2 * orders,
            Self::Comb { orders, .. } => 2 * orders.len(),
            Self::RunLevels { runs } => runs - 1,
            Self::Settling { starts_s, .. } => starts_s.len(),
            Self::RandomWalk { terms, .. } => *terms,
        }
    }

    /// What it costs that it was chosen from many, nats.
    #[must_use]
    pub fn cost_nats(&self, settings: &Settings) -> f64 {
        match self {
            // The grid of orders and those between.
            Self::Order { order, .. } if order.fract() != 0.0 => settings.nuisance.wandering_cost_nats,
            Self::Settling { .. } | Self::RandomWalk { .. } | Self::Tone { .. } => settings.running_on.cost_nats,
            Self::Order { order, .. } if *order > settings.nuisance.highest_order as f64 => settings.ghosts.cost_nats,
            Self::Step { cost_nats, .. } => *cost_nats,
            Self::Comb { orders, .. } => {
                settings.ghosts.cost_nats + settings.ghosts.another_cost_nats * (orders.len() as f64 - 1.0)
            }
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
            Self::Smooth { sense, .. } => {
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
}
