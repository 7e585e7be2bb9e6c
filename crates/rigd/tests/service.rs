//! The service as a viewer, as someone with the token, and as someone who means harm meets it.

mod support;

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nix::unistd::Pid;
use serde_json::Value;
use support::{Sim, lives, rigd, wait_for};
use tempfile::TempDir;

const TOKEN: &str = "correct-horse-battery-staple";
const GUESS: &str = "wrong-horse-battery-staple-9";

struct Service {
    process: Child,
    address: SocketAddr,
    home: TempDir,
    stderr: PathBuf,
}

impl Service {
    fn start(arguments: &[&str]) -> Self {
        Self::started(arguments, TempDir::new().expect("a temporary directory"))
    }

    fn started(arguments: &[&str], home: TempDir) -> Self {
        let stderr = home.path().join("stderr");
        let mut process = rigd(home.path())
            .arg("serve")
            .args(arguments.iter().map(|word| word.replace('@', &home.path().display().to_string())))
            .args(["--listen", "127.0.0.1:0"])
            .env("RUST_LOG", "trace")
            .stdout(Stdio::piped())
            .stderr(std::fs::File::create(&stderr).expect("a file"))
            .spawn()
            .expect("it starts");
        let mut line = String::new();
        BufReader::new(process.stdout.take().expect("its output")).read_line(&mut line).expect("a line");
        let address =
            line.split("://").nth(1).and_then(|rest| rest.split('/').next()).and_then(|address| address.parse().ok());
        Self { process, address: address.unwrap_or_else(|| panic!("no address in {line:?}")), home, stderr }
    }

