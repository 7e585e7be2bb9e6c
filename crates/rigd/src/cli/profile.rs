//! `rigd profile`: check a profile or a register map, or write a new profile.

use std::io::{BufRead as _, IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};

use super::{Exit, print};
use crate::device::map::Map;
use crate::profile::lines::{Fault, Lines};
use crate::profile::{Profile, check};

/// Check a rig's profile or a register map, or write a new profile.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Say every fault of a profile or a register map at once, with file and line
    Check(Check),
    /// Ask what a rig has and write its profile
    New(Box<New>),
}

#[derive(Debug, clap::Args)]
struct Check {
    /// A profile, or a register map
    file: PathBuf,
    /// One JSON object instead of text
    #[arg(long)]
    json: bool,
}

#[derive(Debug, clap::Args)]
struct New {
    /// The file to write; one that exists is left alone
    file: PathBuf,
    /// The rig's name
    #[arg(long)]
    name: Option<String>,
    /// Servo driver: asda-b2, dsy-rs, or map
    #[arg(long)]
    servo: Option<String>,
    /// The servo's port
    #[arg(long, value_name = "PORT")]
    servo_port: Option<String>,
    /// Motor turns a turn of the driver gear
    #[arg(long)]
    reduction: Option<f64>,
    /// Brake driver: rd60xx, or map
    #[arg(long)]
    brake: Option<String>,
    /// The brake driver's port
    #[arg(long, value_name = "PORT")]
    brake_port: Option<String>,
    /// Brake turns a turn of the driven gear
    #[arg(long)]
    step_up: Option<f64>,
    /// Largest coil current, A
    #[arg(long, value_name = "A")]
    current_limit: Option<f64>,
    /// The counter box's port
    #[arg(long, value_name = "PORT")]
    counter_port: Option<String>,
    /// Largest speed of the driver gear, rpm
    #[arg(long, value_name = "RPM")]
    max_rpm: Option<f64>,
    /// Largest load at the driven gear, N·m
    #[arg(long, value_name = "NM")]
    max_load: Option<f64>,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    match &args.command {
        Command::Check(args) => check_file(args),
        Command::New(args) => new_file(args),
    }
}

fn check_file(args: &Check) -> Exit {
    let path = &args.file;
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) => {
            eprintln!("error: {}: {error}; name a file that you may read", path.display());
            return Exit::BadInput;
        }
    };
    let is_map = Lines::of(&text).keys().any(|(key, _)| key == "registers");
    let faults = if is_map { Map::parse(&text).err().unwrap_or_default() } else { check::faults(&text, path) };
    if args.json {
        let list: Vec<_> = faults
            .iter()
            .map(|fault| serde_json::json!({"line": fault.line, "key": fault.key, "what": fault.what}))
            .collect();
        let kind = if is_map { "map" } else { "profile" };
        print(
            &serde_json::json!({"schema": "rigd.profile-check/1", "file": path, "kind": kind, "faults": list})
                .to_string(),
        );
    } else {
        list(path, &faults, is_map);
    }
    if faults.is_empty() { Exit::Done } else { Exit::BadInput }
}

/// A line a fault, as editors and compilers take them.
fn list(path: &Path, faults: &[Fault], is_map: bool) {
    for Fault { line, key, what } in faults {
        let key = if key.is_empty() { String::new() } else { format!("{key} ") };
        eprintln!("{}:{line}: {key}{what}", path.display());
    }
    let what = if is_map { "register map" } else { "profile" };
    match faults.len() {
        0 => print(&format!("{}: a good {what}; `rigd doctor --profile` looks at the rig itself", path.display())),
        1 => eprintln!("error: 1 fault; nothing was moved or written"),
        count => eprintln!("error: {count} faults; nothing was moved or written"),
    }
}

/// Asks for what no flag gave; without a terminal the built-in profile's value stands, and ports must be given.
struct Asker {
    terminal: bool,
    missing: Vec<&'static str>,
}

