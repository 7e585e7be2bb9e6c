//! A directory and command lines in it, as somebody at a desk types them; `@` stands for the directory.

use std::path::PathBuf;
use std::process::Output;

use rigd::profile::Profile;
use serde_json::Value;
use tempfile::TempDir;

use super::rigd;

pub struct Desk {
    directory: TempDir,
}

impl Desk {
    pub fn new() -> Self {
        Self { directory: TempDir::new().expect("a temporary directory") }
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    pub fn run(&self, line: &str) -> Output {
        let words = line.split_whitespace().map(|word| word.replace('@', &self.directory.path().display().to_string()));
        rigd(self.directory.path()).args(words).output().expect("it runs")
    }

    /// Runs and expects an exit code and a JSON object.
    pub fn json(&self, code: i32, line: &str) -> Value {
        let output = self.run(line);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{line}: {said}");
        serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{line}: {error}: {said}"))
    }

    /// A profile of the simulated rig in this process, as `rig.toml`.
    pub fn profile(&self, edit: impl FnOnce(&mut Profile)) {
        let mut profile = Profile::simulated();
        edit(&mut profile);
        std::fs::write(self.at("rig.toml"), profile.to_toml()).expect("a file");
    }

    pub fn logs(&self, directory: &str) -> Vec<PathBuf> {
        let mut logs: Vec<_> = std::fs::read_dir(self.at(directory))
            .expect("a directory")
            .map(|entry| entry.expect("an entry").path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "mcap"))
            .collect();
        logs.sort();
        logs
    }
}
