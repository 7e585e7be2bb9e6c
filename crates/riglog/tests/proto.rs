//! The generated messages are those of the definitions beside them.

#[test]
fn the_messages_were_compiled_from_these_definitions() {
    let sources: [(&str, &[u8]); 2] = [
        ("rig.proto", include_bytes!("../proto/rig.proto")),
        ("foxglove/Log.proto", include_bytes!("../proto/foxglove/Log.proto")),
    ];
    let now = sources.map(|(file, source)| format!("{:08x} {file}\n", crc32fast::hash(source))).concat();
    assert_eq!(now, include_str!("../proto/generated/compiled-from.txt"), "a definition changed: run `just proto`");
}