impl Asker {
    fn ask<T: std::str::FromStr + std::fmt::Display + Clone>(
        &mut self,
        flag: &'static str,
        question: &str,
        given: Option<T>,
        usual: Option<T>,
    ) -> Option<T> {
        if given.is_some() {
            return given;
        }
        if !self.terminal {
            if usual.is_none() {
                self.missing.push(flag);
            }
            return usual;
        }
        for _ in 0..5 {
            match &usual {
                Some(usual) => eprint!("{question} [{usual}]: "),
                None => eprint!("{question}: "),
            }
            let _ = std::io::stderr().flush();
            let mut line = String::new();
            if std::io::stdin().lock().read_line(&mut line).unwrap_or(0) == 0 {
                break;
            }
            let answer = line.trim();
            if answer.is_empty() && usual.is_some() {
                return usual;
            }
            match answer.parse() {
                Ok(value) if !answer.is_empty() => return Some(value),
                _ => eprintln!("'{answer}' is not an answer to that"),
            }
        }
        self.missing.push(flag);
        None
    }
}

fn new_file(args: &New) -> Exit {
    let mut profile = Profile::simulated();
    let mut asker = Asker { terminal: std::io::stdin().is_terminal(), missing: Vec::new() };
    let rig = &mut profile;
    let mut put = |slot: &mut String, flag, question: &str, given: &Option<String>, usual: Option<&str>| {
        if let Some(value) = asker.ask(flag, question, given.clone(), usual.map(ToOwned::to_owned)) {
            *slot = value;
        }
    };
    put(&mut rig.name, "--name", "Name of the rig", &args.name, Some("lab"));
    put(&mut rig.servo.driver, "--servo", "Servo driver (asda-b2, dsy-rs, map)", &args.servo, Some("asda-b2"));
    put(&mut rig.servo.port, "--servo-port", "Port of the servo (see /dev/serial/by-id)", &args.servo_port, None);
    put(&mut rig.brake.driver, "--brake", "Brake driver (rd60xx, map)", &args.brake, Some("rd60xx"));
    put(&mut rig.brake.port, "--brake-port", "Port of the brake's current source", &args.brake_port, None);
    put(&mut rig.counter.port, "--counter-port", "Port of the counter box", &args.counter_port, None);
    let mut number = |slot: &mut f64, flag, question: &str, given: Option<f64>| {
        if let Some(value) = asker.ask(flag, question, given, Some(*slot)) {
            *slot = value;
        }
    };
    number(&mut rig.servo.reduction, "--reduction", "Motor turns a turn of the driver gear", args.reduction);
    number(&mut rig.brake.step_up, "--step-up", "Brake turns a turn of the driven gear", args.step_up);
    number(&mut rig.brake.current_limit_a, "--current-limit", "Largest coil current, A", args.current_limit);
    number(&mut rig.limits.speed_rpm, "--max-rpm", "Largest speed of the driver gear, rpm", args.max_rpm);
    number(&mut rig.limits.load_nm, "--max-load", "Largest load at the driven gear, N·m", args.max_load);
    rig.sequence.home_rpm = rig.sequence.home_rpm.min(rig.limits.speed_rpm);
    if !asker.missing.is_empty() {
        eprintln!("error: without a terminal to ask on, give {}; nothing was written", asker.missing.join(", "));
        return Exit::BadInput;
    }
    profile.source = "written by rigd profile new; registers: see the drivers' maps".into();
    let text = format!(
        "# The brake's curve and the limits below are those of the simulated rig: measure the curve, and check every limit\n# against your own hardware, before anything turns. `rigd profile check`, then `rigd doctor --profile`.\n{}",
        profile.to_toml()
    );
    let faults = check::faults(&text, &args.file);
    if !faults.is_empty() {
        list(&args.file, &faults, false);
        return Exit::BadInput;
    }
    let written = std::fs::File::create_new(&args.file).and_then(|mut file| file.write_all(text.as_bytes()));
    match written {
        Ok(()) => {
            print(&format!("{} written; next: rigd doctor --profile {0}", args.file.display()));
            Exit::Done
        }
        Err(error) => {
            eprintln!(
                "error: {}: {error}; name a file that does not exist in a directory that you may write",
                args.file.display()
            );
            Exit::BadInput
        }
    }
}
