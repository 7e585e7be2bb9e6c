//! The report as a page of its own: works offline, in light and dark, and on paper.

mod charts;
mod maps;
mod page;
mod svg;
mod tables;

pub use page::page;
