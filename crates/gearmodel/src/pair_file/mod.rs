//! `pair.toml`: a pair and its documented errors as a file.

mod documented;
mod found;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Deserialize;

use self::documented::RawDocumented;
use crate::effect::StatedEffect;
use crate::{CircularSpec, CurveSpec, EllipticalSpec, Errors, GearPair, GeometryError, NominalModel, ToothSpec};

/// A pair as its file states it, by kind.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PairSpec {
    /// `kind = "elliptical"`.
    Elliptical(EllipticalSpec),
    /// `kind = "circular"`.
    Circular(CircularSpec),
    /// `kind = "lobed"`, `"fourier"`, `"sampled"` or `"transmission"`.
    Free {
        /// Teeth and sizes.
        teeth: ToothSpec,
        /// The driver's pitch curve.
        curve: CurveSpec,
    },
    /// `kind = "constant"`.
    Constant {
        /// θ2 = θ1 / ratio.
        ratio: f64,
    },
}

impl PairSpec {
    /// Kind as in the file, and the teeth where the kind has them.
    fn teeth(&self) -> (&'static str, Option<ToothSpec>) {
        match self {
            Self::Elliptical(spec) => ("elliptical", Some(spec.teeth.clone())),
            Self::Circular(teeth) => ("circular", Some(teeth.clone())),
            Self::Free { teeth, curve } => (curve.kind(), Some(teeth.clone())),
            Self::Constant { .. } => ("constant", None),
        }
    }

    /// Kind as in the file.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        self.teeth().0
    }

    /// The pair, checked.
    ///
    /// # Errors
    /// [`GeometryError`] as from the constructors of [`GearPair`].
    pub fn build(&self) -> Result<GearPair, GeometryError> {
        match self {
            Self::Elliptical(spec) => GearPair::elliptical(spec),
            Self::Circular(spec) => GearPair::circular(spec),
            Self::Free { teeth, curve } => GearPair::free(teeth, curve),
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
    /// `[documented.<effect>]`: effects of the diagnosis' library that it contains too, by name; several of one effect
    /// (`[[documented.<effect>]]`) add up.
    pub effects: BTreeMap<String, Vec<StatedEffect>>,
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
    lobes: Option<[u32; 2]>,
    cosines: Option<Vec<f64>>,
    sines: Option<Vec<f64>>,
    theta1_rad: Option<Vec<f64>>,
    radius: Option<Vec<f64>>,
    #[serde(default)]
    documented: RawDocumented,
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

/// Kinds of pairs, whether they have teeth, and the keys that each has beside those of the teeth.
const KINDS: [(&str, bool, &[&str]); 7] = [
    ("elliptical", true, &["eccentricity"]),
    ("circular", true, &[]),
    ("lobed", true, &["eccentricity", "lobes"]),
    ("fourier", true, &["cosines", "sines"]),
    ("sampled", true, &["theta1_rad", "radius"]),
    ("transmission", true, &["cosines", "sines"]),
    ("constant", false, &["ratio"]),
];

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
        let gears = if has_teeth {
            raw.with_teeth(kind)?
        } else {
            PairSpec::Constant { ratio: need(kind, "ratio", raw.ratio)? }
        };
        Ok(Self { gears, documented: raw.documented.errors, effects: raw.documented.effects })
    }

    /// The nominal model, checked.
    ///
    /// # Errors
    /// [`GeometryError`] when the pair cannot be made or an error is out of range.
    pub fn model(&self) -> Result<NominalModel, GeometryError> {
        NominalModel::with_effects(self.gears.build()?, self.documented, &self.effects)
    }

    /// The text of a `pair.toml` that [`PairFile::parse`] reads back to the same value.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        let mut line = |key: &str, value: &dyn std::fmt::Debug| {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{key} = {value:?}");
        };
        let (kind, teeth) = self.gears.teeth();
        line("kind", &kind);
        match &self.gears {
            PairSpec::Constant { ratio } => line("ratio", ratio),
            PairSpec::Elliptical(spec) => line("eccentricity", &spec.eccentricity),
            PairSpec::Circular(_) => {}
            PairSpec::Free { curve, .. } => match curve {
                CurveSpec::Lobed { eccentricity, lobes } => {
                    line("eccentricity", eccentricity);
                    line("lobes", &[lobes.0, lobes.1]);
                }
                CurveSpec::Fourier { cosines, sines } | CurveSpec::Transmission { cosines, sines } => {
                    line("cosines", cosines);
                    line("sines", sines);
                }
                CurveSpec::Sampled { theta1_rad, radius } => {
                    line("theta1_rad", theta1_rad);
                    line("radius", radius);
                }
            },
        }
        if let Some(teeth) = teeth {
            line("module_mm", &teeth.module_mm);
            line("teeth", &[teeth.teeth.0, teeth.teeth.1]);
            line("pressure_angle_deg", &teeth.pressure_angle_deg);
            line("face_width_mm", &teeth.face_width_mm);
            line("addendum", &teeth.addendum);
            line("dedendum_clearance", &teeth.dedendum_clearance);
            line("backlash_mm", &teeth.backlash_mm);
            if let Some(centre_distance_mm) = teeth.centre_distance_mm {
                line("centre_distance_mm", &centre_distance_mm);
            }
        }
        documented::write(&mut text, self.documented, &self.effects);
        text
    }
}

