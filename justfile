# Recipes for daily work; the README's two commands need no `just`.

# The main job on the simulated rig.
run *ARGS:
    cargo run --release -p rigd -- run --load 10Nm --rpm 5 {{ARGS}}

# All tests, with their set-up.
test:
    ./test

# Style and lints as CI has them.
lint:
    cargo fmt --all --check
    cargo clippy --release --workspace --all-targets -- -D warnings
    scripts/wrap_docs.py --check
    scripts/structure.py --check

# What the crates may use of each other, circles of files, long functions; brings the figures of ARCHITECTURE.md up to date.
structure:
    scripts/structure.py
    scripts/structure.py --write

# Compiles the log's message definitions anew, after a change of crates/riglog/proto.
proto:
    cargo run --package riglog --features compile-proto --example compile_proto

# Makes the sample outputs in the documents anew, of the release build (what is a sample, scripts/samples.py says).
samples:
    .venv/bin/python scripts/samples.py

# Wraps the documents at 120 columns.
wrap:
    scripts/wrap_docs.py

# Speed of the main job, the replay and the codecs, as ratios to real time.
bench:
    scripts/bench

# Licences and advisories (needs cargo-deny).
deny:
    cargo deny check

# Redraws the pictures of the README.
pictures:
    scripts/pictures

# Time and memory of a diagnosis from arrays and from logs (after ./test, which makes .venv and the release build).
bench-diagnose:
    .venv/bin/python scripts/bench_diagnose.py

# CPU of the daemon alone in real time, rig in a process of its own.
bench-cpu:
    cargo build --release -p rigd
    python3 scripts/bench_cpu.py

# A million Modbus transactions a device with faults in simulated time; no value may be silently wrong.
modbus-faults TRANSACTIONS="1000000":
    cargo build --release -p rigbench --example modbus_faults
    for device in servo brake table; do target/release/examples/modbus_faults --device $device --transactions {{TRANSACTIONS}} || exit 1; done

# The same over pseudo-terminals in real time, and against pymodbus's server (a quarter of an hour).
modbus-faults-pty TRANSACTIONS="10000":
    cargo build --release -p rigbench --example modbus_faults
    for device in servo brake; do target/release/examples/modbus_faults --device $device --over pty --transactions {{TRANSACTIONS}} || exit 1; done
    target/release/examples/modbus_faults --device pymodbus --transactions {{TRANSACTIONS}}

# Fuzzes every target for ten minutes at low priority (needs a nightly toolchain and cargo-fuzz); fuzz/run SECONDS TARGET... for less.
fuzz SECONDS="600":
    fuzz/run {{SECONDS}}

# SIGKILL at 200 random instants of a run: at most 250 ms lost each time, every log opens, every next run goes on.
kill-200:
    cargo test --release --workspace --test kill -- --ignored --nocapture

# Eight simulated hours of a campaign with random faults: no leak, no loss unmarked, every run finished. HOURS and SEED may be given.
soak HOURS="8" SEED="1":
    RIG_HOURS={{HOURS}} RIG_SEED={{SEED}} cargo test --release --workspace --test soak -- --ignored --nocapture
