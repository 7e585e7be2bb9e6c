//! Which pair: a `pair.toml`, and values that are set in its place.

use std::path::{Path, PathBuf};

use gearmodel::{NominalModel, PairFile};
use serde_json::{Value, json};
use thiserror::Error;
use toml::Table;

use riglog::pair::{self, PairError};

/// Which pair.
#[derive(Debug, Clone, clap::Args)]
pub struct Source {
    /// The gear pair [default: the built-in pair]
    #[arg(value_name = "PAIR")]
    pub pair: Option<PathBuf>,
    /// Set a key of the file to another value, as `eccentricity=0.4` or `e1_mm=0.02`; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = assignment)]
    set: Vec<(String, toml::Value)>,
}

/// A pair as it was read.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// Where it came from, for headings and errors.
    pub name: String,
    /// The model.
    pub model: NominalModel,
    /// What is in force, as its file says it.
    pub file: PairFile,
}

/// Why a value cannot be set.
#[derive(Debug, Error)]
pub enum SourceError {
    /// The pair itself.
    #[error(transparent)]
    Pair(#[from] PairError),
    /// What is set makes no pair.
    #[error("with --set {settings}: {source}")]
    Set {
        /// What was set.
        settings: String,
        /// What is wrong with it.
        source: PairError,
    },
}

fn assignment(text: &str) -> Result<(String, toml::Value), String> {
    let form = "write KEY=VALUE with a key of pair.toml, for instance eccentricity=0.4";
    let (key, value) = text.split_once('=').ok_or_else(|| format!("'{text}' sets nothing; {form}"))?;
    let (key, value) = (key.trim(), value.trim());
    if key.is_empty() || value.is_empty() {
        return Err(format!("'{text}' sets nothing; {form}"));
    }
    let parsed = format!("value = {value}")
        .parse::<Table>()
        .ok()
        .and_then(|mut table| table.remove("value"))
        .unwrap_or_else(|| toml::Value::String(value.to_owned()));
    Ok((key.to_owned(), parsed))
}

/// Keys that stand under `[documented]`: those of [`gearmodel::Errors`].
fn is_documented(key: &str) -> bool {
    let errors = serde_json::to_value(gearmodel::Errors::default()).unwrap_or_default();
    errors.get(key).is_some()
}

/// Sets `key`, at the top or under `[documented]`, whichever it belongs to.
pub fn assign(table: &mut Table, key: &str, value: toml::Value) {
    if is_documented(key) {
        let documented = table.entry("documented").or_insert_with(|| toml::Value::Table(Table::new()));
        if let toml::Value::Table(documented) = documented {
            documented.insert(key.to_owned(), value);
        }
    } else {
        // A centre distance belongs to the curve that it was drawn for.
        if key != "centre_distance_mm" && decides_size(key) {
            table.remove("centre_distance_mm");
        }
        table.insert(key.to_owned(), value);
    }
}

fn decides_size(key: &str) -> bool {
    ["kind", "module_mm", "teeth", "eccentricity", "lobes", "cosines", "sines"].contains(&key)
}

impl Source {
    /// Reads the pair.
    ///
    /// # Errors
    /// [`SourceError`] names the file or the setting, the key and the limit.
    pub fn load(&self) -> Result<Loaded, SourceError> {
        let (mut text, mut model) = pair::load(self.pair.as_deref())?;
        let mut name =
            self.pair.as_ref().map_or_else(|| "the built-in pair".to_owned(), |path| path.display().to_string());
        let path = self.pair.as_deref().unwrap_or(Path::new("(built in)"));
        if !self.set.is_empty() {
            // The text was a pair, so it is TOML.
            let mut table: Table = text.parse().unwrap_or_default();
            for (key, value) in &self.set {
                assign(&mut table, key, value.clone());
            }
            let settings: Vec<_> = self.set.iter().map(|(key, value)| format!("{key}={value}")).collect();
            let settings = settings.join(" ");
            text = table.to_string();
            name = format!("{name} with {settings}");
            model = pair::parse(&text, path).map_err(|source| SourceError::Set { settings, source })?;
        }
        let file = PairFile::parse(&text).map_err(|source| PairError::Text { path: path.into(), source })?;
        Ok(Loaded { name, model, file })
    }
}

impl Loaded {
    /// The pair in a line.
    #[must_use]
    pub fn heading(&self) -> String {
        let pair = &self.model.pair;
        if !pair.has_teeth() {
            return format!("{}: constant ratio, θ2 = {:.6} θ1", self.name, pair.closure());
        }
        let (z1, z2) = pair.teeth();
        format!(
            "{}: {}, m = {} mm, {z1}/{z2} teeth, α = {:.4}°, a = {:.4} mm, j = {} mm",
            self.name,
            pair.kind(),
            pair.module_mm(),
            pair.pressure_angle_rad().to_degrees(),
            pair.centre_distance_mm(),
            pair.backlash_mm()
        )
    }

    /// The pair for scripts.
    #[must_use]
    pub fn json(&self) -> Value {
        let pair = &self.model.pair;
        let (z1, z2) = pair.teeth();
        json!({
            "kind": pair.kind(),
            "module_mm": pair.module_mm(),
            "teeth": [z1, z2],
            "pressure_angle_rad": pair.pressure_angle_rad(),
            "centre_distance_mm": pair.centre_distance_mm(),
            "backlash_mm": pair.backlash_mm(),
            "closure": pair.closure(),
            "documented": self.model.errors,
        })
    }
}