/// A key that must be there.
fn need<T>(kind: &'static str, key: &'static str, value: Option<T>) -> Result<T, PairFileError> {
    value.ok_or(PairFileError::MissingKey { key, kind })
}

impl RawFile {
    /// The gears of a kind that has teeth.
    fn with_teeth(&self, kind: &'static str) -> Result<PairSpec, PairFileError> {
        let [teeth1, teeth2] = need(kind, "teeth", self.teeth)?;
        let teeth = ToothSpec {
            module_mm: need(kind, "module_mm", self.module_mm)?,
            teeth: (teeth1, teeth2),
            pressure_angle_deg: self.pressure_angle_deg.unwrap_or(20.0),
            centre_distance_mm: self.centre_distance_mm,
            backlash_mm: self.backlash_mm.unwrap_or(0.0),
            face_width_mm: self.face_width_mm.unwrap_or(30.0),
            addendum: self.addendum.unwrap_or(1.0),
            dedendum_clearance: self.dedendum_clearance.unwrap_or(0.25),
        };
        let waves = || {
            // One of the two lists may be left out, but not both: that would be a circle by oversight.
            if self.cosines.is_none() && self.sines.is_none() {
                return Err(PairFileError::MissingKey { key: "cosines", kind });
            }
            Ok((self.cosines.clone().unwrap_or_default(), self.sines.clone().unwrap_or_default()))
        };
        let curve = match kind {
            "circular" => return Ok(PairSpec::Circular(teeth)),
            "lobed" => {
                let [lobes1, lobes2] = need(kind, "lobes", self.lobes)?;
                let eccentricity = need(kind, "eccentricity", self.eccentricity)?;
                CurveSpec::Lobed { eccentricity, lobes: (lobes1, lobes2) }
            }
            "fourier" => {
                let (cosines, sines) = waves()?;
                CurveSpec::Fourier { cosines, sines }
            }
            "transmission" => {
                let (cosines, sines) = waves()?;
                CurveSpec::Transmission { cosines, sines }
            }
            "sampled" => CurveSpec::Sampled {
                theta1_rad: need(kind, "theta1_rad", self.theta1_rad.clone())?,
                radius: need(kind, "radius", self.radius.clone())?,
            },
            _ => {
                let eccentricity = need(kind, "eccentricity", self.eccentricity)?;
                return Ok(PairSpec::Elliptical(EllipticalSpec { teeth, eccentricity }));
            }
        };
        Ok(PairSpec::Free { teeth, curve })
    }

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
            ("lobes", self.lobes.is_some()),
            ("cosines", self.cosines.is_some()),
            ("sines", self.sines.is_some()),
            ("theta1_rad", self.theta1_rad.is_some()),
            ("radius", self.radius.is_some()),
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
