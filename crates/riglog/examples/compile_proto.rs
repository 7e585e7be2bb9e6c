//! Compiles the message definitions anew, without a protoc binary: Rust types by prost, and the descriptor sets that make every log
//! self-describing. What it writes to `proto/generated` is kept with the sources, so that who builds a log needs no compiler of
//! messages: `just proto`.

use std::{error::Error, fs, path::Path};

fn main() -> Result<(), Box<dyn Error>> {
    let proto = Path::new(env!("CARGO_MANIFEST_DIR")).join("proto");
    let out = proto.join("generated");
    let files = ["rig.proto", "foxglove/Log.proto"];
    // Source information carries the comments over into the documentation of the Rust types.
    let described = protox::compile(files, [&proto])?;
    prost_build::Config::new().out_dir(&out).compile_well_known_types().compile_fds(described)?;
    // A channel's schema is the whole set for its own file, imports included and comments left out.
    for (file, name) in files.iter().zip(["rig.fds", "foxglove_log.fds"]) {
        let mut compiler = protox::Compiler::new([&proto])?;
        compiler.include_imports(true).include_source_info(false).open_file(file)?;
        fs::write(out.join(name), compiler.encode_file_descriptor_set())?;
    }
    // What a test compares the definitions with.
    let sources = files.map(|file| fs::read(proto.join(file)));
    let checksums: Vec<String> = sources
        .into_iter()
        .zip(files)
        .map(|(source, file)| Ok(format!("{:08x} {file}\n", crc32fast::hash(&source?))))
        .collect::<Result<_, std::io::Error>>()?;
    fs::write(out.join("compiled-from.txt"), checksums.concat())?;
    Ok(())
}
