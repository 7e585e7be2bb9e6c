//! Where a key of a TOML file stands, so that every fault names its line.

use std::collections::BTreeMap;

use toml::de::{DeTable, DeValue};

/// One fault of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Line, from 1; 0 when the fault is of the whole file.
    pub line: usize,
    /// Key with its sections; empty for the syntax.
    pub key: String,
    /// What is wrong, and what is accepted.
    pub what: String,
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.line > 0 {
            write!(f, "line {}: ", self.line)?;
        }
        match self.key.as_str() {
            "" => f.write_str(&self.what),
            key => write!(f, "{key} {}", self.what),
        }
    }
}

impl Fault {
    /// A fault that the TOML reader found.
    #[must_use]
    pub fn of(text: &str, error: &toml::de::Error) -> Self {
        let line = error.span().map_or(0, |span| line_at(text, span.start));
        Self { line, key: String::new(), what: error.message().to_owned() }
    }
}

fn line_at(text: &str, offset: usize) -> usize {
    text.bytes().take(offset).filter(|byte| *byte == b'\n').count() + 1
}

/// The lines of a file's keys.
#[derive(Debug, Default)]
pub struct Lines {
    lines: BTreeMap<String, usize>,
}

impl Lines {
    /// Of a file; of one that is no TOML there are none.
    #[must_use]
    pub fn of(text: &str) -> Self {
        let mut lines = Self::default();
        if let Ok(table) = DeTable::parse(text) {
            lines.walk(text, "", table.get_ref());
        }
        lines
    }

    fn walk(&mut self, text: &str, prefix: &str, table: &DeTable<'_>) {
        for (key, value) in table {
            let path =
                if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
            self.lines.entry(path.clone()).or_insert_with(|| line_at(text, key.span().start));
            self.walk_value(text, &path, value.get_ref());
        }
    }

    fn walk_value(&mut self, text: &str, path: &str, value: &DeValue<'_>) {
        match value {
            DeValue::Table(inner) => self.walk(text, path, inner),
            DeValue::Array(items) => {
                for item in items.iter() {
                    self.walk_value(text, path, item.get_ref());
                }
            }
            _ => {}
        }
    }

    /// Every key of the file with its line, sections included.
    pub fn keys(&self) -> impl Iterator<Item = (&str, usize)> {
        self.lines.iter().map(|(key, line)| (key.as_str(), *line))
    }

    /// The line of a key, or of the nearest section that there is.
    #[must_use]
    pub fn line(&self, key: &str) -> usize {
        let mut path = key;
        loop {
            if let Some(line) = self.lines.get(path) {
                return *line;
            }
            match path.rsplit_once('.') {
                Some((section, _)) => path = section,
                None => return 0,
            }
        }
    }

    /// A fault of a key.
    #[must_use]
    pub fn fault(&self, path: &[&str], what: impl Into<String>) -> Fault {
        let key = path.join(".");
        Fault { line: self.line(&key), key, what: what.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "name = \"x\"\n\n[servo]\nport = \"sim\"\nrising = [\n  [0, 1],\n]\n[limits]\nspeed_rpm = 3\n";

    #[test]
    fn keys_have_lines_and_missing_ones_their_section() {
        let lines = Lines::of(TEXT);
        assert_eq!((lines.line("name"), lines.line("servo.port"), lines.line("limits.speed_rpm")), (1, 4, 9));
        assert_eq!((lines.line("servo.baud"), lines.line("brake.port")), (3, 0));
        let said = lines.fault(&["limits", "speed_rpm"], "= 3 is slow").to_string();
        assert_eq!(said, "line 9: limits.speed_rpm = 3 is slow");
    }

    #[test]
    fn what_is_no_toml_has_no_lines_and_a_fault_with_one() {
        let text = "a = 1\nb = [\n";
        assert_eq!(Lines::of(text).line("a"), 0);
        let error = toml::from_str::<toml::Table>(text).expect_err("cut");
        assert!(Fault::of(text, &error).line >= 2);
    }
}
