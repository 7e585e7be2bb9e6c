//! A link carries bytes to and from one device: a serial line, a socket, or a pipe to an emulator in this process.

use std::time::Duration;

use thiserror::Error;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio_serial::{DataBits, Parity, SerialPort as _, SerialPortBuilderExt as _, SerialStream, StopBits};
use wire::DeviceKind;

/// Anything that carries bytes both ways.
pub trait Duplex: AsyncRead + AsyncWrite + Unpin + Send {}
impl<T: AsyncRead + AsyncWrite + Unpin + Send> Duplex for T {}

/// A link to one device.
pub type Link = Box<dyn Duplex>;

/// Where a device is and how its line is set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// Which device, for messages.
    pub device: DeviceKind,
    /// Path or `tcp://host:port`.
    pub port: String,
    /// Line speed, bit/s.
    pub baud: u32,
    /// Character format, for instance `8N2`.
    pub format: String,
}

/// A character format that is not one of ours.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("format '{format}' is not DATA PARITY STOP; write for instance 8N1 or 8N2")]
pub struct FormatError {
    format: String,
}

/// Why a link could not be opened.
#[derive(Debug, Error)]
pub enum LinkError {
    /// The character format is not one of ours.
    #[error("{device}: {source}")]
    Format {
        /// Which device.
        device: DeviceKind,
        /// What was given.
        source: FormatError,
    },
    /// The port could not be opened.
    #[error(
        "{device}: port {port} cannot be opened: {source}; check that the device is plugged in, that no other program holds it, and that you may open it (group dialout)"
    )]
    Open {
        /// Which device.
        device: DeviceKind,
        /// The port.
        port: String,
        /// The reason.
        source: std::io::Error,
    },
    /// Nothing answered at the socket.
    #[error("{device}: {port} did not accept a connection within {seconds} s; check address, power and network")]
    ConnectTimeout {
        /// Which device.
        device: DeviceKind,
        /// The address.
        port: String,
        /// How long was waited.
        seconds: u64,
    },
}

/// How long a socket may take to accept.
const CONNECT_SECONDS: u64 = 3;

impl Address {
    /// Opens the link.
    ///
    /// # Errors
    /// [`LinkError`] names device, port and what to check.
    pub async fn open(&self) -> Result<Link, LinkError> {
        let failed = |source: std::io::Error| LinkError::Open { device: self.device, port: self.port.clone(), source };
        if let Some(address) = self.port.strip_prefix("tcp://") {
            let connect = tokio::net::TcpStream::connect(address);
            let stream = tokio::time::timeout(Duration::from_secs(CONNECT_SECONDS), connect)
                .await
                .map_err(|_| LinkError::ConnectTimeout {
                    device: self.device,
                    port: self.port.clone(),
                    seconds: CONNECT_SECONDS,
                })?
                .map_err(failed)?;
            stream.set_nodelay(true).map_err(failed)?;
            return Ok(Box::new(stream));
        }
        let (data, parity, stop) =
            line_format(&self.format).map_err(|source| LinkError::Format { device: self.device, source })?;
        let port: SerialStream = tokio_serial::new(&self.port, self.baud)
            .data_bits(data)
            .parity(parity)
            .stop_bits(stop)
            .open_native_async()
            .map_err(|error| failed(error.into()))?;
        // What an earlier master left in the buffers is no answer to us.
        port.clear(tokio_serial::ClearBuffer::All).map_err(|error| failed(error.into()))?;
        Ok(Box::new(port))
    }
}

/// Whether a character format is one of ours.
///
/// # Errors
/// [`FormatError`].
pub fn check_format(format: &str) -> Result<(), FormatError> {
    line_format(format).map(drop)
}

fn line_format(format: &str) -> Result<(DataBits, Parity, StopBits), FormatError> {
    let refuse = || FormatError { format: format.to_owned() };
    let mut parts = format.chars();
    let data = match parts.next() {
        Some('7') => DataBits::Seven,
        Some('8') => DataBits::Eight,
        _ => return Err(refuse()),
    };
    let parity = match parts.next() {
        Some('N') => Parity::None,
        Some('E') => Parity::Even,
        Some('O') => Parity::Odd,
        _ => return Err(refuse()),
    };
    let stop = match (parts.next(), parts.next()) {
        (Some('1'), None) => StopBits::One,
        (Some('2'), None) => StopBits::Two,
        _ => return Err(refuse()),
    };
    Ok((data, parity, stop))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(port: &str, format: &str) -> Address {
        Address { device: DeviceKind::Servo, port: port.into(), baud: 38400, format: format.into() }
    }

    #[test]
    fn formats() {
        assert_eq!(line_format("8N2").ok(), Some((DataBits::Eight, Parity::None, StopBits::Two)));
        assert_eq!(line_format("7E1").ok(), Some((DataBits::Seven, Parity::Even, StopBits::One)));
        for wrong in ["", "8", "8N", "8N3", "9N1", "8X1", "8N11"] {
            assert!(line_format(wrong).is_err(), "{wrong}");
        }
    }

    #[tokio::test]
    async fn a_missing_port_says_which_and_what_to_do() {
        let Err(error) = address("/nowhere/servo", "8N1").open().await else { panic!("opened nothing") };
        let said = error.to_string();
        assert!(said.contains("servo") && said.contains("/nowhere/servo") && said.contains("plugged in"), "{said}");
    }
}
