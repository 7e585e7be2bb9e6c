//! rigd
fn main() {}
