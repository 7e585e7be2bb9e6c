//! The numerics against dense references, each written from the definitions in `docs/theory/diagnosis.md` and from
//! nothing else: full covariance matrices, quadrature, QR, explicit refits, all subsets, draws of known variance.
//!
//! Tolerances are derived where they stand: rounding times a condition number, standard errors of means of draws, or
//! the error of an approximation that the documentation names. No golden values.

mod design_matrix;
mod events;
mod evidence;
mod held_out;
mod noise_estimates;
mod normal_equations;
mod search;
mod support;
mod whitening;
