//! The fuzz targets' corpora as ordinary tests: what was ever found stays found.

#[path = "../fuzz/checks.rs"]
mod checks;

use std::path::Path;

fn run(target: &str, check: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target);
    let mut seeds = 0;
    for entry in std::fs::read_dir(&folder).expect("a corpus") {
        check(&std::fs::read(entry.expect("an entry").path()).expect("a readable seed"));
        seeds += 1;
    }
    assert!(seeds >= 4, "{seeds} seeds in {}", folder.display());
}

#[test]
fn every_seed_of_every_target_passes() {
    run("decode_from_server", checks::decode_from_server);
    run("decode_to_server", checks::decode_to_server);
    run("apply_epoch", checks::apply_epoch);
    run("unpack_chunk", checks::unpack_chunk);
    run("unpack_arrays", checks::unpack_arrays);
    run("parse_key", checks::parse_key);
}

#[test]
fn every_seed_passes_with_any_one_byte_changed() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/apply_epoch");
    for entry in std::fs::read_dir(folder).expect("a corpus") {
        let seed = std::fs::read(entry.expect("an entry").path()).expect("a readable seed");
        for place in (0..seed.len()).step_by(7) {
            for flip in [0x01, 0x80, 0xFF] {
                let mut broken = seed.clone();
                broken[place] ^= flip;
                checks::apply_epoch(&broken);
            }
        }
    }
}
