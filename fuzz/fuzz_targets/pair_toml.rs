//! Any text as a pair file: an error or a pair, never a panic; a pair that is taken can be asked.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    match gearmodel::PairFile::parse(text) {
        Err(error) => drop(error.to_string()),
        Ok(_) => drop(riglog::pair::parse(text, std::path::Path::new("fuzzed.toml")).map(|model| {
            let te = model.te_rad(1.0, gearmodel::Direction::Ccw, 5.0);
            assert!(te.is_finite() || te.is_nan());
        })),
    }
});
