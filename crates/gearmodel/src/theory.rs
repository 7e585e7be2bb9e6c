//! The theory, page by page, as it stands in `docs/theory` (where its pictures are).

#[doc = include_str!("../../../docs/theory/conventions.md")]
pub mod conventions {}

#[doc = include_str!("../../../docs/theory/pitch-curves.md")]
pub mod pitch_curves {}

#[doc = include_str!("../../../docs/theory/common-normal.md")]
pub mod common_normal {}

#[doc = include_str!("../../../docs/theory/published.md")]
pub mod published {}

#[doc = include_str!("../../../docs/theory/exact-contact.md")]
pub mod exact_contact {}

#[doc = include_str!("../../../docs/theory/circular-limit.md")]
pub mod circular_limit {}

#[doc = include_str!("../../../docs/theory/tooth-errors.md")]
pub mod tooth_errors {}

#[doc = include_str!("../../../docs/theory/load.md")]
pub mod load {}

#[doc = include_str!("../../../docs/theory/phases.md")]
pub mod phases {}

#[doc = include_str!("../../../docs/theory/measured-figures.md")]
pub mod measured_figures {}

#[doc = include_str!("../../../docs/theory/inseparable.md")]
pub mod inseparable {}

#[doc = include_str!("../../../docs/theory/effects.md")]
pub mod effects {}

#[doc = include_str!("../../../docs/theory/diagnosis.md")]
pub mod diagnosis {}
