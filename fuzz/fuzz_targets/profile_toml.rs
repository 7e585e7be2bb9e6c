//! Any text as a rig's profile: an error or a profile that survives a round trip, never a panic.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use rigd::profile::Profile;

fuzz_target!(|text: &str| {
    let path = Path::new("fuzzed.toml");
    match Profile::parse(text, path) {
        Err(error) => drop(error.to_string()),
        Ok(profile) => {
            let again = Profile::parse(&profile.to_toml(), path).expect("its own text is a profile");
            assert_eq!(again, profile);
            for load_nm in [0.0, 1.0, 1e9, f64::NAN] {
                let _ = profile.brake.current_a(load_nm);
            }
            let _ = profile.brake.load_nm(0.5);
        }
    }
});
