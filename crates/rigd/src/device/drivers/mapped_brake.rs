//! A current source of the brake's coil over Modbus RTU, driven by its register map.

use async_trait::async_trait;

use crate::device::bus::BusStatistics;
use crate::device::lost_device::LostDevice;
use crate::device::map::{BrakeRules, Map, Mapped};
use crate::device::{Brake, BrakeStatus, DeviceError, DeviceKind, Identity};
use crate::link::{Address, Link};
use crate::profile::BrakeProfile;

struct MappedBrake {
    device: Mapped,
    rules: BrakeRules,
}

/// The driver on an open link, by the map that the profile names.
#[must_use]
pub fn open(link: Link, address: Address, profile: &BrakeProfile) -> Box<dyn Brake> {
    match Map::of_brake(profile) {
        Ok((map, rules)) => {
            let bus = map.bus(link, address, profile.unit, profile.late_replies());
            // The first model, whose currents are the smallest, until the device has said which it is.
            let model = map.models.first().cloned();
            Box::new(MappedBrake { device: Mapped { bus, map, model }, rules })
        }
        Err(reason) => Box::new(LostDevice::unmapped(DeviceKind::Brake, reason)),
    }
}

impl MappedBrake {
    /// Model by its number: with a guessed scale the coil could get ten times the current.
    async fn select_model(&mut self) -> Result<String, DeviceError> {
        let Some(register) = self.rules.model.clone() else { return Ok(self.device.map.title.clone()) };
        let id = self.device.get(&register).await?;
        let models = &self.device.map.models;
        let found = models.iter().find(|model| (f64::from(model.ids[0])..=f64::from(model.ids[1])).contains(&id));
        let Some(model) = found.cloned() else {
            let known: Vec<String> = models.iter().map(|model| format!("{} {:?}", model.name, model.ids)).collect();
            return Err(DeviceError::Unexpected {
                device: DeviceKind::Brake,
                port: self.device.bus.port().to_owned(),
                found: format!("model {id}, whose scales are unknown"),
                expected: format!("one of {}", known.join(", ")),
            });
        };
        let name = format!("{} {}", self.device.map.title, model.name);
        self.device.model = Some(model);
        Ok(name)
    }
}

#[async_trait(?Send)]
impl Brake for MappedBrake {
    async fn identify(&mut self) -> Result<Identity, DeviceError> {
        let mut text = self.select_model().await?;
        if let Some(name) = self.rules.serial.clone() {
            text += &format!(", serial {:08}", self.device.get(&name).await?);
        }
        if let Some(name) = self.rules.firmware.clone() {
            text += &format!(", firmware {:.2}", self.device.get(&name).await?);
        }
        Ok(Identity { text: format!("{text}, on {}", self.device.bus.port()) })
    }

    fn max_current_a(&self) -> f64 {
        self.device.register(&self.rules.current_set).limits().1
    }

    async fn prepare(&mut self, voltage_v: f64) -> Result<(), DeviceError> {
        let steps = self.rules.prepare.clone();
        Ok(self.device.run(&steps, &[("voltage_v", voltage_v)]).await?)
    }

    async fn set_current_a(&mut self, current_a: f64) -> Result<(), DeviceError> {
        let name = self.rules.current_set.clone();
        Ok(self.device.set(&name, current_a).await?)
    }

    async fn release(&mut self) -> Result<(), DeviceError> {
        let steps = self.rules.release.clone();
        Ok(self.device.run(&steps, &[]).await?)
    }

    async fn status(&mut self) -> Result<BrakeStatus, DeviceError> {
        let status = &self.rules.status;
        let names = [&status.current, &status.temperature, &status.tripped.register, &status.enabled.register];
        let registers = names.map(|name| self.device.register(name));
        let values = self.device.bus.get_all(&registers.each_ref()).await?;
        Ok(match values[..] {
            [current_a, temperature_c, tripped, enabled] => BrakeStatus {
                current_a,
                temperature_c,
                tripped: status.tripped.holds(tripped),
                enabled: status.enabled.holds(enabled),
            },
            // As many values come back as were asked for.
            _ => BrakeStatus { tripped: true, ..BrakeStatus::default() },
        })
    }

    fn statistics(&self) -> BusStatistics {
        self.device.bus.statistics()
    }
}
