//! The rig's own counter box. Frames: `wire::counter_box`, docs/wire/counter-box.md.

use std::collections::VecDeque;
use std::time::Duration;

use async_trait::async_trait;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::time::{Instant, timeout_at};
use wire::Samples;
use wire::counter_box::{AckStatus, Command, Encoder, Frame, MAX_SAMPLES_PER_FRAME, PROTOCOL_VERSION, StreamDecoder};

use crate::device::{Counter, CounterIdentity, DeviceError, DeviceKind, Zero};
use crate::link::{Address, Link};
use crate::profile::CounterProfile;

/// How long the box may take to answer a command.
const PATIENCE: Duration = Duration::from_millis(500);
/// How often a command is sent.
const ATTEMPTS: u16 = 3;
/// Frames a second: a batch every 10 ms.
const FRAMES_HZ: f64 = 100.0;

struct CounterBox {
    link: Link,
    port: String,
    decoder: StreamDecoder,
    encoder: Encoder,
    frames: Vec<Frame>,
    samples: VecDeque<Samples>,
    request: u16,
    buffer: Box<[u8; 16384]>,
}

/// The driver on an open link.
#[must_use]
pub fn open(link: Link, address: Address, _: &CounterProfile) -> Box<dyn Counter> {
    Box::new(CounterBox {
        link,
        port: address.port,
        decoder: StreamDecoder::new(),
        encoder: Encoder::new(),
        frames: Vec::new(),
        samples: VecDeque::new(),
        request: 0,
        buffer: Box::new([0; 16384]),
    })
}

impl CounterBox {
    fn failed(&self, what: impl Into<String>) -> DeviceError {
        DeviceError::Counter { port: self.port.clone(), what: what.into() }
    }

    /// Reads what there is and sorts it: samples to their queue, answers returned. Cancelling it loses nothing.
    async fn receive(&mut self) -> Result<Vec<Frame>, DeviceError> {
        let count = match self.link.read(&mut self.buffer[..]).await {
            Ok(0) => return Err(self.failed("the line hung up (end of stream)")),
            Ok(count) => count,
            Err(error) => return Err(self.failed(format!("the line failed: {error}"))),
        };
        self.decoder.feed(&self.buffer[..count], &mut self.frames);
        let mut answers = Vec::new();
        for frame in self.frames.drain(..) {
            match frame {
                Frame::Samples(samples) => self.samples.push_back(samples),
                answer => answers.push(answer),
            }
        }
        Ok(answers)
    }

    /// Sends a command until `accept` takes an answer.
    async fn ask<T>(
        &mut self,
        what: &str,
        command: impl Fn(u16) -> Command,
        accept: impl Fn(&Frame, u16) -> Option<T>,
    ) -> Result<T, DeviceError> {
        for _ in 0..ATTEMPTS {
            self.request = self.request.wrapping_add(1);
            let request = self.request;
            let mut bytes = Vec::new();
            self.encoder.command(&command(request), &mut bytes);
            let sent = match self.link.write_all(&bytes).await {
                Ok(()) => self.link.flush().await,
                Err(error) => Err(error),
            };
            sent.map_err(|error| self.failed(format!("the line failed: {error}")))?;
            let deadline = Instant::now() + PATIENCE;
            while let Ok(answers) = timeout_at(deadline, self.receive()).await {
                if let Some(answer) = answers?.iter().find_map(|frame| accept(frame, request)) {
                    return Ok(answer);
                }
            }
        }
        let stats = self.decoder.stats();
        Err(self.failed(format!(
            "no answer to '{what}', asked {ATTEMPTS} times within {} ms each ({} damaged frames)",
            PATIENCE.as_millis(),
            stats.crc_errors + stats.malformed
        )))
    }

    async fn command(&mut self, what: &str, command: impl Fn(u16) -> Command) -> Result<(), DeviceError> {
        let status = self
            .ask(what, command, |frame, request| match frame {
                Frame::Ack(ack) if ack.request_id == request => Some(ack.status),
                _ => None,
            })
            .await?;
        match status {
            AckStatus::Done => Ok(()),
            refused => Err(self.failed(format!("the box refused '{what}': {refused:?}"))),
        }
    }
}

#[async_trait(?Send)]
impl Counter for CounterBox {
    async fn identify(&mut self) -> Result<CounterIdentity, DeviceError> {
        // A box that still streams for an earlier master is silenced first.
        self.command("stop", |request_id| Command::Stop { request_id }).await?;
        self.samples.clear();
        let identity = self
            .ask(
                "identify",
                |request_id| Command::Identify { request_id },
                |frame, request| match frame {
                    Frame::Identity(identity) if identity.request_id == request => Some(identity.clone()),
                    _ => None,
                },
            )
            .await?;
        if identity.protocol_version != PROTOCOL_VERSION {
            return Err(DeviceError::Unexpected {
                device: DeviceKind::Counter,
                port: self.port.clone(),
                found: format!("protocol version {}", identity.protocol_version),
                expected: format!("version {PROTOCOL_VERSION}"),
            });
        }
        Ok(CounterIdentity {
            text: format!("counter box, serial {}, firmware {}, on {}", identity.serial, identity.firmware, self.port),
            counts_per_rev: [identity.input_counts_per_rev, identity.output_counts_per_rev],
            lines: [identity.input_lines, identity.output_lines],
            max_rate_hz: f64::from(identity.max_sample_rate_hz),
            own_rate: false,
            zero: Zero::Index,
        })
    }

    async fn start(&mut self, rate_hz: f64) -> Result<(), DeviceError> {
        let sample_period_ns = (1e9 / rate_hz).round() as u32;
        let samples_per_frame = ((rate_hz / FRAMES_HZ).round() as u16).clamp(1, MAX_SAMPLES_PER_FRAME);
        self.samples.clear();
        self.command("start", |request_id| Command::Start { request_id, sample_period_ns, samples_per_frame }).await
    }

    async fn next(&mut self) -> Result<Samples, DeviceError> {
        loop {
            if let Some(samples) = self.samples.pop_front() {
                return Ok(samples);
            }
            self.receive().await?;
        }
    }

    async fn stop(&mut self) -> Result<(), DeviceError> {
        self.command("stop", |request_id| Command::Stop { request_id }).await
    }
}
