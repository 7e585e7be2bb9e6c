//! `pair.toml`: a pair and its documented errors as a file.

use std::fmt::Write as _;

use serde::Deserialize;

use crate::{CircularSpec, EllipticalSpec, Errors, GearPair, GeometryError, NominalModel};

/// A pair as its file states it, by kind.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PairSpec {
    /// `kind = "elliptical"`.
    Elliptical(EllipticalSpec),
    /// `kind = "circular"`.
    Circular(CircularSpec),
    /// `kind = "constant"`.
    Constant {
        /// θ2 = θ1 / ratio.
        ratio: f64,
    },
}

impl PairSpec {
    /// The pair, checked.
    ///
    /// # Errors
    /// [`GeometryError`] as from the constructors of [`GearPair`].
    pub fn build(&self) -> Result<GearPair, GeometryError> {
        match self {
            Self::Elliptical(spec) => GearPair::elliptical(spec),
            Self::Circular(spec) => GearPair::circular(spec),
            Self::Constant { ratio } => GearPair::constant(*ratio),
        }
    }
}

/// The content of a `pair.toml`.
#[derive(Clone, Debug, PartialEq)]
pub struct PairFile {
    /// The gears.
    pub gears: PairSpec,
    /// `[documented]`: errors that the nominal model contains.
    pub documented: Errors,
}

/// Why a `pair.toml` cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PairFileError {
    /// Not TOML, an unknown key, or a value of the wrong type.
    #[error("pair file, line {line}: {message}")]
    Syntax {
        /// Line of the file, from 1.
        line: usize,
        /// What is wrong there, with the keys that are allowed where a key is unknown.
        message: String,
    },
    /// A kind of pair that does not exist.
    #[error("pair file, line {line}: kind = \"{kind}\" is unknown: write one of {allowed}")]
    UnknownKind {
        /// Line of the file, from 1.
        line: usize,
        /// The kind given.
        kind: String,
        /// The kinds there are.
        allowed: String,
    },
    /// A key that this kind of pair does not have.
    #[error("pair file, line {line}: key `{key}` does not belong to kind = \"{kind}\": allowed are {allowed}")]
    KeyOfOtherKind {
        /// Line of the file, from 1.
        line: usize,
        /// The key.
        key: &'static str,
        /// The kind of pair.
        kind: &'static str,
        /// The keys of this kind.
        allowed: String,
    },
    /// A key without which the pair is not fixed.
    #[error("pair file: key `{key}` is missing: kind = \"{kind}\" needs it")]
    MissingKey {
        /// The key.
        key: &'static str,
        /// The kind of pair.
        kind: &'static str,
    },
    /// The numbers do not describe a pair.
    #[error("pair file: {0}")]
    Geometry(#[from] GeometryError),
}

/// Every key that any kind has: the file's own shape, before the kind decides which of them are meant.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFile {
    kind: Option<String>,
    module_mm: Option<f64>,
    teeth: Option<[u32; 2]>,
    eccentricity: Option<f64>,
    pressure_angle_deg: Option<f64>,
    face_width_mm: Option<f64>,
    addendum: Option<f64>,
    dedendum_clearance: Option<f64>,
    backlash_mm: Option<f64>,
    centre_distance_mm: Option<f64>,
    ratio: Option<f64>,
    #[serde(default)]
    documented: Errors,
}

const TOOTH_KEYS: [&str; 8] = [
    "module_mm",
    "teeth",
    "pressure_angle_deg",
    "face_width_mm",
    "addendum",
    "dedendum_clearance",
    "backlash_mm",
    "centre_distance_mm",
];

/// Kinds of pairs and the keys that each has beside `kind` and `documented`.
const KINDS: [(&str, bool, &[&str]); 3] =
    [("elliptical", true, &["eccentricity"]), ("circular", true, &[]), ("constant", false, &["ratio"])];

