//! A device on its line, driven by its map.

use std::time::Duration;

use wire::register_map::{Access, RegisterDef, RegisterKind};

use super::{Map, ModelRules, Step};
use crate::device::bus::{Bus, BusError, BusTiming, LateReplyWindow, Span};
use crate::link::{Address, Link};

impl Map {
    /// A master of the device's line.
    #[must_use]
    pub fn bus(&self, link: Link, address: Address, unit: u8, late_replies: LateReplyWindow) -> Bus {
        let ms = |value: f64| Duration::from_secs_f64(value * 1e-3);
        let timing = BusTiming {
            silence: ms(self.line.silence_ms),
            patience: ms(self.line.patience_ms),
            attempts: self.line.attempts,
        };
        let spans: Vec<Span> =
            self.line.readable.iter().map(|[first, words]| Span { first: *first, words: *words }).collect();
        Bus::new(link, address, unit, timing).with_spans(&spans).with_late_replies(late_replies)
    }
}

/// A device on its line, driven by its map.
pub struct Mapped {
    pub bus: Bus,
    pub map: Map,
    pub model: Option<ModelRules>,
}

/// Quantities of a run that steps may name.
pub type Quantities<'a> = &'a [(&'static str, f64)];

impl Mapped {
    /// A register of the map; the map's check has found every name that its rules use.
    pub fn register(&self, name: &str) -> RegisterDef {
        self.map
            .register(name, self.model.as_ref())
            .unwrap_or_else(|| RegisterDef::new("(not in the map)", 0, RegisterKind::U16, 1.0, "", Access::Read))
    }

    /// A register for a person: its name, with that of the manual where the map tells it.
    pub fn called(&self, name: &str) -> String {
        match self.map.registers.get(name) {
            Some(register) if !register.label.is_empty() => format!("{name} {}", register.label),
            _ => name.to_owned(),
        }
    }

    pub async fn get(&mut self, name: &str) -> Result<f64, BusError> {
        let register = self.register(name);
        self.bus.get(&register).await
    }

    /// Writes a register, and reads it back where it can be.
    pub async fn set(&mut self, name: &str, value: f64) -> Result<(), BusError> {
        let register = self.register(name);
        if self.map.registers.get(name).is_some_and(|register| register.read_back) {
            return self.bus.set(&register, value).await;
        }
        let words = register.encode(value).map_err(|reason| self.bus.value_error(reason))?;
        self.bus.write_unverified(register.address, &words).await
    }

    pub async fn run(&mut self, steps: &[Step], quantities: Quantities<'_>) -> Result<(), BusError> {
        for step in steps {
            self.set(&step.set, step.value(quantities)).await?;
        }
        Ok(())
    }
}
