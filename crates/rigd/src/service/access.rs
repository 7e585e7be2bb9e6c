//! Who may ask what: where the service may listen, and which requests need the token.

use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};
use thiserror::Error;

/// A token shorter than this can be guessed.
const SHORTEST_TOKEN: usize = 16;

/// Why the service does not start.
#[derive(Debug, Error)]
pub enum AccessError {
    /// Other machines would reach it unprotected.
    #[error(
        "--listen {address} can be reached from other machines, so it needs {missing}; or listen on 127.0.0.1:{port} and tunnel: ssh -N -L {port}:127.0.0.1:{port} THIS-HOST"
    )]
    Exposed {
        /// Where it was to listen.
        address: SocketAddr,
        /// Options that are missing.
        missing: String,
        /// Its port.
        port: u16,
    },
    /// Control without a token.
    #[error(
        "--control needs --token-file: stopping and starting a rig is not for everyone on this machine; make one with: (umask 077; head -c 24 /dev/urandom | base64 > token)"
    )]
    ControlWithoutToken,
    /// The token's file cannot be read.
    #[error("--token-file {}: {source}; give a file with the token alone in it", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// Others can read the token.
    #[error("--token-file {}: mode {mode:03o} lets others read it; chmod 600 it, and make a new token", path.display())]
    Readable {
        /// The file.
        path: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// The token is too short.
    #[error("--token-file {}: the token has {length} characters, at least {SHORTEST_TOKEN} are needed; make one with: head -c 24 /dev/urandom | base64", path.display())]
    Short {
        /// The file.
        path: PathBuf,
        /// Its length.
        length: usize,
    },
    /// Certificate or key.
    #[error("{option} {}: {reason}; give PEM files of one certificate chain and its private key", path.display())]
    Tls {
        /// The option.
        option: &'static str,
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

/// A token, of which only a hash is kept: what is not there cannot reach a log.
#[derive(Clone)]
pub struct Token([u8; 32]);

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token(hidden)")
    }
}

impl Token {
    /// The token of this text.
    #[must_use]
    pub fn of(text: &str) -> Self {
        Self(Sha256::digest(text.as_bytes()).into())
    }

    /// Reads the token from a file that its owner alone may read.
    ///
    /// # Errors
    /// [`AccessError`] names the file and what to do; never the token.
    pub fn load(path: &Path) -> Result<Self, AccessError> {
        use std::os::unix::fs::MetadataExt as _;
        let read = |source| AccessError::Read { path: path.into(), source };
        let facts = std::fs::metadata(path).map_err(read)?;
        let mode = facts.mode() & 0o777;
        // A credential of systemd is root's, with an access list for the service's user; the mode then shows the list's mask as the group's.
        let credential = facts.uid() == 0 && facts.gid() == 0 && mode & 0o037 == 0;
        if mode & 0o077 != 0 && !credential {
            return Err(AccessError::Readable { path: path.into(), mode });
        }
        let text = std::fs::read_to_string(path).map_err(read)?;
        let text = text.trim();
        match text.chars().count() {
            length if length < SHORTEST_TOKEN => Err(AccessError::Short { path: path.into(), length }),
            _ => Ok(Self::of(text)),
        }
    }

    /// Whether `offered` is the token; takes as long whatever is offered, for hashes are compared, and all of them.
    #[must_use]
    pub fn matches(&self, offered: &str) -> bool {
        let offered = Self::of(offered);
        self.0.iter().zip(offered.0).fold(0, |difference, (ours, theirs)| difference | (ours ^ theirs)) == 0
    }
}

/// Who may ask what.
#[derive(Debug, Clone)]
pub struct Access {
    /// The token, where there is one.
    pub token: Option<Token>,
    /// Stopping, pausing and starting are allowed, with the token.
    pub control: bool,
    /// Other machines reach the service: reading needs the token, too.
    pub exposed: bool,
}

/// How a request is met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Go on.
    Allowed,
    /// A token is needed.
    NoToken,
    /// A wrong one was given.
    WrongToken,
    /// The service was started read-only.
    ReadOnly,
}

impl Access {
    /// Checks that the service may listen at `address`.
    ///
    /// # Errors
    /// [`AccessError`] says what is missing.
    pub fn new(address: SocketAddr, token: Option<Token>, tls: bool, control: bool) -> Result<Self, AccessError> {
        let exposed = !address.ip().is_loopback();
        if exposed {
            let missing: Vec<_> = [(tls, "--tls-cert and --tls-key"), (token.is_some(), "--token-file")]
                .into_iter()
                .filter_map(|(given, option)| (!given).then_some(option))
                .collect();
            if !missing.is_empty() {
                return Err(AccessError::Exposed { address, missing: missing.join(", "), port: address.port() });
            }
        }
        if control && token.is_none() {
            return Err(AccessError::ControlWithoutToken);
        }
        Ok(Self { token, control, exposed })
    }

