//! Compiles the protobuf schemas; needs no `protoc`.

use std::error::Error;

/// Messages that also travel as JSON, in the bodies of HTTP requests.
const JSON_MESSAGES: [&str; 6] =
    ["Calibration", "Camera", "DistortedCamera", "RectifiedRig", "RawRig", "RigidTransform"];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=proto");
    let descriptors = protox::compile(["mis_slam/v1/envelope.proto"], ["proto"])?;
    let mut config = prost_build::Config::new();
    config.bytes(["."]);
    for message in JSON_MESSAGES {
        let path = format!(".mis_slam.v1.{message}");
        config.type_attribute(&path, "#[derive(serde::Serialize, serde::Deserialize)]");
        config.type_attribute(&path, "#[serde(deny_unknown_fields)]");
        config.type_attribute(&path, r#"#[cfg_attr(feature = "openapi", derive(schemars::JsonSchema))]"#);
    }
    config.field_attribute("DistortedCamera.distortion", "#[serde(default)]");
    config.compile_fds(descriptors)?;
    Ok(())
}
