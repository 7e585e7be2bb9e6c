//! Lines that misbehave: a port that nobody answers on, and a cable between daemon and device that can be silenced or pulled.

use std::fs::{File, OpenOptions};
use std::io::{Read as _, Write as _};
use std::os::fd::OwnedFd;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use nix::fcntl::OFlag;
use nix::libc::{O_NOCTTY, O_NONBLOCK};
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

/// A raw pseudo-terminal: the device's end, the daemon's end held open, and the daemon's path. No process started later
/// inherits an end, or pulling the cable would hang up nothing.
fn terminal() -> (File, File, PathBuf) {
    let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_NONBLOCK | OFlag::O_CLOEXEC;
    let device = posix_openpt(flags).expect("a pseudo-terminal");
    grantpt(&device).expect("its other end is ours");
    unlockpt(&device).expect("its other end opens");
    let path = PathBuf::from(ptsname_r(&device).expect("its path"));
    let daemon = OpenOptions::new().read(true).write(true).custom_flags(O_NOCTTY).open(&path).expect("its other end");
    let mut settings = tcgetattr(&daemon).expect("settings");
    cfmakeraw(&mut settings);
    tcsetattr(&daemon, SetArg::TCSANOW, &settings).expect("raw");
    (File::from(OwnedFd::from(device)), daemon, path)
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
    thread: Option<JoinHandle<()>>,
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
        Self { path, fault, thread: Some(thread) }
    }

    pub fn set(&self, fault: Fault) {
        self.fault.store(fault as u8, Ordering::Relaxed);
    }
}

impl Cable {
    /// Takes it off both ends, so that another may open the device's port.
    pub fn pull(&mut self) {
        self.set(Fault::Unplugged);
        if let Some(thread) = self.thread.take() {
            thread.join().expect("it carried bytes to the end");
        }
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
                Fault::OtherUnit => readdress(&mut bytes[..answered]),
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

/// Makes an answer a faultless one of the next unit.
fn readdress(frame: &mut [u8]) {
    let Some((body, tail)) = frame.split_last_chunk_mut::<2>() else { return };
    body[0] = body[0].wrapping_add(1);
    // Modbus over Serial Line V1.02, §6.2: reflected 8005h, started at FFFFh, low byte first.
    let crc = body.iter().fold(0xFFFF_u16, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xA001 } else { crc >> 1 })
    });
    *tail = crc.to_le_bytes();
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
