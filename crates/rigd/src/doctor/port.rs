//! A port before it is opened: is it there, may we use it, and how late does its adapter deliver.

use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};

use nix::unistd::{AccessFlags, access};

use super::{Grade, Report};
use crate::link::Address;

/// Adapters that hold bytes longer than this break Modbus's silences and age the encoders' samples, ms.
const LATENCY_MS: u32 = 1;

/// Looks at a device's port.
pub fn examine(report: &mut Report, address: &Address) {
    let subject = format!("{} port", address.device);
    let port = address.port.as_str();
    if port == "sim" {
        report.good(subject, "simulated, in this process");
        return;
    }
    if port.starts_with("tcp://") {
        report.add(
            Grade::Warning,
            subject,
            format!("{port}: a network adds delay and can stall"),
            "use it for trials; give a rig that turns a cable of its own",
        );
        return;
    }
    let path = Path::new(port);
    let real = match path.canonicalize() {
        Ok(real) => real,
        Err(error) => {
            report.add(Grade::Fault, subject, format!("{port}: {error}"), present());
            return;
        }
    };
    if !real.metadata().is_ok_and(|metadata| metadata.file_type().is_char_device()) {
        report.add(Grade::Fault, subject, format!("{port} is no serial port"), present());
        return;
    }
    if let Err(error) = access(&real, AccessFlags::R_OK | AccessFlags::W_OK) {
        report.add(
            Grade::Fault,
            subject,
            format!("{port} may not be read and written: {error}"),
            "join its group: sudo usermod -aG dialout $USER, then log in again",
        );
        return;
    }
    let name = if real == path { port.to_owned() } else { format!("{port} → {}", real.display()) };
    if name.contains("ttyUSB") && real == path {
        report.add(
            Grade::Warning,
            subject,
            format!("{name} is there; such names change from plug to plug"),
            "use the name under /dev/serial/by-id",
        );
    } else {
        report.good(subject, format!("{name} is there and may be used"));
    }
    if let Some((file, latency_ms)) = latency_timer(&real) {
        let subject = format!("{} adapter", address.device);
        if latency_ms > LATENCY_MS {
            report.add(
                Grade::Fault,
                subject,
                format!("its latency timer is {latency_ms} ms: it holds bytes back for so long"),
                format!("echo {LATENCY_MS} | sudo tee {} (a udev rule makes it last)", file.display()),
            );
        } else {
            report.good(subject, format!("its latency timer is {latency_ms} ms"));
        }
    }
}

/// The latency timer of an FTDI adapter, which its driver shows under /sys.
fn latency_timer(port: &Path) -> Option<(PathBuf, u32)> {
    let file = Path::new("/sys/class/tty").join(port.file_name()?).join("device/latency_timer");
    let latency_ms = std::fs::read_to_string(&file).ok()?.trim().parse().ok()?;
    Some((file, latency_ms))
}

/// Ports that there are.
fn present() -> String {
    let mut names: Vec<String> = std::fs::read_dir("/dev/serial/by-id")
        .map(|entries| entries.flatten().map(|entry| entry.path().display().to_string()).collect())
        .unwrap_or_default();
    names.sort();
    if names.is_empty() {
        "plug the adapter in; no USB serial port is there now".into()
    } else {
        format!("check the plug, or use one of: {}", names.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::DeviceKind;

    fn of(port: &str) -> Report {
        let mut report = Report::default();
        examine(
            &mut report,
            &Address { device: DeviceKind::Servo, port: port.into(), baud: 38_400, format: "8N2".into() },
        );
        report
    }

    #[test]
    fn missing_files_and_others_are_told_apart() {
        let missing = of("/nowhere/servo");
        assert_eq!((missing.findings[0].grade, missing.count(Grade::Fault)), (Grade::Fault, 1));
        assert!(!missing.findings[0].advice.is_empty());
        assert!(of("/etc/hostname").findings[0].found.contains("no serial port"));
        assert_eq!(of("/dev/null").findings[0].grade, Grade::Good);
        assert_eq!(of("sim").count(Grade::Good), 1);
    }
}
