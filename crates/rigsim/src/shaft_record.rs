//! The plant's own record of its shafts: what truly turned, whatever encoders, drives and logs say.

use std::fs::File;
use std::io::{self, Write as _};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use super::plant::Plant;

/// Time between two lines, ns.
const PERIOD_NS: u64 = 5_000_000;
/// rpm a rad/s.
const RPM: f64 = 60.0 / std::f64::consts::TAU;

/// A table that grows while the plant turns; a line is written at once, so that no kill loses any.
#[derive(Debug)]
pub struct ShaftRecord {
    file: File,
    began_unix_s: f64,
    next_ns: u64,
    failed: bool,
}

impl ShaftRecord {
    /// Makes the file; the plant's time 0 is now.
    ///
    /// # Errors
    /// The operating system's reason.
    pub fn create(path: &Path) -> io::Result<Self> {
        let mut file = File::create(path)?;
        writeln!(file, "unix_time_s,input_speed_rpm,output_speed_rpm,servo_on,brake_current_a,load_torque_nm")?;
        let began_unix_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
        Ok(Self { file, began_unix_s, next_ns: 0, failed: false })
    }

    /// Takes the plant as it is at its time `now_ns`.
    pub fn take(&mut self, now_ns: u64, plant: &Plant) {
        if now_ns < self.next_ns || self.failed {
            return;
        }
        self.next_ns = now_ns + PERIOD_NS;
        let truth = plant.truth();
        let [input, _, gear2, ..] = truth.speeds_rad_per_s.map(|speed| speed * RPM);
        let line = format!(
            "{:.4},{input:.4},{gear2:.4},{},{:.4},{:.3}\n",
            self.began_unix_s + now_ns as f64 * 1e-9,
            u8::from(plant.enabled()),
            plant.current_a(),
            truth.load_torque_nm,
        );
        if let Err(error) = self.file.write_all(line.as_bytes()) {
            tracing::error!("the record of the shafts ends here: {error}");
            self.failed = true;
        }
    }
}
