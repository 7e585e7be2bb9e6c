//! Pseudo-terminals: a device's end in this process, a path that any master can open, and reopen.

use std::io;
use std::os::fd::AsRawFd as _;
use std::path::{Path, PathBuf};

use tokio_serial::{SerialPort as _, SerialStream};

/// The masters' end of a pseudo-terminal, found at a path until this is dropped.
pub struct Terminal {
    /// Held open so that a master may close and reopen its end without a hang-up on the device's.
    end: SerialStream,
    link: PathBuf,
}

impl Terminal {
    /// The device's end of a new pseudo-terminal, and the masters' end, found at `link`.
    ///
    /// # Errors
    /// When the system has no terminal to give or `link` cannot be made.
    pub fn at(link: &Path) -> io::Result<(SerialStream, Self)> {
        // Both ends are raw from the start: nothing is echoed before a master has set the line.
        let (device, end) = SerialStream::pair()?;
        let path = end.name().ok_or_else(|| io::Error::other("the pseudo-terminal has no path"))?;
        match std::fs::remove_file(link) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => std::os::unix::fs::symlink(path, link)?,
        }
        Ok((device, Self { end, link: link.into() }))
    }

    /// Lets the next master in: one that asked for exclusive use and died leaves the terminal refusing all others.
    ///
    /// The library's own `set_exclusive(false)` would take a lock that keeps masters out.
    pub fn unlock(&self) {
        #[expect(unsafe_code, reason = "an ioctl without argument on a descriptor that we own")]
        // SAFETY: `end` is an open terminal for as long as `self` lives, and TIOCNXCL takes no argument.
        let _ = unsafe { release_exclusive(self.end.as_raw_fd()) };
    }
}

nix::ioctl_none_bad!(
    /// TIOCNXCL: other processes may open the terminal again.
    release_exclusive,
    nix::libc::TIOCNXCL
);

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.link);
    }
}
