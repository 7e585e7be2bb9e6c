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

# Speed of the main job, the replay and the codecs, as ratios to real time.
bench:
    scripts/bench

# Licences and advisories (needs cargo-deny).
deny:
    cargo deny check

# Redraws the pictures of the README.
pictures:
    scripts/pictures

# CPU of the daemon alone in real time, rig in a process of its own.
bench-cpu:
    cargo build --release -p rigd
    python3 scripts/bench_cpu.py

# Fuzzes every target for ten minutes at low priority (needs a nightly toolchain and cargo-fuzz); fuzz/run SECONDS TARGET... for less.
fuzz SECONDS="600":
    fuzz/run {{SECONDS}}
