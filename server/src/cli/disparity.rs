//! `mis-slam disparity`: one rectified pair of any size.

use std::path::{Path, PathBuf};

use clap::Args;
use dense::disparity::{self, DisparityRange, Method, Pair};
use geometry::Rgb;
use gpu::Gpu;
use recording::{EncodedImage, ImageFormat};
use serde::Deserialize;
use serde::de::IntoDeserializer;

use super::{Failure, Outcome};
use crate::config::Config;

/// Match one rectified stereo pair; writes disparity in pixels as PFM, inf where unknown.
#[derive(Debug, Args)]
pub struct Disparity {
    /// Left image (PNG or JPEG).
    left: PathBuf,
    /// Right image, of the same size.
    right: PathBuf,
    /// The disparity image to write.
    #[arg(short, long, value_name = "OUT.pfm")]
    output: PathBuf,
    /// How to match; the configuration's `disparity.method` where not given.
    #[arg(long, value_parser = parse_method)]
    method: Option<Method>,
    /// Largest disparity searched, in pixels.
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(i32).range(1..))]
    max_disparity: i32,
}

impl Disparity {
    pub(super) fn run(&self, config: &Config) -> Outcome {
        let (left, right) = (read(&self.left)?, read(&self.right)?);
        let settings = disparity::DisparityConfig {
            method: self.method.unwrap_or(config.disparity.method),
            ..config.disparity.clone()
        };
        let range = DisparityRange::new(0, self.max_disparity).map_err(Failure::bad_input)?;
        let gpu = Gpu::open(&config.gpu.clone().with_environment()).map_err(Failure::failed)?;
        let pair = Pair { left: &left, right: &right, mask: None };
        // The first run compiles pipelines; the second is what a stream costs.
        disparity::compute(&gpu, &pair, range, &settings).map_err(Failure::bad_input)?;
        let map = disparity::compute(&gpu, &pair, range, &settings).map_err(Failure::failed)?;
        recording::export::write_pfm(&self.output, &map.disparity).map_err(Failure::failed)?;
        println!(
            "{}: {:.1} ms on {}, coverage {:.1} %",
            self.output.display(),
            map.total_ms(),
            gpu.description().name,
            100.0 * map.coverage()
        );
        Ok(())
    }
}

/// By the names that the configuration uses.
fn parse_method(name: &str) -> Result<Method, serde::de::value::Error> {
    Method::deserialize(name.into_deserializer())
}

fn read(path: &Path) -> Result<Rgb, Failure> {
    let named = |error: &dyn std::fmt::Display| Failure::bad_input(format!("{}: {error}", path.display()));
    let bytes = std::fs::read(path).map_err(|error| named(&error))?;
    let format = if bytes.starts_with(b"\x89PNG") { ImageFormat::Png } else { ImageFormat::Jpeg };
    let image = EncodedImage { format, bytes };
    let size_px = recording::size_px(&image).map_err(|error| named(&error))?;
    recording::decode_rgb(&image, size_px).map_err(|error| named(&error))
}
