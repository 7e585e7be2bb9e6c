//! Magtrol DSP7000 as current source of the brake's coil, over its ASCII line. Commands: `wire::dsp7000`, docs/wire/dsp7000.md.
//!
//! A set current is not read back by the controller, so its status flags and torque reading are what shows that it lives: a set command
//! is confirmed by the reading that follows it.

use std::time::Duration;

use async_trait::async_trait;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::time::{Instant, timeout, timeout_at};
use wire::dsp7000::{Command, Dsp7000Error, FULL_SCALE_A, MAX_PERCENT, Reading, Status};

use crate::device::bus::BusStatistics;
use crate::device::{Brake, BrakeStatus, DeviceError, DeviceKind, Identity};
use crate::link::{Address, Link};
use crate::profile::BrakeProfile;

/// How long the controller may take to answer.
const PATIENCE: Duration = Duration::from_millis(300);
/// How often it is asked.
const ATTEMPTS: u32 = 3;
/// A line is silent when nothing came for so long.
const QUIET: Duration = Duration::from_millis(20);
/// Longest line of an answer.
const LONGEST: usize = 128;

struct Dsp7000 {
    link: Link,
    port: String,
    current_a: f64,
    enabled: bool,
    statistics: BusStatistics,
}

/// The driver on an open link.
#[must_use]
pub fn open(link: Link, address: Address, _: &BrakeProfile) -> Box<dyn Brake> {
    let (port, statistics) = (address.port, BusStatistics::default());
    Box::new(Dsp7000 { link, port, current_a: 0.0, enabled: false, statistics })
}

impl Dsp7000 {
    fn failed(&self, what: impl Into<String>) -> DeviceError {
        DeviceError::Line { device: DeviceKind::Brake, port: self.port.clone(), what: what.into() }
    }

    async fn send(&mut self, command: Command) -> Result<(), DeviceError> {
        let line = command.line().map_err(|error| self.failed(error.to_string()))?;
        let sent = match self.link.write_all(line.as_bytes()).await {
            Ok(()) => self.link.flush().await,
            Err(error) => Err(error),
        };
        sent.map_err(|error| self.failed(format!("the line failed: {error}")))
    }

    /// Throws away what came unasked, so that a late answer is not taken for the next one's.
    async fn drain(&mut self) -> Result<(), DeviceError> {
        let mut buffer = [0; LONGEST];
        let end = Instant::now() + PATIENCE;
        while Instant::now() < end {
            match timeout(QUIET, self.link.read(&mut buffer)).await {
                Err(_) => return Ok(()),
                Ok(Ok(0)) => return Err(self.failed("the line hung up")),
                Ok(Ok(count)) => self.statistics.stray_bytes += count as u64,
                Ok(Err(error)) => return Err(self.failed(format!("the line failed: {error}"))),
            }
        }
        Ok(())
    }

    /// Asks until a whole line comes that `read` takes. Answers of different commands have different forms.
    async fn ask<T>(
        &mut self,
        command: Command,
        read: impl Fn(&str) -> Result<T, Dsp7000Error>,
    ) -> Result<T, DeviceError> {
        let mut last = format!("no answer within {} ms", PATIENCE.as_millis());
        for attempt in 0..ATTEMPTS {
            self.statistics.retried += u64::from(attempt > 0);
            self.drain().await?;
            self.send(command).await?;
            let asked = Instant::now();
            match self.line(asked + PATIENCE).await? {
                None => self.statistics.timeouts += 1,
                Some(line) => match read(&line) {
                    Ok(value) => {
                        self.statistics.answered += 1;
                        let us = asked.elapsed().as_micros() as u64;
                        self.statistics.total_us += us;
                        self.statistics.slowest_us = self.statistics.slowest_us.max(us);
                        return Ok(value);
                    }
                    Err(error) => {
                        self.statistics.damaged += 1;
                        last = error.to_string();
                    }
                },
            }
        }
        Err(self.failed(format!("{last}, asked {ATTEMPTS} times; check power, cable and the line's settings")))
    }

    async fn line(&mut self, deadline: Instant) -> Result<Option<String>, DeviceError> {
        let (mut line, mut buffer) = (Vec::new(), [0; LONGEST]);
        loop {
            match timeout_at(deadline, self.link.read(&mut buffer)).await {
                Err(_) => return Ok(None),
                Ok(Ok(0)) => return Err(self.failed("the line hung up")),
                Ok(Err(error)) => return Err(self.failed(format!("the line failed: {error}"))),
                Ok(Ok(count)) => line.extend_from_slice(&buffer[..count]),
            }
            if line.ends_with(b"\r\n") || line.len() > LONGEST {
                let text = String::from_utf8_lossy(&line);
                return Ok(Some(text.trim_end_matches(['\r', '\n']).to_owned()));
            }
        }
    }
}

