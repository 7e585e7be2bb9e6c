//! The simulated rig in the place of a real one: `rigsim` behind this daemon's links.
//!
//! It answers the real devices' bytes over pipes in this process or, with [`serve_ptys`], over pseudo-terminals that any
//! master can open. Drivers and codecs are the same either way.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;

use blindtest::plant_of_pair::{NoSimulatedGears, plant_of_pair};
use gearmodel::NominalModel;
use rigsim::emulator::QsbClock;
pub use rigsim::plant::PlantSpec;
use rigsim::plant::faults::{FAULTS, Fault, UNMODELLED_FAULTS, find};
use rigsim::pty::Terminal;
use rigsim::shaft_record::ShaftRecord;
use rigsim::simulated_rig::{self, SimulatedRig};
use rigsim::starter::Starter;
use rigsim::{commands, serve};
use thiserror::Error;
use wire::modbus::LineSettings;

use crate::device::DeviceKind;
use crate::link::Link;
use crate::profile::Profile;
use crate::run::session::Links;
use crate::run::stop::StopRequests;

/// Bytes that a pipe in this process holds.
const PIPE_BYTES: usize = 1 << 18;

/// Why there is no simulated rig.
#[derive(Debug, Error)]
pub enum SimError {
    /// The plant cannot be built.
    #[error("simulated rig: {0}")]
    Plant(#[from] rigsim::plant::PlantError),
    /// The pair is of a kind that the plant cannot turn.
    #[error(transparent)]
    Gears(#[from] NoSimulatedGears),
    /// An effect that there is not.
    #[error("'{name}' is not an effect of the simulated rig; it has: {known}")]
    Effect {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// A port could not be made.
    #[error("{what}: {source}")]
    Io {
        /// What was tried.
        what: String,
        /// The operating system's reason.
        source: std::io::Error,
    },
}

/// Whether the plant has a fault of this name.
#[must_use]
pub fn is_undocumented(name: &str) -> bool {
    find(name).is_some()
}

/// Names of the plant's faults.
#[must_use]
pub fn undocumented_names() -> Vec<&'static str> {
    FAULTS.iter().chain(UNMODELLED_FAULTS).map(|fault| fault.name).collect()
}

/// The plant's faults, a line each.
#[must_use]
pub fn describe_undocumented() -> String {
    let line = |fault: &Fault| format!("{:<32} {}", fault.name, fault.summary);
    let known = FAULTS.iter().map(line);
    let outside = UNMODELLED_FAULTS.iter().map(|fault| format!("{} (outside the library)", line(fault)));
    known.chain(outside).collect::<Vec<_>>().join("\n")
}

/// The plant for a nominal pair: its gears and documented errors, and what is left undocumented.
///
/// # Errors
/// [`SimError`] for a kind of pair or a fault that the plant has not.
pub fn spec(model: &NominalModel, undocumented: &[String]) -> Result<PlantSpec, SimError> {
    let mut spec = plant_of_pair(model)?;
    for name in undocumented {
        let fault = find(name)
            .ok_or_else(|| SimError::Effect { name: name.clone(), known: undocumented_names().join(", ") })?;
        fault.apply_usual(&mut spec);
    }
    Ok(spec)
}

/// Turns the encoders' discs on their shafts as the profile says they are.
pub fn mount_discs(spec: &mut PlantSpec, profile: &Profile) {
    spec.encoders.input.clocking_rad += profile.counter.input_mounted_deg.to_radians();
    spec.encoders.output.clocking_rad += profile.counter.output_mounted_deg.to_radians();
}

/// Starts the rig within this process, on the runtime's clock; needs a local task set.
///
/// # Errors
/// [`SimError`] when the plant cannot be built.
pub fn start_in_process(spec: &PlantSpec, rate_hz: f64, seed: u64) -> Result<Links, SimError> {
    Ok(links_to(&Rc::new(RefCell::new(SimulatedRig::new(spec, rate_hz, seed)?))))
}

/// Links to a rig within this process; a device that is unplugged hangs up and cannot be dialled.
#[must_use]
pub fn links_to(rig: &Rc<RefCell<SimulatedRig>>) -> Links {
    let shared = Rc::clone(rig);
    let dial = move |kind: DeviceKind| -> Option<Link> {
        let (ours, device) = tokio::io::duplex(PIPE_BYTES);
        let (rig, profile) = (Rc::clone(&shared), Profile::simulated());
        let mut unplugged = rig.borrow().plug(kind)?;
        tokio::task::spawn_local(async move {
            let served = async {
                match kind {
                    DeviceKind::Servo => serve::modbus(device, rig, servo_slave(&profile)).await,
                    DeviceKind::Brake => serve::modbus(device, rig, brake_slave(&profile)).await,
                    DeviceKind::Counter => serve::counter(device, rig).await,
                }
            };
            tokio::select! {
                () = served => {}
                _ = unplugged.changed() => {}
            }
        });
        Some(Box::new(ours))
    };
    let links = [DeviceKind::Servo, DeviceKind::Brake, DeviceKind::Counter].map(&dial);
    let [servo, brake, counter] = links;
    Links { servo, brake, counter, again: Some(Rc::new(dial)) }
}

fn servo_slave(profile: &Profile) -> serve::Slave {
    let servo = &profile.servo;
    serve::Slave::servo(servo.unit, line_settings(servo.baud, &servo.format))
}

fn brake_slave(profile: &Profile) -> serve::Slave {
    let brake = &profile.brake;
    serve::Slave::brake(brake.unit, line_settings(brake.baud, &brake.format))
}

fn line_settings(baud: u32, format: &str) -> LineSettings {
    LineSettings::no_parity(baud, if format.ends_with('2') { 2 } else { 1 })
}

/// What `rigd sim` does beside serving its ports.
#[derive(Debug, Clone, Default)]
pub struct Extras {
    /// A table of the true shaft speeds.
    pub record: Option<PathBuf>,
    /// Takes commands from standard input.
    pub commands: bool,
    /// QSB readers on both encoders, with these clocks, and a profile for them.
    pub readers: Option<[QsbClock; 2]>,
}

/// Makes a profile one whose encoders are read by two QSB readers at these ports.
fn read_by_qsb(profile: &mut Profile, [input, output]: [String; 2], lines: [u32; 2], zero_counts: [i64; 2]) {
    let counter = &mut profile.counter;
    counter.driver = crate::profile::qsb::DRIVER.into();
    (counter.port, counter.baud) = (input, wire::qsb::BAUD);
    counter.qsb = Some(crate::profile::QsbProfile {
        output_port: output,
        lines,
        quadrature: 4,
        interval_ticks: 1,
        transit_difference_ms: 1.0,
        zero_counts: Some(zero_counts),
    });
}

/// Serves the rig on pseudo-terminals in `directory` until a stop is asked for, or the run that started it dies; prints a line a
/// device, then `ready`.
///
/// # Errors
/// [`SimError`] when the plant cannot be built or a port cannot be made.
pub async fn serve_ptys(
    spec: &PlantSpec,
    seed: u64,
    directory: &Path,
    profile: &Profile,
    extras: &Extras,
    stop: StopRequests,
) -> Result<(), SimError> {
    use std::io::Write as _;
    let starter = Starter::look();
    let io = |what: String| move |source| SimError::Io { what, source };
    let directory = directory.canonicalize().map_err(io(format!("directory {}", directory.display())))?;
    let rig = Rc::new(RefCell::new(SimulatedRig::new(spec, simulated_rig::IDLE_RATE_HZ, seed)?));
    if let Some(path) = &extras.record {
        let record = ShaftRecord::create(path).map_err(io(format!("--record {}", path.display())))?;
        rig.borrow_mut().keep_record(record);
    }
    if extras.commands {
        commands::listen(&rig);
    }
    let port = |name: &str| {
        let path = directory.join(name);
        Terminal::at(&path).map_err(io(format!("port {}", path.display())))
    };
    let ((servo, at_servo), (brake, at_brake), (counter, at_counter)) =
        (port("servo")?, port("brake")?, port("counter")?);
    let mut profile = profile.clone();
    let at = |name: &str| directory.join(name).display().to_string();
    (profile.servo.port, profile.brake.port, profile.counter.port) = (at("servo"), at("brake"), at("counter"));
    let written = directory.join("profile.toml");
    let save = |path: &Path, profile: &Profile| {
        std::fs::write(path, profile.to_toml()).map_err(io(format!("profile {}", path.display())))
    };
    save(&written, &profile)?;
    let mut at_readers = Vec::new();
    if let Some(clocks) = extras.readers {
        let zero_counts = rig.borrow_mut().put_readers(clocks);
        let mut by_readers = profile.clone();
        // The plant's encoders after interpolation, as cycles of four counts.
        let lines = [&spec.encoders.input, &spec.encoders.output]
            .map(|encoder| u32::try_from(encoder.counts_per_rev() / 4).unwrap_or(u32::MAX));
        read_by_qsb(&mut by_readers, [at("input"), at("output")], lines, zero_counts);
        save(&directory.join("qsb.toml"), &by_readers)?;
        for (which, name) in ["input", "output"].into_iter().enumerate() {
            let (reader, at_reader) = port(name)?;
            tokio::task::spawn_local(serve::reader(reader, Rc::clone(&rig), which));
            at_readers.push(at_reader);
        }
    }

    tokio::task::spawn_local(serve::modbus(servo, Rc::clone(&rig), servo_slave(&profile)));
    tokio::task::spawn_local(serve::modbus(brake, Rc::clone(&rig), brake_slave(&profile)));
    tokio::task::spawn_local(serve::counter(counter, Rc::clone(&rig)));
    // Whoever has gone before `ready` was printed never learns the ports; later nobody needs to read.
    let unheard = || io("standard output".into());
    let mut out = std::io::stdout();
    let ports = [
        ("servo", &profile.servo.port, profile.servo.baud, &profile.servo.format, profile.servo.unit),
        ("brake", &profile.brake.port, profile.brake.baud, &profile.brake.format, profile.brake.unit),
        ("counter", &profile.counter.port, profile.counter.baud, &profile.counter.format, profile.counter.unit),
    ];
    for (name, path, baud, format, unit) in ports {
        writeln!(out, "{name} {path} {baud} {format} unit {unit}").map_err(unheard())?;
    }
    writeln!(out, "ready").and_then(|()| out.flush()).map_err(unheard())?;
    while !stop.any() && !starter.has_died() {
        tokio::time::sleep(Duration::from_millis(50)).await;
        for port in [&at_servo, &at_brake, &at_counter].into_iter().chain(&at_readers) {
            port.unlock();
        }
    }
    if starter.has_died() {
        // The run made the directory for itself and cannot clear it away any more.
        drop((at_servo, at_brake, at_counter, at_readers));
        let _ = std::fs::remove_file(directory.join("qsb.toml"));
        let _ = std::fs::remove_file(&written);
        let _ = std::fs::remove_dir(&directory);
    }
    Ok(())
}
