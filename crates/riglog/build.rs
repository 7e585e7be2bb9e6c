//! Compiles the message definitions without a protoc binary: Rust types by prost, and the
//! descriptor sets that make every log self-describing.

use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=proto");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let files = ["rig.proto", "foxglove/Log.proto"];
    // Source information carries the comments over into the documentation of the Rust types.
    let described = protox::compile(files, ["proto"])?;
    prost_build::Config::new().compile_well_known_types().compile_fds(described)?;
    // A channel's schema is the whole set for its own file, imports included and comments left out.
    for (file, name) in files.iter().zip(["rig.fds", "foxglove_log.fds"]) {
        let mut compiler = protox::Compiler::new(["proto"])?;
        compiler.include_imports(true).include_source_info(false).open_file(file)?;
        fs::write(out.join(name), compiler.encode_file_descriptor_set())?;
    }
    Ok(())
}
