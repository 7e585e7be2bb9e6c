//! Carries the emulators' bytes: over pipes in this process, or over pseudo-terminals. Wire time is simulated, for neither paces.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _};
use tokio::time::{Instant, sleep_until, timeout};
use wire::modbus::{LineSettings, Request, frame_time, inter_frame_silence};

use super::emulator::{ModbusLine, Reply};
use super::simulated_rig::SimulatedRig;

/// A Modbus slave of the rig: its place on its line, and who answers.
pub struct Slave {
    unit: u8,
    line: LineSettings,
    handle: fn(&mut SimulatedRig, &Request) -> Reply,
}

impl Slave {
    /// The servo drive.
    #[must_use]
    pub fn servo(unit: u8, line: LineSettings) -> Self {
        Self { unit, line, handle: SimulatedRig::answer_servo }
    }

    /// The brake's current source.
    #[must_use]
    pub fn brake(unit: u8, line: LineSettings) -> Self {
        Self { unit, line, handle: SimulatedRig::answer_brake }
    }
}

/// Serves a Modbus slave until its line is closed.
pub async fn modbus(mut line: impl AsyncRead + AsyncWrite + Unpin, rig: Rc<RefCell<SimulatedRig>>, slave: Slave) {
    let mut protocol = ModbusLine::new();
    let mut buffer = [0; 512];
    let silence = inter_frame_silence(slave.line.baud);
    let mut partial = false;
    loop {
        // A frame that has begun ends, at the latest, with a silence.
        let read = if partial {
            timeout(silence.max(Duration::from_millis(2)), line.read(&mut buffer)).await
        } else {
            Ok(line.read(&mut buffer).await)
        };
        let answers = match read {
            Ok(Ok(0) | Err(_)) => return,
            Ok(Ok(count)) => {
                // The request's own time on the wire: a pipe delivers it at once.
                sleep_until(Instant::now() + frame_time(count, &slave.line)).await;
                partial = true;
                let mut rig = rig.borrow_mut();
                rig.advance();
                protocol.receive(&buffer[..count], slave.unit, |request| (slave.handle)(&mut rig, request))
            }
            Err(_) => {
                partial = false;
                let mut rig = rig.borrow_mut();
                rig.advance();
                protocol.idle(slave.unit, |request| (slave.handle)(&mut rig, request))
            }
        };
        let asked = Instant::now();
        for answer in answers {
            partial = false;
            // A master takes the answer when its last byte has passed the wire.
            let delay = Duration::from_nanos(answer.after_ns) + frame_time(answer.bytes.len(), &slave.line);
            sleep_until(asked + delay).await;
            if line.write_all(&answer.bytes).await.is_err() {
                return;
            }
        }
    }
}

/// How long a write may wait for the master before the box counts its line as blocked.
const BLOCKED: Duration = Duration::from_millis(5);

/// Serves the counter box until its line is closed.
pub async fn counter(mut line: impl AsyncRead + AsyncWrite + Unpin, rig: Rc<RefCell<SimulatedRig>>) {
    let mut bytes = Vec::new();
    let mut sent = 0;
    let mut buffer = [0; 512];
    loop {
        let due = rig.borrow().next_frame();
        tokio::select! {
            biased;
            read = line.read(&mut buffer) => {
                let Ok(count @ 1..) = read else { return };
                let mut rig = rig.borrow_mut();
                rig.advance();
                rig.tell_counter(&buffer[..count]);
            }
            () = sleep_until(due) => rig.borrow_mut().advance(),
        }
        rig.borrow_mut().take_stream(&mut bytes);
        // A frame once begun is ended, however late; while it waits, the box drops whole frames.
        let blocked = loop {
            if sent == bytes.len() {
                break false;
            }
            match timeout(BLOCKED, line.write(&bytes[sent..])).await {
                Ok(Ok(count @ 1..)) => sent += count,
                Ok(_) => return,
                Err(_) => break true,
            }
        };
        bytes.drain(..sent);
        sent = 0;
        rig.borrow_mut().set_line_blocked(blocked);
    }
}

/// How often a reader's line is served: an adapter's latency.
const READER_PERIOD: Duration = Duration::from_millis(2);

/// Serves a QSB reader until its line is closed; what a full line does not take is lost.
pub async fn reader(mut line: impl AsyncRead + AsyncWrite + Unpin, rig: Rc<RefCell<SimulatedRig>>, which: usize) {
    let mut buffer = [0; 512];
    let mut bytes = Vec::new();
    loop {
        let count = match timeout(READER_PERIOD, line.read(&mut buffer)).await {
            Ok(Ok(0) | Err(_)) => return,
            Ok(Ok(count)) => count,
            Err(_) => 0,
        };
        {
            let mut rig = rig.borrow_mut();
            rig.advance();
            rig.exchange_with_reader(which, &buffer[..count], &mut bytes);
        }
        if timeout(BLOCKED, line.write_all(&bytes)).await.is_ok_and(|written| written.is_err()) {
            return;
        }
        bytes.clear();
    }
}
