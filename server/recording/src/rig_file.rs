//! The project's own calibration files.
/// x
pub struct RigFile;
