//! `rigd`: see `rigd --help`.

use std::process::ExitCode;

fn main() -> ExitCode {
    rigd::cli::main()
}