#[async_trait(?Send)]
impl Brake for Dsp7000 {
    async fn identify(&mut self) -> Result<Identity, DeviceError> {
        let text = self
            .ask(Command::Identify, |line| {
                if line.to_ascii_uppercase().contains("MAGTROL") {
                    Ok(line.to_owned())
                } else {
                    Err(Dsp7000Error::Answer { answer: line.into(), expected: "Magtrol's identification (*IDN?)" })
                }
            })
            .await?;
        Ok(Identity { text: format!("{text}, on {}", self.port) })
    }

    fn max_current_a(&self) -> f64 {
        MAX_PERCENT * 1e-2 * FULL_SCALE_A
    }

    async fn prepare(&mut self, _: f64) -> Result<(), DeviceError> {
        self.send(Command::TorqueOff).await?;
        self.set_current_a(0.0).await?;
        self.enabled = true;
        Ok(())
    }

    async fn set_current_a(&mut self, current_a: f64) -> Result<(), DeviceError> {
        self.send(Command::CurrentPercent(current_a / FULL_SCALE_A * 1e2)).await?;
        self.ask(Command::Read, Reading::parse).await?;
        self.current_a = current_a;
        Ok(())
    }

    async fn release(&mut self) -> Result<(), DeviceError> {
        self.send(Command::CurrentOff).await?;
        self.ask(Command::Read, Reading::parse).await?;
        (self.current_a, self.enabled) = (0.0, false);
        Ok(())
    }

    async fn status(&mut self) -> Result<BrakeStatus, DeviceError> {
        let status = self.ask(Command::Status, Status::parse).await?;
        // The controller measures no temperature; its temperature alarm trips.
        Ok(BrakeStatus {
            current_a: self.current_a,
            temperature_c: f64::NAN,
            tripped: status.any(Status::ALARMS),
            enabled: self.enabled,
        })
    }

    fn statistics(&self) -> BusStatistics {
        self.statistics
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A controller that answers the lines it is given.
    async fn answering(mut line: tokio::io::DuplexStream, alarm: bool) -> Vec<String> {
        let mut heard = Vec::new();
        let mut buffer = [0; LONGEST];
        while let Ok(count @ 1..) = line.read(&mut buffer).await {
            for command in String::from_utf8_lossy(&buffer[..count]).lines() {
                heard.push(command.to_owned());
                let answer = match command {
                    "*IDN?" => "MAGTROL DSP7000, 1.07\r\n",
                    "OD1" => "S    12T3.210R\r\n",
                    "STAT" if alarm => "4096\r\n",
                    "STAT" => "2\r\n",
                    _ => continue,
                };
                if line.write_all(answer.as_bytes()).await.is_err() {
                    return heard;
                }
            }
        }
        heard
    }

    fn driver(link: Link) -> Box<dyn Brake> {
        let address = Address { device: DeviceKind::Brake, port: "x".into(), baud: 19_200, format: "8N1".into() };
        open(link, address, &crate::profile::Profile::simulated().brake)
    }

    #[tokio::test(start_paused = true)]
    async fn sets_currents_and_sees_alarms() {
        let (near, far) = tokio::io::duplex(1024);
        let controller = tokio::spawn(answering(far, true));
        let mut brake = driver(Box::new(near));
        assert!(brake.identify().await.expect("answers").text.contains("DSP7000"));
        brake.prepare(24.0).await.expect("prepares");
        brake.set_current_a(0.25).await.expect("takes it");
        assert!(brake.set_current_a(1.2).await.is_err(), "beyond 1 A");
        let status = brake.status().await.expect("answers");
        assert_eq!((status.current_a, status.tripped, status.enabled), (0.25, true, true));
        brake.release().await.expect("releases");
        drop(brake);
        let heard = controller.await.expect("ends");
        assert_eq!(heard, ["*IDN?", "Q1", "I1,0.00", "OD1", "I1,25.00", "OD1", "STAT", "I1", "OD1"]);
    }

    #[tokio::test(start_paused = true)]
    async fn a_silent_controller_is_told() {
        let (near, _far) = tokio::io::duplex(1024);
        let error = driver(Box::new(near)).identify().await.expect_err("silent").to_string();
        assert!(error.contains("brake on x") && error.contains("asked 3 times"), "{error}");
    }
}
