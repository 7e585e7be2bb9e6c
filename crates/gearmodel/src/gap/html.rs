//! The report as a page of its own.

use super::diagnosis::Diagnosis;

/// A self-contained page: no script or font from elsewhere.
#[must_use]
pub fn page(diagnosis: &Diagnosis) -> String {
    let summary = super::summary::text(diagnosis);
    format!("<!doctype html><meta charset=\"utf-8\"><title>Gap diagnosis</title><pre>{summary}</pre>")
}
