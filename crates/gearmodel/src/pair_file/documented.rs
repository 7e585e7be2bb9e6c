//! `[documented]` of a pair file: seven errors as numbers, and effects of the diagnosis' library as tables.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};

use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, Visitor};

use crate::Errors;
use crate::effect::{LIBRARY, Stated, StatedEffect, by_name};

/// The table as it stands in the file.
#[derive(Default)]
pub(super) struct RawDocumented {
    pub(super) errors: Errors,
    pub(super) effects: BTreeMap<String, Vec<StatedEffect>>,
}

type Field = fn(&mut Errors) -> &mut f64;

const KEYS: [(&str, Field); 7] = [
    ("e1_mm", |errors| &mut errors.e1_mm),
    ("phi1_rad", |errors| &mut errors.phi1_rad),
    ("e2_mm", |errors| &mut errors.e2_mm),
    ("phi2_rad", |errors| &mut errors.phi2_rad),
    ("shaft_compliance_output_rad_per_nm", |errors| &mut errors.shaft_compliance_output_rad_per_nm),
    ("shaft_compliance_input_rad_per_nm", |errors| &mut errors.shaft_compliance_input_rad_per_nm),
    ("mesh_compliance_mm2_rad_per_nm", |errors| &mut errors.mesh_compliance_mm2_rad_per_nm),
];

/// A key of the table.
enum Key {
    Error(Field),
    Effect(&'static str),
}

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let key = String::deserialize(deserializer)?;
        if let Some((_, field)) = KEYS.iter().find(|(name, _)| *name == key) {
            return Ok(Self::Error(*field));
        }
        by_name(&key).map(|effect| Self::Effect(effect.name())).ok_or_else(|| {
            let names = KEYS.iter().map(|(name, _)| *name).chain(LIBRARY.iter().map(|effect| effect.name()));
            let allowed = names.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
            de::Error::custom(format!("unknown key `{key}` under [documented]: expected one of {allowed}"))
        })
    }
}

/// One table of an effect, or several.
#[derive(Deserialize)]
#[serde(untagged)]
enum Tables {
    One(StatedEffect),
    Many(Vec<StatedEffect>),
}

impl<'de> Deserialize<'de> for RawDocumented {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Table;
        impl<'de> Visitor<'de> for Table {
            type Value = RawDocumented;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table of documented errors and effects")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<RawDocumented, A::Error> {
                let mut documented = RawDocumented::default();
                while let Some(key) = map.next_key()? {
                    match key {
                        Key::Error(field) => *field(&mut documented.errors) = map.next_value()?,
                        Key::Effect(name) => {
                            let tables = match map.next_value::<Tables>() {
                                Ok(Tables::One(table)) => vec![table],
                                Ok(Tables::Many(tables)) => tables,
                                Err(_) => {
                                    return Err(de::Error::custom(format!(
                                        "documented.{name} is no table of its parameters: numbers, lists of numbers or words"
                                    )));
                                }
                            };
                            documented.effects.insert(name.to_owned(), tables);
                        }
                    }
                }
                Ok(documented)
            }
        }
        deserializer.deserialize_map(Table)
    }
}