    fn send(&self, bytes: &[u8]) -> String {
        let mut stream = TcpStream::connect(self.address).expect("a connection");
        stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a timeout");
        // A service that has heard enough may close before all is sent.
        let _ = stream.write_all(bytes);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn ask(&self, method: &str, path: &str, token: Option<&str>, body: &str) -> (u16, String) {
        let authorization = token.map_or(String::new(), |token| format!("Authorization: Bearer {token}\r\n"));
        let length = body.len();
        let answer = self.send(
            format!("{method} {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{authorization}Content-Length: {length}\r\n\r\n{body}")
                .as_bytes(),
        );
        let status = answer.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or(0);
        (status, answer.split_once("\r\n\r\n").map(|(_, body)| body.to_owned()).unwrap_or_default())
    }

    fn get(&self, path: &str) -> Value {
        let (status, body) = self.ask("GET", path, None, "");
        assert_eq!(status, 200, "{path}: {body}");
        serde_json::from_str(&body).unwrap_or_else(|error| panic!("{path}: {error}: {body}"))
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn with_token() -> TempDir {
    let home = TempDir::new().expect("a temporary directory");
    let path = home.path().join("token");
    std::fs::write(&path, TOKEN).expect("a file");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).expect("its mode");
    home
}

#[test]
fn a_viewer_sees_the_run_while_it_is_recorded_and_the_run_notices_nothing() {
    let sim = Sim::start(4);
    let profile = sim.profile(|profile| profile.log.rotate_mb = 0.05);
    let service = Service::start(&["--out", "@/runs"]);
    assert_eq!(service.get("/api/status")["log"], Value::Null);
    let mut run = rigd(service.home.path())
        .args(
            "run --load 5Nm --rpm 30 --revs 2 --direction both --rate 5kHz --json --operator viewed --profile"
                .split(' '),
        )
        .arg(&profile)
        .arg("--out")
        .arg(service.home.path().join("runs"))
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let recording = wait_for("a recorded sample on the page", 60.0, || {
        let status = service.get("/api/status");
        (status["state"]["phase"] == "RECORD" && !status["te"].is_null()).then_some(status)
    });
    assert_eq!((&recording["ended"], &recording["run"]["operator"]), (&Value::from(false), &Value::from("viewed")));
    assert_eq!(recording["state"]["samples_lost"], 0);
    // How old what is shown is: of the newest state, less than half a second.
    let age = recording["age_s"].as_f64().expect("an age");
    assert!(age < 0.5, "{age} s");
    let (mut next, mut points) = (0, 0);
    while run.try_wait().expect("a child").is_none() {
        let te = service.get(&format!("/api/te?since={next}"));
        points += te["points"].as_array().expect("points").len();
        next = te["next"].as_u64().expect("a number");
        std::thread::sleep(Duration::from_millis(100));
    }
    let output = run.wait_with_output().expect("it ended");
    assert_eq!(output.status.code(), Some(0));
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(told["losses"], 0);
    let ended = wait_for("the end on the page", 10.0, || {
        Some(service.get("/api/status")).filter(|status| status["ended"] == true)
    });
    assert!(ended["samples"].as_u64().expect("a count") > 20_000, "{ended}");
    points += service.get(&format!("/api/te?since={next}"))["points"].as_array().expect("points").len();
    // Two senses of two revolutions of 720 bins, each once.
    assert_eq!(points, 4 * 720, "points on the page");
}

#[test]
fn a_stop_needs_the_token_and_stops_in_order() {
    let sim = Sim::start(5);
    let profile = sim.profile(|_| {});
    let service = Service::started(&["--out", "@/runs", "--control", "--token-file", "@/token"], with_token());
    assert_eq!(service.ask("POST", "/api/stop", Some(TOKEN), "").0, 409, "nothing runs");
    let mut run = rigd(service.home.path())
        .args("run --load 5Nm --rpm 30 --revs 50 --direction ccw --rate 1kHz --json --profile".split(' '))
        .arg(&profile)
        .arg("--out")
        .arg(service.home.path().join("runs"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("it starts");
    wait_for("the recording", 60.0, || (service.get("/api/status")["state"]["phase"] == "RECORD").then_some(()));
    assert_eq!(service.ask("POST", "/api/stop", None, "").0, 401);
    assert_eq!(service.ask("POST", "/api/stop", Some(GUESS), "").0, 401);
    assert!(run.try_wait().expect("a child").is_none(), "it runs on");
    let (status, body) = service.ask("POST", "/api/stop", Some(TOKEN), "");
    assert_eq!(status, 200, "{body}");
    let code = wait_for("the end of the run", 30.0, || run.try_wait().expect("a child")).code();
    assert_eq!(code, Some(4), "stopped by the operator, log finalised");
    assert!(!sim.servo().state().on);
    wait_for("the end on the page", 10.0, || (service.get("/api/status")["ended"] == true).then_some(()));
}

#[test]
fn a_plan_is_started_paused_and_taken_up_again_by_whoever_has_the_token() {
    let sim = Sim::start(6);
    let home = with_token();
    std::fs::create_dir(home.path().join("plans")).expect("a directory");
    let plan = "rate_hz = 2000.0\n[[runs]]\ndirection = \"cw\"\nload_nm = 5.0\nspeed_rpm = 30.0\nrevolutions = 4\n";
    std::fs::write(home.path().join("plans/night.toml"), plan).expect("a file");
    let profile = sim.profile(|_| {}).display().to_string();
    let arguments = "--out @/runs --control --token-file @/token --plans @/plans --profile";
    let arguments: Vec<&str> = arguments.split(' ').chain([profile.as_str()]).collect();
    let service = Service::started(&arguments, home);
    let post = |path: &str, token: Option<&str>, body: &str| {
        let (status, body) = service.ask("POST", path, token, body);
        (status, serde_json::from_str::<Value>(&body).unwrap_or_default())
    };
    let start = r#"{"plan": "night.toml"}"#;
    assert_eq!(service.get("/api/plans").to_string().matches("night.toml").count(), 1);
    assert_eq!(post("/api/pause", Some(TOKEN), "").0, 409, "nothing runs");
    assert_eq!(post("/api/start", None, start).0, 401);
    assert!(!sim.shafts().iter().any(|shaft| shaft.servo_on), "nothing was started without the token");
    let (status, told) = post("/api/start", Some(TOKEN), start);
    assert_eq!((status, &told["started"]), (200, &"night.toml".into()), "{told}");
    assert!(lives(Pid::from_raw(told["pid"].as_i64().expect("a number") as i32)));
    assert_eq!(post("/api/start", Some(TOKEN), start).0, 409, "one at a time");

    let phase = |wanted: &str| {
        let status = service.get("/api/status");
        (status["state"]["phase"] == wanted).then_some(status)
    };
    wait_for("the recording", 60.0, || phase("RECORD"));
    assert_eq!(post("/api/pause", None, "").0, 401);
    let (status, told) = post("/api/pause", Some(TOKEN), "");
    assert_eq!((status, &told["pausing"]), (200, &1.into()), "{told}");
    let journal = service.home.path().join("runs/night/journal.jsonl");
    let paused =
        || std::fs::read_to_string(&journal).is_ok_and(|text| text.contains("paused at the end of a revolution"));
    wait_for("the pause", 10.0, || paused().then_some(()));
    std::thread::sleep(Duration::from_millis(1500));
    assert!(sim.shafts().iter().rev().take(100).all(|shaft| !shaft.turns() && !shaft.servo_on), "at rest and off");
    assert_eq!(service.get("/api/status")["plan"]["exit_code"], Value::Null, "it waits");
    assert_eq!(post("/api/pause", Some(TOKEN), "").0, 200, "and goes on");
    let ended = wait_for("the end of the plan", 60.0, || {
        Some(service.get("/api/status")["plan"].clone()).filter(|plan| !plan["exit_code"].is_null())
    });
    assert_eq!((&ended["plan"], &ended["exit_code"]), (&"night.toml".into(), &0.into()));
    let done = std::fs::read_to_string(&journal).expect("its journal");
    assert_eq!(done.matches("\"what\":\"finished\"").count(), 1, "{done}");
}

#[test]
fn no_secret_reaches_a_log_however_much_is_logged() {
    let service = Service::started(&["--out", "@/runs", "--control", "--token-file", "@/token"], with_token());
    assert_eq!(service.ask("POST", "/api/stop", Some(TOKEN), "").0, 409);
    assert_eq!(service.ask("POST", "/api/stop", Some(GUESS), "").0, 401);
    assert_eq!(service.ask("GET", "/api/status", Some(TOKEN), "").0, 200);
    assert_eq!(service.ask("POST", "/api/start", Some(TOKEN), &format!("{{\"plan\": \"{TOKEN}\"}}")).0, 409);
    let (_, page) = service.ask("GET", "/", Some(TOKEN), "");
    let (_, status) = service.ask("GET", "/api/status", Some(TOKEN), "");
    let said = std::fs::read_to_string(&service.stderr).expect("its log");
    assert!(said.contains("/api/stop") && said.contains("wrong token"), "the log says what was asked: {said}");
    for (place, text) in [("log", &said), ("page", &page), ("status", &status)] {
        assert!(!text.contains(TOKEN) && !text.contains(GUESS), "a token in the {place}: {text}");
    }
    let command = std::fs::read(format!("/proc/{}/cmdline", service.process.id())).expect("its command line");
    assert!(!String::from_utf8_lossy(&command).contains(TOKEN));
}

#[test]
fn requests_that_are_too_large_too_slow_or_no_requests_cost_nothing() {
    let service = Service::started(&["--out", "@/runs", "--control", "--token-file", "@/token"], with_token());
    let head = format!("GET / HTTP/1.1\r\nHost: localhost\r\nX: {}\r\n\r\n", "x".repeat(1 << 20));
    let answer = service.send(head.as_bytes());
    assert!(answer.is_empty() || answer.contains(" 431 ") || answer.contains(" 400 "), "{answer}");
    let (status, _) =
        service.ask("POST", "/api/start", Some(TOKEN), &format!("{{\"plan\": \"{}\"}}", "x".repeat(1 << 16)));
    assert_eq!(status, 413);
    for junk in [
        &b"\x16\x03\x01\x02\x00\x01\x00"[..],
        b"GET\r\n\r\n",
        b"\0\0\0\0\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"POST /api/stop HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n",
    ] {
        let answer = service.send(junk);
        assert!(!answer.starts_with("HTTP/1.1 200"), "{answer}");
    }
    // Whoever sends a byte now and then is hung up on, and others are served meanwhile.
    let begun = Instant::now();
    let mut slow: Vec<TcpStream> =
        (0..40).map(|_| TcpStream::connect(service.address).expect("a connection")).collect();
    for stream in &mut slow {
        stream.write_all(b"GET / HT").expect("sent");
    }
    assert_eq!(service.ask("GET", "/api/status", None, "").0, 200);
    for stream in &mut slow {
        stream.set_read_timeout(Some(Duration::from_secs(15))).expect("a timeout");
        let mut rest = Vec::new();
        let _ = stream.read_to_end(&mut rest);
    }
    assert!(begun.elapsed() < Duration::from_secs(12), "hung up on after {:?}", begun.elapsed());
    assert_eq!(service.ask("GET", "/api/status", None, "").0, 200);
}

#[test]
fn other_machines_are_refused_without_token_and_tls() {
    let home = with_token();
    for (extra, needles) in [
        (vec![], vec!["--tls-cert", "--token-file", "ssh -N -L"]),
        (vec!["--token-file", "@/token"], vec!["--tls-cert"]),
        (vec!["--control"], vec!["--tls-cert", "--token-file"]),
    ] {
        let output = rigd(home.path())
            .args(["serve", "--listen", "0.0.0.0:0"])
            .args(extra.iter().map(|word| word.replace('@', &home.path().display().to_string())))
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(needles.iter().all(|needle| said.contains(needle)), "{said}");
        assert!(output.stdout.is_empty(), "nothing listened");
    }
}

/// A certificate for localhost, where OpenSSL is there to make one.
fn certificate(home: &Path) -> Option<(PathBuf, PathBuf)> {
    let (certificate, key) = (home.join("cert.pem"), home.join("key.pem"));
    let made = Command::new("openssl")
        .args("req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=localhost -addext subjectAltName=DNS:localhost,IP:127.0.0.1 -keyout".split(' '))
        .arg(&key)
        .arg("-out")
        .arg(&certificate)
        .stderr(Stdio::null())
        .status();
    made.is_ok_and(|status| status.success()).then_some((certificate, key))
}

#[test]
fn over_tls_the_token_is_asked_for_and_plain_text_gets_nothing() {
    let home = with_token();
    let Some((certificate, key)) = certificate(home.path()) else {
        println!("skipped: no openssl to make a certificate");
        return;
    };
    let arguments = [
        "--out",
        "@/runs",
        "--token-file",
        "@/token",
        "--tls-cert",
        certificate.to_str().expect("a path"),
        "--tls-key",
        key.to_str().expect("a path"),
    ];
    let service = Service::started(&arguments, home);
    let plain = service.send(b"GET /api/status HTTP/1.1\r\nHost: localhost\r\n\r\n");
    assert!(!plain.contains("rigd.status"), "{plain}");
    // Another client altogether, which checks the certificate.
    let ask = |request: &str, tls: &str| {
        let mut client = Command::new("openssl")
            .args(["s_client", "-quiet", "-verify_return_error", "-verify_hostname", "localhost", tls, "-CAfile"])
            .arg(&certificate)
            .arg("-connect")
            .arg(service.address.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("openssl");
        let mut input = client.stdin.take().expect("its input");
        let _ = input.write_all(request.as_bytes());
        let mut answer = String::new();
        let _ = client.stdout.take().expect("its output").read_to_string(&mut answer);
        drop(input);
        let _ = client.wait();
        answer
    };
    let request = format!(
        "GET /api/status HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nAuthorization: Bearer {TOKEN}\r\n\r\n"
    );
    let answer = ask(&request, "-tls1_3");
    assert!(answer.starts_with("HTTP/1.1 200") && answer.contains("rigd.status/1"), "{answer}");
    let old = ask(&request, "-tls1_2");
    assert!(!old.contains("rigd.status"), "TLS 1.2 is not spoken: {old}");
}