    /// Judges a request; `offered` is the token in its `Authorization: Bearer` header.
    #[must_use]
    pub fn judge(&self, changes: bool, offered: Option<&str>) -> Verdict {
        if changes && !self.control {
            return Verdict::ReadOnly;
        }
        match (&self.token, offered) {
            (Some(token), Some(offered)) if token.matches(offered) => Verdict::Allowed,
            // A token that is wrong is told, even where none is needed.
            (_, Some(_)) => Verdict::WrongToken,
            (_, None) if changes || self.exposed => Verdict::NoToken,
            _ => Verdict::Allowed,
        }
    }
}

/// Whether a request's `Host` is one under which a browser on this machine asks. A page of another site that makes its name resolve to
/// 127.0.0.1 would carry its own name here.
#[must_use]
pub fn is_local_host(host: &str) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.rsplit_once(':').map_or(host, |(name, _)| name),
    };
    name.eq_ignore_ascii_case("localhost") || name.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOCAL: &str = "127.0.0.1:8377";

    fn access(address: &str, token: bool, tls: bool, control: bool) -> Result<Access, AccessError> {
        Access::new(address.parse().unwrap(), token.then(|| Token::of("a long enough token")), tls, control)
    }

    #[test]
    fn other_machines_need_both_token_and_tls_and_the_error_says_what_to_do() {
        for (token, tls, named) in [
            (false, false, vec!["--tls-cert", "--token-file"]),
            (true, false, vec!["--tls-cert"]),
            (false, true, vec!["--token-file"]),
        ] {
            for address in ["0.0.0.0:8377", "192.168.1.7:8377", "[::]:8377"] {
                let said = access(address, token, tls, false).unwrap_err().to_string();
                assert!(named.iter().all(|option| said.contains(option)) && said.contains("ssh -N -L 8377"), "{said}");
            }
        }
        assert!(access("0.0.0.0:8377", true, true, false).unwrap().exposed);
        assert!(!access(LOCAL, false, false, false).unwrap().exposed);
        assert!(!access("[::1]:1", false, false, false).unwrap().exposed);
        assert!(matches!(access(LOCAL, false, true, true), Err(AccessError::ControlWithoutToken)));
    }

    #[test]
    fn every_request_is_judged_by_change_token_and_place() {
        use Verdict::*;
        let (good, bad) = (Some("a long enough token"), Some("another one"));
        let viewer = access(LOCAL, false, false, false).unwrap();
        let judged = |access: &Access| {
            [(false, None), (false, good), (false, bad), (true, None), (true, good), (true, bad)]
                .map(|(changes, token)| access.judge(changes, token))
        };
        assert_eq!(judged(&viewer), [Allowed, WrongToken, WrongToken, ReadOnly, ReadOnly, ReadOnly]);
        let guarded = access(LOCAL, true, false, false).unwrap();
        assert_eq!(judged(&guarded), [Allowed, Allowed, WrongToken, ReadOnly, ReadOnly, ReadOnly]);
        let control = access(LOCAL, true, false, true).unwrap();
        assert_eq!(judged(&control), [Allowed, Allowed, WrongToken, NoToken, Allowed, WrongToken]);
        let remote = access("0.0.0.0:1", true, true, false).unwrap();
        assert_eq!(judged(&remote), [NoToken, Allowed, WrongToken, ReadOnly, ReadOnly, ReadOnly]);
    }

    #[test]
    fn tokens_come_from_private_files_and_are_never_shown() {
        use std::os::unix::fs::PermissionsExt as _;
        let directory = tempfile::TempDir::new().unwrap();
        let path = directory.path().join("token");
        let write = |text: &str, mode| {
            std::fs::write(&path, text).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            Token::load(&path)
        };
        let token = write("0123456789abcdef\n", 0o600).unwrap();
        assert!(token.matches("0123456789abcdef") && !token.matches("0123456789abcdeF") && !token.matches(""));
        assert!(!format!("{token:?}").contains("0123"));
        let said = write("0123456789abcdef", 0o644).unwrap_err().to_string();
        assert!(said.contains("644") && !said.contains("0123"), "{said}");
        let said = write("short", 0o600).unwrap_err().to_string();
        assert!(said.contains("16") && !said.contains("short\n"), "{said}");
        assert!(matches!(Token::load(Path::new("/nowhere")), Err(AccessError::Read { .. })));
    }

    #[test]
    fn only_names_of_this_machine_are_local() {
        for host in ["localhost", "LOCALHOST:8377", "127.0.0.1:8377", "127.1.2.3", "[::1]:8377", "[::1]"] {
            assert!(is_local_host(host), "{host}");
        }
        for host in [
            "evil.example",
            "evil.example:8377",
            "127.0.0.1.evil.example",
            "10.0.0.1",
            "",
            "[::2]:80",
            "localhost.evil",
        ] {
            assert!(!is_local_host(host), "{host}");
        }
    }
}
