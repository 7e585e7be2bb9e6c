//! What the tests of faults share: processes that never outlive their test, logs while they grow, and the simulated rig's
//! devices as another master sees them.
#![allow(dead_code, reason = "each test takes its part")]

pub mod bench;
pub mod desk;
pub mod line;

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use rigd::device::DeviceKind;
use rigd::device::bus::{Bus, BusTiming};
use rigd::link::Address;
use rigd::profile::Profile;
use riglog::proto::Phase;
use riglog::{LogReader, Record};
use tempfile::TempDir;
use wire::asda_b2::{ALARM, OUTPUTS, Outputs, STATUS_MONITOR, monitor};

/// The program, with a list of runs of its own: `rigd stop` of one test must not end another's run.
pub fn rigd(home: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rigd"));
    command.env("XDG_RUNTIME_DIR", home).stdin(Stdio::null());
    command
}

/// Asks until there is an answer.
pub fn wait_for<T>(what: &str, seconds: f64, mut ask: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(begun.elapsed().as_secs_f64() < seconds, "{what}: not within {seconds} s");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// A process that ends with its test.
pub struct Process(Child);

impl Process {
    pub fn spawn(command: &mut Command) -> Self {
        Self(command.spawn().expect("it starts"))
    }

    pub fn pid(&self) -> Pid {
        Pid::from_raw(i32::try_from(self.0.id()).expect("a process number"))
    }

    pub fn signal(&self, signal: Signal) {
        kill(self.pid(), signal).expect("it is there");
    }

    pub fn ended(&mut self) -> bool {
        self.0.try_wait().expect("a child").is_some()
    }

    pub fn wait(&mut self, seconds: f64) -> ExitStatus {
        wait_for("the end of the process", seconds, || self.0.try_wait().expect("a child"))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Whether a process is at work; one that only waits to be reaped is not.
pub fn lives(pid: Pid) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit(')')
        .next()
        .and_then(|rest| rest.split_whitespace().next())
        .is_some_and(|state| state != "Z" && state != "X")
}

/// Processes that `parent` started.
pub fn children(parent: Pid) -> Vec<Pid> {
    let list = std::fs::read_to_string(format!("/proc/{parent}/task/{parent}/children")).unwrap_or_default();
    list.split_whitespace().filter_map(|pid| pid.parse().ok()).map(Pid::from_raw).collect()
}

/// A line of the plant's own record.
#[derive(Debug, Clone, Copy)]
pub struct Shaft {
    pub unix_s: f64,
    pub input_rpm: f64,
    pub output_rpm: f64,
    pub servo_on: bool,
    pub brake_a: f64,
}

impl Shaft {
    pub fn turns(&self) -> bool {
        self.input_rpm.abs().max(self.output_rpm.abs()) > 0.1
    }
}

/// `rigd sim` as a process of its own.
pub struct Sim {
    pub process: Process,
    pub lines: Vec<String>,
    pub ready_s: f64,
    pub directory: TempDir,
}

impl Sim {
    pub fn start(seed: u64) -> Self {
        Self::start_with(seed, &[])
    }

    /// With more options.
    pub fn start_with(seed: u64, options: &[&str]) -> Self {
        let directory = TempDir::new().expect("a temporary directory");
        let begun = Instant::now();
        let ports = directory.path().join("ports");
        let mut command = rigd(directory.path());
        command.arg("sim").arg("--pty-dir").arg(&ports).arg("--seed").arg(seed.to_string()).stdout(Stdio::piped());
        command.args(options);
        command.arg("--commands").arg("--record").arg(directory.path().join("shafts.csv")).stdin(Stdio::piped());
        let mut process = Process::spawn(&mut command);
        let output = process.0.stdout.take().expect("its output");
        let mut lines = Vec::new();
        for line in BufReader::new(output).lines() {
            lines.push(line.expect("text"));
            if lines.last().is_some_and(|line| line == "ready") {
                break;
            }
        }
        assert_eq!(lines.last().map(String::as_str), Some("ready"));
        Self { process, lines, ready_s: begun.elapsed().as_secs_f64(), directory }
    }

    /// A command to the hands on the rig.
    pub fn tell(&mut self, command: &str) {
        use std::io::Write as _;
        writeln!(self.process.0.stdin.as_mut().expect("its input"), "{command}").expect("it listens");
    }

    /// The plant's own record of its shafts, whole lines.
    pub fn shafts(&self) -> Vec<Shaft> {
        let text = std::fs::read_to_string(self.directory.path().join("shafts.csv")).expect("a record");
        let line = |line: &str| {
            let values: Vec<f64> = line.split(',').filter_map(|value| value.parse().ok()).collect();
            let [unix_s, input_rpm, output_rpm, servo_on, brake_a, _] = values[..] else { return None };
            Some(Shaft { unix_s, input_rpm, output_rpm, servo_on: servo_on != 0.0, brake_a })
        };
        text[..text.rfind('\n').unwrap_or(0)].lines().skip(1).filter_map(line).collect()
    }

    /// How long after `since` the shafts still turned, s, once they have stood for a second; they did turn at `since`.
    pub fn standstill_after(&self, since: SystemTime, patience_s: f64) -> f64 {
        let since = since.duration_since(UNIX_EPOCH).expect("after 1970").as_secs_f64();
        wait_for("standstill in the plant's record", patience_s, || {
            let shafts = self.shafts();
            let end = shafts.last()?.unix_s;
            let before = shafts.iter().rfind(|shaft| shaft.unix_s <= since)?;
            assert!(before.turns(), "the shaft turned, so that there was something to stop: {before:?}");
            let last = shafts.iter().rfind(|shaft| shaft.turns())?.unix_s;
            (end - last > 1.0 && end > since).then_some((last - since).max(0.0))
        })
    }

    pub fn port(&self, name: &str) -> PathBuf {
        self.directory.path().join("ports").join(name)
    }

    /// The profile that it wrote, made quicker, and changed by `edit`.
    pub fn profile(&self, edit: impl FnOnce(&mut Profile)) -> PathBuf {
        self.profile_of("profile.toml", edit)
    }

    /// Likewise another profile that it wrote.
    pub fn profile_of(&self, name: &str, edit: impl FnOnce(&mut Profile)) -> PathBuf {
        let mut profile = Profile::load(&self.port(name)).expect("its own profile");
        let sequence = &mut profile.sequence;
        (sequence.home_rpm, sequence.settle_s, sequence.load_s) = (30.0, 0.4, 0.4);
        edit(&mut profile);
        let path = self.directory.path().join(format!("quick-{name}"));
        std::fs::write(&path, profile.to_toml()).expect("a file");
        path
    }

    /// The servo as any other master sees it.
    pub fn servo(&self) -> Servo {
        let profile = Profile::load(&self.port("profile.toml")).expect("its own profile").servo;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        let address =
            Address { device: DeviceKind::Servo, port: profile.port, baud: profile.baud, format: profile.format };
        let link = runtime.block_on(address.open()).expect("the port opens again");
        let timing =
            BusTiming { silence: Duration::from_millis(10), patience: Duration::from_millis(200), attempts: 3 };
        Servo { bus: Bus::new(link, address, profile.unit, timing), runtime }
    }
}

/// The servo, read by Modbus.
pub struct Servo {
    bus: Bus,
    runtime: tokio::runtime::Runtime,
}

/// What the servo says of itself.
#[derive(Debug, PartialEq)]
pub struct ServoState {
    pub motor_rpm: f64,
    pub on: bool,
    pub alarm: u16,
}

impl Servo {
    pub fn state(&mut self) -> ServoState {
        let Self { bus, runtime } = self;
        runtime.block_on(async {
            // The alarm first: asking feeds the watchdog, so that it shows what was before.
            let alarm = bus.get(&ALARM).await.expect("its alarm") as u16;
            let motor_rpm = bus.get(&STATUS_MONITOR).await.expect("its speed") * monitor::SPEED_STEP_RPM;
            let outputs = Outputs(bus.get(&OUTPUTS).await.expect("its outputs") as u16);
            ServoState { motor_rpm, on: outputs.has(Outputs::SERVO_ON), alarm }
        })
    }
}

/// `rigd run` as a process of its own, its output in files.
pub struct Run {
    pub process: Process,
    pub out: PathBuf,
    home: TempDir,
}

/// How a run ended.
#[derive(Debug)]
pub struct Ended {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
    pub seconds: f64,
}

impl Run {
    /// 10 N·m at 30 rpm unless `arguments` say otherwise.
    pub fn start(arguments: &[&str]) -> Self {
        Self::through(|home, out| {
            let mut command = rigd(home);
            command.args(["run", "--load", "10Nm", "--rpm", "30", "--json", "--out"]).arg(out).args(arguments);
            command
        })
    }

    pub fn with_profile(profile: &Path, arguments: &[&str]) -> Self {
        Self::start(&[&["--profile", profile.to_str().expect("a path")], arguments].concat())
    }

    /// By a command of its own, made from its home and its directory of logs.
    pub fn through(command: impl FnOnce(&Path, &Path) -> Command) -> Self {
        let home = TempDir::new().expect("a temporary directory");
        let out = home.path().join("runs");
        let file = |name: &str| File::create(home.path().join(name)).expect("a file");
        let mut command = command(home.path(), &out);
        let process = Process::spawn(command.stdout(file("stdout")).stderr(file("stderr")));
        Self { process, out, home }
    }

    pub fn home(&self) -> &Path {
        self.home.path()
    }

    /// The log, once it is there.
    pub fn log(&self) -> Option<PathBuf> {
        let entries = std::fs::read_dir(&self.out).ok()?;
        entries
            .flatten()
            .map(|entry| entry.path())
            .find(|path| path.extension().is_some_and(|extension| extension == "mcap"))
    }

    /// Waits for a phase in the growing log.
    pub fn await_phase(&self, wanted: impl Fn(Phase, i32) -> bool) {
        wait_for("the phase", 60.0, || self.last_state().filter(|(phase, direction)| wanted(*phase, *direction)));
    }

    /// Phase and direction of the last state in the log.
    pub fn last_state(&self) -> Option<(Phase, i32)> {
        let reader = LogReader::open(self.log()?).ok()?;
        reader
            .flatten()
            .filter_map(|record| {
                if let Record::State { state, .. } = record { Some((state.phase(), state.direction)) } else { None }
            })
            .last()
    }

    pub fn wait(&mut self, seconds: f64) -> Ended {
        let begun = Instant::now();
        let status = self.process.wait(seconds);
        let text = |name: &str| std::fs::read_to_string(self.home.path().join(name)).expect("its output");
        let ended = Ended {
            code: status.code(),
            stdout: text("stdout"),
            stderr: text("stderr"),
            seconds: begun.elapsed().as_secs_f64(),
        };
        assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
        ended
    }

    /// The log is finalised: whole by its own reader.
    pub fn assert_whole(&self) -> riglog::LogInfo {
        let info = riglog::info(self.log().expect("a log")).expect("a readable log");
        assert!(info.completeness.is_complete(), "{}", info.completeness);
        info
    }
}

/// What the public Python reader finds in logs; `None` where no Python with it was named by RIG_PYTHON.
pub fn python_counts(reader: &str, logs: &[PathBuf]) -> Option<Vec<u64>> {
    let Some(python) = std::env::var_os("RIG_PYTHON") else {
        println!("skipped: RIG_PYTHON names no Python with the package mcap, so only our own reader was asked");
        return None;
    };
    let output = Command::new(python)
        .args(["-c", include_str!("read_logs.py"), reader])
        .args(logs)
        .output()
        .expect("Python runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8_lossy(&output.stdout).lines().map(|line| line.parse().expect("a number")).collect())
}