impl PairFile {
    /// Reads the text of a `pair.toml`.
    ///
    /// # Errors
    /// [`PairFileError`] that names the key and the line. The geometry is checked by [`PairFile::model`].
    pub fn parse(text: &str) -> Result<Self, PairFileError> {
        let raw: RawFile = toml::from_str(text).map_err(|error| PairFileError::Syntax {
            line: error.span().map_or(1, |span| line_at(text, span.start)),
            message: error.message().to_owned(),
        })?;
        let kind = raw.kind.as_deref().unwrap_or("elliptical");
        let Some(&(kind, has_teeth, own_keys)) = KINDS.iter().find(|(name, ..)| *name == kind) else {
            return Err(PairFileError::UnknownKind {
                line: line_of_key(text, "kind"),
                kind: kind.to_owned(),
                allowed: KINDS.map(|(name, ..)| format!("\"{name}\"")).join(", "),
            });
        };
        raw.refuse_keys_of_other_kinds(text, kind, has_teeth, own_keys)?;
        let need = |key: &'static str, value: Option<f64>| value.ok_or(PairFileError::MissingKey { key, kind });
        let gears = match kind {
            "constant" => PairSpec::Constant { ratio: need("ratio", raw.ratio)? },
            _ => {
                let module_mm = need("module_mm", raw.module_mm)?;
                let [teeth1, teeth2] = raw.teeth.ok_or(PairFileError::MissingKey { key: "teeth", kind })?;
                let common = CircularSpec {
                    module_mm,
                    teeth: (teeth1, teeth2),
                    pressure_angle_deg: raw.pressure_angle_deg.unwrap_or(20.0),
                    centre_distance_mm: raw.centre_distance_mm,
                    backlash_mm: raw.backlash_mm.unwrap_or(0.0),
                    face_width_mm: raw.face_width_mm.unwrap_or(30.0),
                    addendum: raw.addendum.unwrap_or(1.0),
                    dedendum_clearance: raw.dedendum_clearance.unwrap_or(0.25),
                };
                if kind == "circular" {
                    PairSpec::Circular(common)
                } else {
                    PairSpec::Elliptical(EllipticalSpec {
                        module_mm,
                        teeth: common.teeth,
                        eccentricity: need("eccentricity", raw.eccentricity)?,
                        pressure_angle_deg: common.pressure_angle_deg,
                        centre_distance_mm: common.centre_distance_mm,
                        backlash_mm: common.backlash_mm,
                        face_width_mm: common.face_width_mm,
                        addendum: common.addendum,
                        dedendum_clearance: common.dedendum_clearance,
                    })
                }
            }
        };
        Ok(Self { gears, documented: raw.documented })
    }

    /// The nominal model, checked.
    ///
    /// # Errors
    /// [`GeometryError`] when the pair cannot be made or an error is out of range.
    pub fn model(&self) -> Result<NominalModel, GeometryError> {
        NominalModel::new(self.gears.build()?, self.documented)
    }

    /// The text of a `pair.toml` that [`PairFile::parse`] reads back to the same value.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        let mut line = |key: &str, value: &dyn std::fmt::Debug| {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{key} = {value:?}");
        };
        match &self.gears {
            PairSpec::Constant { ratio } => {
                line("kind", &"constant");
                line("ratio", ratio);
            }
            PairSpec::Elliptical(spec) => {
                line("kind", &"elliptical");
                line("module_mm", &spec.module_mm);
                line("teeth", &[spec.teeth.0, spec.teeth.1]);
                line("eccentricity", &spec.eccentricity);
                line("pressure_angle_deg", &spec.pressure_angle_deg);
                line("face_width_mm", &spec.face_width_mm);
                line("addendum", &spec.addendum);
                line("dedendum_clearance", &spec.dedendum_clearance);
                line("backlash_mm", &spec.backlash_mm);
                if let Some(centre_distance_mm) = spec.centre_distance_mm {
                    line("centre_distance_mm", &centre_distance_mm);
                }
            }
            PairSpec::Circular(spec) => {
                line("kind", &"circular");
                line("module_mm", &spec.module_mm);
                line("teeth", &[spec.teeth.0, spec.teeth.1]);
                line("pressure_angle_deg", &spec.pressure_angle_deg);
                line("face_width_mm", &spec.face_width_mm);
                line("addendum", &spec.addendum);
                line("dedendum_clearance", &spec.dedendum_clearance);
                line("backlash_mm", &spec.backlash_mm);
                if let Some(centre_distance_mm) = spec.centre_distance_mm {
                    line("centre_distance_mm", &centre_distance_mm);
                }
            }
        }
        let errors = &self.documented;
        line("\n[documented]\ne1_mm", &errors.e1_mm);
        line("phi1_rad", &errors.phi1_rad);
        line("e2_mm", &errors.e2_mm);
        line("phi2_rad", &errors.phi2_rad);
        line("shaft_compliance_output_rad_per_nm", &errors.shaft_compliance_output_rad_per_nm);
        line("shaft_compliance_input_rad_per_nm", &errors.shaft_compliance_input_rad_per_nm);
        line("mesh_compliance_mm2_rad_per_nm", &errors.mesh_compliance_mm2_rad_per_nm);
        text
    }
}

