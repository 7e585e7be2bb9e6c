//! Riden RD60xx as current source of the brake's coil. Registers: `wire::rd60xx`, docs/wire/rd60xx.md.

use std::time::Duration;

use async_trait::async_trait;
use wire::rd60xx::{MAX_QUERIES_HZ, Map, Model, Protection, address};

use super::bus::{Bus, BusStatistics, Manners};
use super::{Brake, BrakeStatus, DeviceError, Identity};
use crate::link::{Address, Link};
use crate::profile::BrakeProfile;

struct Rd60xx {
    bus: Bus,
    map: Map,
}

/// The driver on an open link.
#[must_use]
pub fn open(link: Link, address: Address, profile: &BrakeProfile) -> Box<dyn Brake> {
    // The supply loses requests that come faster.
    let silence = Duration::from_secs_f64(1.0 / MAX_QUERIES_HZ);
    let manners = Manners { silence, patience: Duration::from_millis(150), attempts: 3 };
    // The smallest of the family until it has said which it is.
    Box::new(Rd60xx { bus: Bus::new(link, address, profile.unit, manners), map: Map::new(Model::Rd6006) })
}

#[async_trait(?Send)]
impl Brake for Rd60xx {
    async fn identify(&mut self) -> Result<Identity, DeviceError> {
        let words = self.bus.read(address::ID, address::FIRMWARE - address::ID + 1).await?;
        let model = Model::from_id(words[0]).map_err(|unknown| DeviceError::Unexpected {
            device: "brake",
            port: self.bus.port().to_owned(),
            found: unknown.to_string(),
            expected: "a Riden RD60xx".into(),
        })?;
        self.map = Map::new(model);
        let serial = u32::from(words[1]) << 16 | u32::from(words[2]);
        let firmware = f64::from(words[3]) / 100.0;
        Ok(Identity {
            text: format!("Riden {model:?}, serial {serial:08}, firmware {firmware:.2}, on {}", self.bus.port()),
        })
    }

    fn max_current_a(&self) -> f64 {
        self.map.model.max_current_a()
    }

    async fn prepare(&mut self, voltage_v: f64) -> Result<(), DeviceError> {
        self.bus.set(&self.map.current_set, 0.0).await?;
        self.bus.set(&self.map.voltage_set, voltage_v).await?;
        self.bus.set(&self.map.enable, 1.0).await?;
        Ok(())
    }

    async fn set_current_a(&mut self, current_a: f64) -> Result<(), DeviceError> {
        Ok(self.bus.set(&self.map.current_set, current_a).await?)
    }

    async fn release(&mut self) -> Result<(), DeviceError> {
        self.bus.set(&self.map.current_set, 0.0).await?;
        self.bus.set(&self.map.enable, 0.0).await?;
        Ok(())
    }

    async fn status(&mut self) -> Result<BrakeStatus, DeviceError> {
        let words = self.bus.read(Map::BLOCK_ADDRESS, Map::BLOCK_LEN).await?;
        let decode = |register: &wire::register_map::RegisterDef| {
            register.decode_from(Map::BLOCK_ADDRESS, &words).map_err(|reason| self.bus.value_error(reason))
        };
        Ok(BrakeStatus {
            current_a: decode(&self.map.current_out)?,
            temperature_c: decode(&self.map.temperature)?,
            tripped: Protection::from_register(decode(&self.map.protection)? as u16) != Protection::None,
            enabled: decode(&self.map.enable)? != 0.0,
        })
    }

    fn statistics(&self) -> BusStatistics {
        self.bus.statistics()
    }
}