/// Writes the table, and those of the effects.
pub(super) fn write(text: &mut String, mut errors: Errors, effects: &BTreeMap<String, Vec<StatedEffect>>) {
    // Writing to a String cannot fail.
    let _ = writeln!(text, "\n[documented]");
    for (key, field) in KEYS {
        let _ = writeln!(text, "{key} = {:?}", field(&mut errors));
    }
    for (name, tables) in effects {
        for table in tables {
            let _ = match tables.len() {
                1 => writeln!(text, "\n[documented.{name}]"),
                _ => writeln!(text, "\n[[documented.{name}]]"),
            };
            for (key, value) in table {
                let _ = match value {
                    Stated::Number(value) => writeln!(text, "{key} = {value:?}"),
                    Stated::Table(values) => writeln!(text, "{key} = {values:?}"),
                    Stated::Text(word) => writeln!(text, "{key} = {word:?}"),
                };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::effect::predict::Condition;
    use crate::effect::{Estimate, Term, Value};
    use crate::{Direction, NominalModel, PairFile};

    const PAIR: &str = "kind = \"elliptical\"\nmodule_mm = 3.0\nteeth = [47, 47]\neccentricity = 0.3287\n";

    /// A pair file with every effect of the library, with parameters of its own.
    fn every_effect() -> Vec<(&'static str, String)> {
        let teeth: Vec<f64> = (0..47).map(|n| 1e-3 * (f64::from(n) * 0.7).sin()).collect();
        LIBRARY
            .iter()
            .map(|effect| {
                let mut text = format!("[documented.{}]\n", effect.name());
                for (n, name) in effect.parameter_names().iter().enumerate() {
                    let value = match *name {
                        "ccw_mm" | "cw_mm" => format!("{teeth:?}"),
                        "times_s" => "[3.0, 5.0]".to_owned(),
                        "flank" => "\"cw\"".to_owned(),
                        "of" => "\"closure\"".to_owned(),
                        "excited_by" => "\"turn\"".to_owned(),
                        "tooth" | "n" | "order" => "3.0".to_owned(),
                        "lines" => "1000.0".to_owned(),
                        "response" => "\"carried\"".to_owned(),
                        // Counts are stated by their steps here.
                        "counts" | "steps" | "rate_rad_per_rev" => continue,
                        _ => format!("{:?}", 0.1 + 0.01 * n as f64),
                    };
                    text.push_str(&format!("{name} = {value}\n"));
                }
                (effect.name(), text)
            })
            .collect()
    }

    fn under() -> Condition {
        Condition { direction: Direction::Cw, load_nm: 7.0, speed_rpm: 12.0, time_s: 40.0, revolutions: 6.0 }
    }

    #[test]
    fn every_effect_is_read_written_and_read_back_to_the_same_trace() {
        for (name, table) in every_effect() {
            let file = PairFile::parse(&format!("{PAIR}{table}")).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(PairFile::parse(&file.to_toml()).unwrap(), file, "{name}");
            let model = file.model().unwrap_or_else(|e| panic!("{name}: {e}"));
            let plain = PairFile::parse(PAIR).unwrap().model().unwrap();
            let te = |model: &NominalModel, n: i32| model.te_under_rad(-0.0137 * f64::from(n), &under());
            assert!((0..500).any(|n| (te(&model, n) - te(&plain, n)).abs() > 1e-9), "{name} adds nothing");
            // Through amplitudes and back.
            let rig = plain.rig([None, None], None);
            let term = Term::from_stated(&rig, name, &file.effects[name][0]).unwrap();
            let again = Term::from_stated(&rig, name, &term.stated(&rig)).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!((again.shape.len(), again.beta.len()), (term.shape.len(), term.beta.len()), "{name}");
            for (a, b) in again.beta.iter().chain(&again.shape).zip(term.beta.iter().chain(&term.shape)) {
                assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{name}: {a} {b}");
            }
        }
    }

    #[test]
    fn reported_parameters_that_may_be_stated_keep_their_names() {
        let rig = PairFile::parse(PAIR).unwrap().model().unwrap().rig([None, None], None);
        for (name, table) in every_effect() {
            let file = PairFile::parse(&format!("{PAIR}{table}")).unwrap();
            let term = Term::from_stated(&rig, name, &file.effects[name][0]).unwrap();
            let n = term.beta.len();
            let estimate = Estimate { beta: term.beta.clone(), covariance: DMatrix::zeros(n, n) };
            for parameter in term.effect.parameters(&rig, &term.shape, &estimate) {
                assert!(term.effect.parameter_names().contains(&parameter.name), "{name}: {}", parameter.name);
                // What was stated is what is reported.
                if let (Some(Stated::Number(stated)), Value::Number(found)) =
                    (file.effects[name][0].get(parameter.name), &parameter.value)
                {
                    assert!((stated - found).abs() < 1e-9, "{name}: {} {stated} {found}", parameter.name);
                }
            }
        }
    }

    #[test]
    fn changes_of_documented_errors_are_added_to_them() {
        let text = format!(
            "{PAIR}[documented]\ne1_mm = 0.03\nphi1_rad = 0.0\n[documented.gear1_eccentricity]\ndx_mm = 0.0\ndy_mm = 0.04\n\
             [documented.shaft_compliance_output]\nc_rad_per_nm = 2e-6\n"
        );
        let model = PairFile::parse(&text).unwrap().model().unwrap();
        assert!(model.effects.is_empty());
        assert!((model.errors.e1_mm - 0.05).abs() < 1e-15 && (model.errors.phi1_rad - 4f64.atan2(3.0)).abs() < 1e-15);
        assert_eq!(model.errors.shaft_compliance_output_rad_per_nm, 2e-6);
    }

    #[test]
    fn what_does_not_fix_an_effect_is_refused_by_name() {
        let refused = |table: &str| {
            let file = PairFile::parse(&format!("{PAIR}{table}"));
            file.map_err(|e| e.to_string()).and_then(|f| f.model().map_err(|e| e.to_string())).unwrap_err()
        };
        let said = refused("[documented.time_skew]\ndt = 1e-5\n");
        assert!(said.contains("time_skew") && said.contains("`dt`") && said.contains("`dt_s`"), "{said}");
        let said = refused("[documented.encoder1_eccentricity]\neps = 1e-5\n");
        assert!(said.contains("needs its parameter `phase_rad`"), "{said}");
        let said = refused("[documented.time_scew]\ndt_s = 1e-5\n");
        assert!(said.contains("line 5") && said.contains("time_scew") && said.contains("`time_skew`"), "{said}");
        let said = refused("[documented.pitch_errors]\nccw_mm = [0.1]\ncw_mm = [0.1]\n");
        assert!(said.contains("a list of 47"), "{said}");
        let said = refused("[documented]\ntime_skew = 1e-5\n");
        assert!(said.contains("time_skew is no table"), "{said}");
        let said = refused("[documented.slip]\nk_rad_per_rev_nm = 1e-6\nt0_nm = -1\n");
        assert!(said.contains("`t0_nm` = -1 is outside 0"), "{said}");
        let constant =
            PairFile::parse("kind = \"constant\"\nratio = 3\n[documented.centre_distance_error]\nda_mm = 0.1\n");
        assert!(constant.unwrap().model().unwrap_err().to_string().contains("needs teeth"));
    }
}