impl RawFile {
    fn refuse_keys_of_other_kinds(
        &self,
        text: &str,
        kind: &'static str,
        has_teeth: bool,
        own_keys: &'static [&'static str],
    ) -> Result<(), PairFileError> {
        let tooth_keys: &[&'static str] = if has_teeth { &TOOTH_KEYS } else { &[] };
        let given = [
            ("module_mm", self.module_mm.is_some()),
            ("teeth", self.teeth.is_some()),
            ("eccentricity", self.eccentricity.is_some()),
            ("pressure_angle_deg", self.pressure_angle_deg.is_some()),
            ("face_width_mm", self.face_width_mm.is_some()),
            ("addendum", self.addendum.is_some()),
            ("dedendum_clearance", self.dedendum_clearance.is_some()),
            ("backlash_mm", self.backlash_mm.is_some()),
            ("centre_distance_mm", self.centre_distance_mm.is_some()),
            ("ratio", self.ratio.is_some()),
        ];
        for (key, present) in given {
            if present && !own_keys.contains(&key) && !tooth_keys.contains(&key) {
                let allowed =
                    ["kind"].iter().chain(own_keys).chain(tooth_keys).map(|key| format!("`{key}`")).collect::<Vec<_>>();
                return Err(PairFileError::KeyOfOtherKind {
                    line: line_of_key(text, key),
                    key,
                    kind,
                    allowed: allowed.join(", "),
                });
            }
        }
        Ok(())
    }
}

/// Line (from 1) of a byte offset.
fn line_at(text: &str, offset: usize) -> usize {
    text.bytes().take(offset).filter(|byte| *byte == b'\n').count() + 1
}

/// Line (from 1) on which a top-level key stands.
fn line_of_key(text: &str, key: &str) -> usize {
    text.lines()
        .position(|line| line.trim_start().strip_prefix(key).is_some_and(|rest| rest.trim_start().starts_with('=')))
        .map_or(1, |index| index + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE_PAIR: &str = r#"
kind = "elliptical"            # or "circular"
module_mm = 3.0
teeth = [47, 47]
eccentricity = 0.3287
pressure_angle_deg = 20.0
centre_distance_mm = 145.0

[documented]
e1_mm = 0.05
phi1_rad = 0.3
e2_mm = 0.03
phi2_rad = 1.1
"#;

    #[test]
    fn round_trip() {
        let file = PairFile::parse(SOURCE_PAIR).unwrap();
        assert_eq!(PairFile::parse(&file.to_toml()).unwrap(), file);
        let model = file.model().unwrap();
        assert_eq!(model.errors.e2_mm, 0.03);
        assert!((model.pair.centre_distance_mm() - 144.999_717).abs() < 1e-6);
        for text in
            ["kind = \"constant\"\nratio = 81", "kind=\"circular\"\nmodule_mm=2\nteeth=[20,31]\nbacklash_mm=1e-7"]
        {
            let file = PairFile::parse(text).unwrap();
            assert_eq!(PairFile::parse(&file.to_toml()).unwrap(), file);
            file.model().unwrap();
        }
    }

    #[test]
    fn an_unknown_key_is_named_with_its_line_and_the_allowed_ones() {
        let error = PairFile::parse(&SOURCE_PAIR.replace("eccentricity", "excentricity")).unwrap_err().to_string();
        assert!(
            error.contains("line 5") && error.contains("excentricity") && error.contains("`eccentricity`"),
            "{error}"
        );
        let error = PairFile::parse(&SOURCE_PAIR.replace("e2_mm", "e3_mm")).unwrap_err().to_string();
        assert!(error.contains("line 12") && error.contains("e3_mm") && error.contains("`e2_mm`"), "{error}");
    }

    #[test]
    fn a_key_of_another_kind_is_refused() {
        let error = PairFile::parse("kind = \"constant\"\nratio = 2.0\nteeth = [3, 4]").unwrap_err().to_string();
        assert!(error.contains("line 3") && error.contains("`teeth`") && error.contains("`ratio`"), "{error}");
        let error = PairFile::parse("kind = \"square\"").unwrap_err().to_string();
        assert!(error.contains("\"square\"") && error.contains("\"elliptical\""), "{error}");
        let error = PairFile::parse("module_mm = 3").unwrap_err().to_string();
        assert!(error.contains("`teeth`"), "{error}");
    }

    #[test]
    fn numbers_that_are_no_numbers_are_refused() {
        for text in ["module_mm = \"3\"", "module_mm = ", "teeth = [47]", "teeth = [-1, 3]"] {
            assert!(matches!(PairFile::parse(text), Err(PairFileError::Syntax { line: 1, .. })), "{text}");
        }
        let text = "module_mm = nan\nteeth = [47, 47]\neccentricity = 0.1";
        let error = PairFile::parse(text).unwrap().model().unwrap_err();
        assert!(matches!(error, GeometryError::NotFinite { quantity: "module_mm", .. }));
    }
}
