//! Effects that the nominal model contains beyond [`Errors`]: documented by name and parameters, or found by a diagnosis and
//! written down.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{
    Effect, Fold, Given, LIBRARY, NominalRig, OperatingPoint, Shaft, Shape, StatedEffect, StatedError, by_name,
};
use crate::{Errors, GearPair, GeometryError};

/// An effect with its shape and amplitudes.
#[derive(Clone)]
pub struct Term {
    /// The effect.
    pub effect: &'static dyn Effect,
    /// Its shape.
    pub shape: Shape,
    /// Its amplitudes.
    pub beta: Vec<f64>,
}

impl std::fmt::Debug for Term {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Term")
            .field("effect", &self.effect.name())
            .field("shape", &self.shape)
            .field("beta", &self.beta)
            .finish()
    }
}

impl PartialEq for Term {
    fn eq(&self, other: &Self) -> bool {
        self.effect.name() == other.effect.name() && self.shape == other.shape && self.beta == other.beta
    }
}

impl Term {
    /// An effect from its stated parameters.
    ///
    /// # Errors
    /// [`StatedError`] when the effect is unknown, cannot be on this rig, or its parameters do not fix it.
    pub fn from_stated(rig: &NominalRig, name: &str, stated: &StatedEffect) -> Result<Self, StatedError> {
        let effect = by_name(name).ok_or_else(|| StatedError::Effect {
            effect: name.to_owned(),
            allowed: LIBRARY.iter().map(|effect| effect.name()).collect::<Vec<_>>().join(", "),
        })?;
        if !effect.applies(rig) {
            return Err(StatedError::NeedsTeeth { effect: effect.name() });
        }
        let given = Given::new(effect.name(), effect.parameter_names(), stated)?;
        let (shape, beta) = effect.amplitudes(rig, &given)?;
        Ok(Self { effect, shape, beta })
    }

    /// The parameters that fix it.
    #[must_use]
    pub fn stated(&self, rig: &NominalRig) -> StatedEffect {
        self.effect.stated(rig, &self.shape, &self.beta)
    }

    /// TE at a station, rad: columns · β.
    #[must_use]
    pub fn te_rad(&self, rig: &NominalRig, at: &OperatingPoint) -> f64 {
        let mut row = vec![0.0; self.beta.len()];
        self.effect.row(rig, &self.shape, at, &mut row);
        row.iter().zip(&self.beta).map(|(x, b)| x * b).sum()
    }

    /// Adds another term of the same effect where one term can hold both; false where they stay two.
    pub fn add(&mut self, rig: &NominalRig, other: &Self) -> bool {
        if self.effect.name() != other.effect.name() || self.beta.len() != other.beta.len() {
            return false;
        }
        let sum: Vec<f64> = self.beta.iter().zip(&other.beta).map(|(a, b)| a + b).collect();
        match self.effect.refine(rig, &self.shape, &sum) {
            // The shape follows from the amplitudes.
            Some(shape) => self.shape = shape,
            None if self.shape == other.shape => {}
            None => return false,
        }
        self.beta = sum;
        true
    }

    /// Adds it to the documented errors where it is one of those; false where it is none.
    pub fn fold_into(&self, errors: &mut Errors) -> bool {
        // Vectors add as vectors: (e cos φ, e sin φ) + (dx, dy).
        let moved = |e_mm: &mut f64, phi_rad: &mut f64| {
            let (x_mm, y_mm) = (*e_mm * phi_rad.cos() + self.beta[0], *e_mm * phi_rad.sin() + self.beta[1]);
            (*e_mm, *phi_rad) = (x_mm.hypot(y_mm), y_mm.atan2(x_mm));
        };
        match self.effect.folds_into() {
            Some(Fold::Eccentricity(Shaft::Input)) => moved(&mut errors.e1_mm, &mut errors.phi1_rad),
            Some(Fold::Eccentricity(Shaft::Output)) => moved(&mut errors.e2_mm, &mut errors.phi2_rad),
            Some(Fold::ShaftCompliance(Shaft::Input)) => errors.shaft_compliance_input_rad_per_nm += self.beta[0],
            Some(Fold::ShaftCompliance(Shaft::Output)) => errors.shaft_compliance_output_rad_per_nm += self.beta[0],
            Some(Fold::MeshCompliance) => errors.mesh_compliance_mm2_rad_per_nm += self.beta[0],
            None => return false,
        }
        true
    }
}

/// The effects of a nominal model beyond its [`Errors`]; empty for most.
#[derive(Clone, Debug, Default)]
pub struct Documented(Option<Arc<Inner>>);

#[derive(Debug)]
struct Inner {
    /// What the effects are linearised about: the pair with its documented errors.
    rig: NominalRig,
    terms: Vec<Term>,
}

impl PartialEq for Documented {
    fn eq(&self, other: &Self) -> bool {
        self.terms() == other.terms()
    }
}

impl Documented {
    /// Effects from their stated parameters; those that are changes of [`Errors`] go there.
    ///
    /// # Errors
    /// [`GeometryError::Documented`] that names the effect and the parameter.
    pub fn from_stated(
        pair: &GearPair,
        errors: &mut Errors,
        stated: &BTreeMap<String, Vec<StatedEffect>>,
    ) -> Result<Self, GeometryError> {
        if stated.is_empty() {
            return Ok(Self::default());
        }
        let rig = |errors: Errors| NominalRig::new(pair.clone(), errors, [None, None], None);
        let plain = rig(*errors);
        let mut terms = Vec::new();
        for (name, tables) in stated {
            for table in tables {
                let term = Term::from_stated(&plain, name, table)?;
                if !term.fold_into(errors) {
                    terms.push(term);
                }
            }
        }
        Ok(if terms.is_empty() { Self::default() } else { Self(Some(Arc::new(Inner { rig: rig(*errors), terms }))) })
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_none()
    }

    /// The effects.
    #[must_use]
    pub fn terms(&self) -> &[Term] {
        self.0.as_ref().map_or(&[], |inner| &inner.terms)
    }

    /// The rig that they are linearised about; `None` where there are none.
    #[must_use]
    pub fn rig(&self) -> Option<&NominalRig> {
        self.0.as_ref().map(|inner| &inner.rig)
    }

    /// TE that they add at a station of [`Documented::rig`], rad.
    #[must_use]
    pub fn te_rad(&self, at: &OperatingPoint) -> f64 {
        self.0.as_ref().map_or(0.0, |inner| inner.terms.iter().map(|term| term.te_rad(&inner.rig, at)).sum())
    }
}
