//! Makes the frozen logs of a NEW format version: `cargo run --release -p riglog --example freeze -- 2`. Those of old versions are
//! never made again, so an existing file is refused.

use std::path::Path;

#[allow(clippy::unwrap_used, reason = "the tests' own log, of which this takes one function")]
#[path = "../tests/common/mod.rs"]
mod common;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let version: u32 = std::env::args().nth(1).ok_or("which version of the format?")?.parse()?;
    let directory = common::root().join("fixtures/logs");
    let path = directory.join(format!("v{version}.mcap"));
    if Path::new(&path).exists() {
        return Err(format!("{} is frozen", path.display()).into());
    }
    let plan = common::Plan { samples: 400, idle: 50, rate_hz: 1_000, revolutions: 0.1, loads_nm: &[5.0], lose: 3 };
    common::write(&path, &plan)?;
    let bytes = std::fs::read(&path)?;
    std::fs::write(directory.join(format!("v{version}_cut.mcap")), &bytes[..bytes.len() / 2])?;
    Ok(())
}
