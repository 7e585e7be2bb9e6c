//! The meshing line increment: TE and backlash to first order in the errors.
//!
//! [`common_normal`] is right and the default; [`published`] keeps the printed equations of the source document to the
//! letter, contradictions included, so that the two can be compared.

pub mod common_normal;
pub mod published;
