//! `mis-slam simulate`: a procedural scene with everything true about it, as a recording.

use std::path::PathBuf;

use clap::Args;
use simulator::{SceneConfig, SceneKind};

use super::progress::Progress;
use super::{Failure, Outcome, parse_size};
use crate::config::Config;
use crate::simulated::{self, Encoding};

/// Simulate a stereo scope over a deforming organ, with pose, depth and material points as truth.
///
/// Options not given here come from `[simulate]` in the configuration.
#[derive(Debug, Args)]
pub struct Simulate {
    /// heart, liver, kidney, phantom or abdomen.
    scene: SceneKind,
    /// The recording to write.
    #[arg(short, long, value_name = "REC.mcap")]
    output: PathBuf,
    /// Number of pairs.
    #[arg(long)]
    frames: Option<u32>,
    /// Pairs a second.
    #[arg(long)]
    fps: Option<f64>,
    /// Columns and rows of an image.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Another seed is another scene.
    #[arg(long)]
    seed: Option<u64>,
    /// How far each push moves the tissue; 0 for none.
    #[arg(long, value_name = "MM")]
    deformation_mm: Option<f64>,
    /// How far breathing moves the tissue; 0 for none.
    #[arg(long, value_name = "MM")]
    respiration_mm: Option<f64>,
    /// How far the scope is jerked.
    #[arg(long, value_name = "MM")]
    jerk_mm: Option<f64>,
    /// No pushes, no breathing, no beat: nothing deforms.
    #[arg(long)]
    rigid: bool,
    /// JPEG quality of the images, 1 to 100.
    #[arg(long, default_value_t = 95, value_parser = clap::value_parser!(u8).range(1..=100))]
    jpeg_quality: u8,
    /// True depth is written for every n-th pair.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    depth_every: u32,
}

impl Simulate {
    pub(super) fn run(&self, config: &Config) -> Outcome {
        let scene = self.scene_config(&config.simulate);
        let encoding = Encoding { jpeg_quality: self.jpeg_quality, depth_every: self.depth_every };
        let mut progress = Progress::new("simulate");
        let recorded =
            simulated::record(&scene, &encoding, &self.output, &config.recording, &mut |done, total| {
                progress.set(done, Some(total));
            });
        progress.finish();
        recorded.map_err(Failure::bad_input)?;
        println!(
            "{}: {} pairs of {}x{}",
            self.output.display(),
            scene.frames,
            scene.width_px,
            scene.height_px
        );
        Ok(())
    }

    fn scene_config(&self, defaults: &SceneConfig) -> SceneConfig {
        let (width_px, height_px) = self.size.unwrap_or((defaults.width_px, defaults.height_px));
        let scene = SceneConfig {
            scene: self.scene,
            frames: self.frames.unwrap_or(defaults.frames),
            fps: self.fps.unwrap_or(defaults.fps),
            width_px,
            height_px,
            seed: self.seed.unwrap_or(defaults.seed),
            deformation_mm: self.deformation_mm.unwrap_or(defaults.deformation_mm),
            respiration_mm: self.respiration_mm.unwrap_or(defaults.respiration_mm),
            jerk_mm: self.jerk_mm.unwrap_or(defaults.jerk_mm),
            ..defaults.clone()
        };
        if self.rigid { simulated::rigid(&scene) } else { scene }
    }
}
