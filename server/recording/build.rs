//! Compiles the message schemas to Rust, and to the descriptor sets that recordings carry; needs no `protoc`.

use std::{env, error::Error, fs, path::PathBuf};

/// Files whose message of the same name is written to recordings, and that message's full name.
const SCHEMAS: [(&str, &str); 6] = [
    ("foxglove/CameraCalibration.proto", "foxglove.CameraCalibration"),
    ("foxglove/CompressedImage.proto", "foxglove.CompressedImage"),
    ("foxglove/PointCloud.proto", "foxglove.PointCloud"),
    ("foxglove/PoseInFrame.proto", "foxglove.PoseInFrame"),
    ("foxglove/RawImage.proto", "foxglove.RawImage"),
    ("mis_slam/recording/v1/model.proto", "mis_slam.recording.v1.SurfelModel"),
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=proto");
    let folder = PathBuf::from(env::var("OUT_DIR")?);
    let files = protox::compile(SCHEMAS.map(|(file, _)| file), ["proto"])?;
    prost_build::Config::new().compile_fds(files)?;
    for (file, message) in SCHEMAS {
        let mut compiler = protox::Compiler::new(["proto"])?;
        compiler.include_imports(true).include_source_info(false).open_file(file)?;
        fs::write(folder.join(format!("{message}.binpb")), compiler.encode_file_descriptor_set())?;
    }
    Ok(())
}
