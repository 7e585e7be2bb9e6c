//! How TE and backlash are computed: one function of θ1 whatever the method.

use gearmodel::contact::ContactModel;
use gearmodel::increment::published;
use gearmodel::loaded::{LoadedModel, Material, Supports};
use gearmodel::{Direction, NominalModel};

use super::error::ModelError;
use super::source::Loaded;

/// How TE is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Method {
    /// Increment along the common normal, first order in the errors
    #[value(name = "common_normal", alias = "common-normal")]
    CommonNormal,
    /// Exact contact of rack-generated flanks
    Exact,
    /// Exact contact of elastic steel teeth that share the load, with the documented shafts
    Loaded,
    /// The printed equations of the source document, kept for comparison
    Published,
}

impl Method {
    /// The name in options, tables and JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::CommonNormal => "common_normal",
            Self::Exact => "exact",
            Self::Loaded => "loaded",
            Self::Published => "published",
        }
    }
}

/// Teeth in contact.
enum Contact {
    Rigid(Box<ContactModel>),
    Elastic(Box<LoadedModel>),
}

/// A method, ready for one pair and load.
pub struct Predictor<'a> {
    method: Method,
    name: &'a str,
    model: &'a NominalModel,
    contact: Option<Contact>,
    load_nm: f64,
}

impl<'a> Predictor<'a> {
    /// Prepares a method.
    ///
    /// # Errors
    /// [`ModelError`] when the method cannot take the load or the pair.
    pub fn new(pair: &'a Loaded, method: Method, load_nm: f64) -> Result<Self, ModelError> {
        let model = &pair.model;
        if method == Method::Published && load_nm != 0.0 {
            return Err(ModelError::PublishedLoad { load_nm });
        }
        let geometry = |source| ModelError::Geometry { pair: pair.name.clone(), source };
        let rigid = || ContactModel::new(model.pair.clone(), &model.errors).map_err(geometry);
        let contact = match method {
            Method::Exact => Some(Contact::Rigid(Box::new(rigid()?))),
            Method::Loaded => {
                let supports = Supports {
                    shaft_compliance_output_rad_per_nm: model.errors.shaft_compliance_output_rad_per_nm,
                    shaft_compliance_input_rad_per_nm: model.errors.shaft_compliance_input_rad_per_nm,
                    ..Supports::default()
                };
                let elastic = LoadedModel::new(rigid()?, supports, Material::default()).map_err(geometry)?;
                Some(Contact::Elastic(Box::new(elastic)))
            }
            Method::CommonNormal | Method::Published => None,
        };
        Ok(Self { method, name: &pair.name, model, contact, load_nm })
    }

    /// The method.
    #[must_use]
    pub fn method(&self) -> Method {
        self.method
    }

    /// TE at θ1, rad at the driven shaft. With the exact method the compliances' wind-up is added to the rigid contact.
    ///
    /// # Errors
    /// [`ModelError::Contact`] where no teeth touch.
    pub fn te_rad(&self, theta1_rad: f64, direction: Direction) -> Result<f64, ModelError> {
        let missing = |source| ModelError::Contact { pair: self.name.to_owned(), source };
        match &self.contact {
            Some(Contact::Rigid(contact)) => {
                let rigid_rad = contact.te_rad(theta1_rad, direction).map_err(missing)?;
                Ok(rigid_rad + self.model.windup_rad(&self.model.pair.at(theta1_rad), direction, self.load_nm))
            }
            // The teeth's own compliance stands in for the documented mesh compliance.
            Some(Contact::Elastic(contact)) => contact.te_rad(theta1_rad, direction, self.load_nm).map_err(missing),
            None if self.method == Method::Published => {
                Ok(published::te_rad(&self.model.pair, &self.model.errors, theta1_rad, direction))
            }
            None => Ok(self.model.te_rad(theta1_rad, direction, self.load_nm)),
        }
    }

    /// TE at many angles, rad: by exact contact they cost less together than one by one.
    ///
    /// # Errors
    /// As [`Predictor::te_rad`].
    pub fn te_curve_rad(&self, theta1_rad: &[f64], direction: Direction) -> Result<Vec<f64>, ModelError> {
        let Some(Contact::Rigid(contact)) = &self.contact else {
            return theta1_rad.iter().map(|theta| self.te_rad(*theta, direction)).collect();
        };
        let mut te_rad = contact
            .te_curve_rad(theta1_rad, direction)
            .map_err(|source| ModelError::Contact { pair: self.name.to_owned(), source })?;
        for (te_rad, theta) in te_rad.iter_mut().zip(theta1_rad) {
            *te_rad += self.model.windup_rad(&self.model.pair.at(*theta), direction, self.load_nm);
        }
        Ok(te_rad)
    }

    /// Backlash at θ1, rad at the driven shaft: TE_cw − TE_ccw; of the printed equations their periodic part alone.
    ///
    /// # Errors
    /// [`ModelError::Contact`] where no teeth touch.
    pub fn backlash_rad(&self, theta1_rad: f64) -> Result<f64, ModelError> {
        match self.method {
            Method::Published => Ok(published::backlash_rad(&self.model.pair, &self.model.errors, theta1_rad)),
            _ => Ok(self.te_rad(theta1_rad, Direction::Cw)? - self.te_rad(theta1_rad, Direction::Ccw)?),
        }
    }
}
