//! Lines that misbehave: a port that nobody answers on, and a cable between daemon and device that can be silenced or pulled.

use std::fs::{File, OpenOptions};
use std::io::{Read as _, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::libc::{O_NOCTTY, O_NONBLOCK};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::ttyname;

/// A raw pseudo-terminal: the device's end, the daemon's end held open, and the daemon's path.
fn terminal() -> (File, File, PathBuf) {
    let ends = openpty(None, None).expect("a pseudo-terminal");
    let mut settings = tcgetattr(&ends.slave).expect("settings");
    cfmakeraw(&mut settings);
    tcsetattr(&ends.slave, SetArg::TCSANOW, &settings).expect("raw");
    fcntl(&ends.master, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).expect("not blocking");
    let path = ttyname(&ends.slave).expect("its path");
    (File::from(ends.master), File::from(ends.slave), path)
}

/// A port that opens and stays silent while this lives.
pub struct SilentPort {
    pub path: PathBuf,
    _ends: (File, File),
}

impl SilentPort {
    pub fn open() -> Self {
        let (device, daemon, path) = terminal();
        Self { path, _ends: (device, daemon) }
    }
}

/// What a line does with the device's bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// Passes them.
    None,
    /// Swallows them, both ways.
    Silent,
    /// Hangs up, as a USB adapter does that is pulled out.
    Unplugged,
    /// Answers noise to every request.
    Noise,
    /// Talks noise all the time.
    Chatter,
    /// Answers with the frames of another unit.
    OtherUnit,
    /// Gives every answer's bytes one bit wrong.
    FlippedBit,
}

const FAULTS: [Fault; 7] =
    [Fault::None, Fault::Silent, Fault::Unplugged, Fault::Noise, Fault::Chatter, Fault::OtherUnit, Fault::FlippedBit];

/// A cable between the daemon and a device's port.
pub struct Cable {
    pub path: PathBuf,
    fault: Arc<AtomicU8>,
    _thread: JoinHandle<()>,
}

impl Cable {
    /// To the device at `port`.
    pub fn to(port: &Path) -> Self {
        let far = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(O_NOCTTY | O_NONBLOCK)
            .open(port)
            .expect("the device");
        let (near, held, path) = terminal();
        let fault = Arc::new(AtomicU8::new(Fault::None as u8));
        let shared = Arc::clone(&fault);
        let thread = std::thread::spawn(move || carry(near, far, held, &shared));
        Self { path, fault, _thread: thread }
    }

    pub fn set(&self, fault: Fault) {
        self.fault.store(fault as u8, Ordering::Relaxed);
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        self.set(Fault::Unplugged);
    }
}

/// Carries bytes until the cable is pulled; `held` keeps the daemon's end from hanging up while it is closed.
fn carry(mut near: File, mut far: File, held: File, fault: &AtomicU8) {
    let mut bytes = [0; 4096];
    let mut noise = 0x9E37_79B9_u32;
    let mut random = move || {
        noise ^= noise << 13;
        noise ^= noise >> 17;
        noise ^= noise << 5;
        noise as u8
    };
    loop {
        let fault = FAULTS[usize::from(fault.load(Ordering::Relaxed))];
        if fault == Fault::Unplugged {
            break;
        }
        let asked = near.read(&mut bytes).unwrap_or(0);
        match fault {
            Fault::None | Fault::OtherUnit | Fault::FlippedBit => put(&mut far, &bytes[..asked]),
            Fault::Noise if asked > 0 => put(&mut near, &std::array::from_fn::<u8, 9, _>(|_| random())),
            Fault::Chatter => put(&mut near, &std::array::from_fn::<u8, 9, _>(|_| random())),
            _ => {}
        }
        let answered = far.read(&mut bytes).unwrap_or(0);
        if answered > 0 {
            match fault {
                Fault::OtherUnit => bytes[0] = bytes[0].wrapping_add(1),
                Fault::FlippedBit => bytes[answered / 2] ^= 0x10,
                _ => {}
            }
            if matches!(fault, Fault::None | Fault::OtherUnit | Fault::FlippedBit) {
                put(&mut near, &bytes[..answered]);
            }
        }
        if asked + answered == 0 || fault == Fault::Chatter {
            std::thread::sleep(Duration::from_micros(500));
        }
    }
    drop(held);
}

/// Writes all of it, waiting for a full line a little; what still does not pass is lost, as on a wire.
fn put(to: &mut File, mut bytes: &[u8]) {
    for _ in 0..100 {
        if bytes.is_empty() {
            return;
        }
        match to.write(bytes) {
            Ok(count) => bytes = &bytes[count..],
            Err(_) => std::thread::sleep(Duration::from_micros(200)),
        }
    }
}
