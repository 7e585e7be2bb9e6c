//! What a diagnosis found, written into a pair file: its errors and its effects under `[documented]`.

use super::PairFile;
use crate::effect::predict::Found;
use crate::effect::{Term, by_name};
use crate::{Errors, GeometryError};

impl PairFile {
    /// The same file with these errors in place of its own; effects that are changes of an error go with them, others stay.
    #[must_use]
    pub fn with_errors(&self, errors: Errors) -> Self {
        let mut effects = self.effects.clone();
        effects.retain(|name, _| by_name(name).is_none_or(|effect| effect.folds_into().is_none()));
        Self { gears: self.gears.clone(), documented: errors, effects }
    }

    /// The same file with the found effects under `[documented]`, and what could not be written down, a line each. What is a
    /// change of a documented error is added to that; what adds to a documented effect, to its table.
    ///
    /// # Errors
    /// [`GeometryError`] when the sum is no model: a compliance below zero, or a table that is there already makes no sense.
    pub fn with_found(&self, found: &Found) -> Result<(Self, Vec<String>), GeometryError> {
        let mut file = self.clone();
        let mut left_out = Vec::new();
        let Some(rig) = &found.rig else { return Ok((file, left_out)) };
        for effect in &found.effects {
            let name = effect.effect.name();
            if effect.effect.steps() {
                left_out.push(format!(
                    "{name}: counts were lost; when that happens again cannot be foreseen: see to the wiring"
                ));
                continue;
            }
            let term = Term { effect: effect.effect, shape: effect.shape.clone(), beta: effect.estimate.beta.clone() };
            if term.fold_into(&mut file.documented) {
                continue;
            }
            let tables = file.effects.entry(name.to_owned()).or_default();
            let mut added = false;
            for table in tables.iter_mut() {
                let mut before = Term::from_stated(rig, name, table)?;
                if before.add(rig, &term) {
                    *table = before.stated(rig);
                    added = true;
                    break;
                }
            }
            if !added {
                tables.push(term.stated(rig));
            }
        }
        // Compliances that a fit took a little too far the other way.
        file.model()?;
        Ok((file, left_out))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::effect::predict::FoundEffect;
    use crate::effect::{Estimate, Stated};

    const PAIR: &str = "kind = \"elliptical\"\nmodule_mm = 3.0\nteeth = [47, 47]\neccentricity = 0.3287\n";

    #[test]
    fn found_effects_are_added_to_what_is_documented() {
        let file = PairFile::parse(&format!("{PAIR}[documented.time_skew]\ndt_s = 1e-5\n")).unwrap();
        let rig = file.model().unwrap().rig([None, None], None);
        let found = |name: &str, shape: Vec<f64>, beta: Vec<f64>| {
            let covariance = DMatrix::zeros(beta.len(), beta.len());
            FoundEffect { effect: by_name(name).unwrap(), shape, estimate: Estimate { beta, covariance } }
        };
        let effects = vec![
            found("time_skew", vec![], vec![2e-5]),
            found("gear2_eccentricity", vec![], vec![0.02, 0.0]),
            found("tooth_damage", vec![5.0, 1.0, 0.5], vec![0.01]),
            found("count_loss", vec![1.0, 2.0], vec![1e-6]),
        ];
        let (model, left_out) = file.with_found(&Found { rig: Some(rig), effects }).unwrap();
        assert_eq!(model.documented.e2_mm, 0.02);
        let Stated::Number(dt_s) = model.effects["time_skew"][0]["dt_s"] else { panic!("a number") };
        assert!((dt_s - 3e-5).abs() < 1e-18 && model.effects["time_skew"].len() == 1);
        assert_eq!(model.effects["tooth_damage"][0]["flank"], Stated::Text("ccw".to_owned()));
        assert!(left_out.len() == 1 && left_out[0].contains("count_loss"));
        assert_eq!(PairFile::parse(&model.to_toml()).unwrap(), model);
    }
}
