//! `mis-slam disparity`: one rectified pair of any size.

mod colors;
mod rows;

use std::path::{Path, PathBuf};

use clap::Args;
use dense::disparity::{self, DisparityConfig, DisparityMap, DisparityRange, Method, Pair};
use geometry::Rgb;
use gpu::Gpu;
use recording::EncodedImage;
use serde::Deserialize;
use serde::de::IntoDeserializer;

use self::colors::colored;
use self::rows::row_offset_px;
use super::{Failure, Outcome};
use crate::config::Config;

/// Share of the columns that disparities are searched over where nobody says how many.
const SEARCHED_SHARE: f64 = 0.4;
/// Most disparities above the smallest that are searched.
const DISPARITY_MAX: i32 = 312;
/// A smaller offset of the rows changes nothing.
const ROW_OFFSET_MIN_PX: f64 = 0.1;

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
    /// Largest disparity searched, in pixels; where not given, 2/5 of the image's width, at most 312.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(i32).range(1..))]
    max_disparity: Option<i32>,
    /// Also write the standard deviation of each disparity, in pixels, as PFM; inf where unknown.
    #[arg(long, value_name = "OUT.pfm")]
    sigma: Option<PathBuf>,
    /// Also write disparity and standard deviation in colours, to OUT.png and OUT.sigma.png.
    #[arg(long)]
    png: bool,
}

impl Disparity {
    pub(super) fn run(&self, config: &Config) -> Outcome {
        let (left, right) = (read(&self.left)?, read(&self.right)?);
        let settings = DisparityConfig {
            method: self.method.unwrap_or(config.disparity.method),
            ..config.disparity.clone()
        };
        let range = self.range(left.width())?;
        let gpu = Gpu::open(&config.gpu.clone().with_environment()).map_err(Failure::failed)?;
        if left.size() == right.size() {
            refuse_swapped(&gpu, (&left, &right), range, &settings)?;
        }
        let offset_px =
            row_offset_px((&left, &right), config).filter(|offset| offset.abs() >= ROW_OFFSET_MIN_PX);
        let right = offset_px.map_or(right.clone(), |offset_px| right.rows_shifted(offset_px));
        let pair = Pair { left: &left, right: &right, mask: None };
        // The first run compiles pipelines; the second is what a stream costs.
        disparity::compute(&gpu, &pair, range, &settings).map_err(Failure::bad_input)?;
        let map = disparity::compute(&gpu, &pair, range, &settings).map_err(Failure::failed)?;
        self.write(&map, range)?;
        if let Some(offset_px) = offset_px {
            println!("rows levelled: the right image lay {offset_px:.2} px lower");
        }
        println!(
            "{}: {:.1} ms on {}, coverage {:.1} %",
            self.output.display(),
            map.total_ms(),
            gpu.description().name,
            100.0 * map.coverage()
        );
        Ok(())
    }

    fn range(&self, width_px: u32) -> Result<DisparityRange, Failure> {
        let of_width = (SEARCHED_SHARE * f64::from(width_px)).ceil() as i32;
        let max_px = self.max_disparity.unwrap_or(of_width.clamp(1, DISPARITY_MAX));
        DisparityRange::new(0, max_px).map_err(Failure::bad_input)
    }

    fn write(&self, map: &DisparityMap, range: DisparityRange) -> Outcome {
        recording::export::write_pfm(&self.output, &map.disparity).map_err(Failure::failed)?;
        if let Some(sigma) = &self.sigma {
            recording::export::write_pfm(sigma, &map.variance.map(|variance| variance.sqrt()))
                .map_err(Failure::failed)?;
        }
        if self.png {
            let max_px = (range.min_px + range.count() as i32) as f32;
            let disparity = colored(&map.disparity, |px| px / max_px);
            write_png(&self.output.with_extension("png"), &disparity)?;
            // a pixel's error at one end, none at the other
            let sigma = colored(&map.variance, f32::sqrt);
            write_png(&self.output.with_extension("sigma.png"), &sigma)?;
        }
        Ok(())
    }
}

fn refuse_swapped(gpu: &Gpu, eyes: (&Rgb, &Rgb), range: DisparityRange, config: &DisparityConfig) -> Outcome {
    let order = disparity::eye_order(gpu, eyes, range, config).map_err(Failure::bad_input)?;
    if order.is_swapped() {
        return Err(Failure::bad_input(format!(
            "left and right eye are swapped: {:.0} % match as given, {:.0} % exchanged; exchange the two images",
            100.0 * order.as_given,
            100.0 * order.exchanged
        )));
    }
    Ok(())
}

fn write_png(path: &Path, image: &Rgb) -> Outcome {
    let png = recording::encode_png_rgb(image).map_err(Failure::failed)?;
    std::fs::write(path, png.bytes).map_err(|error| Failure::failed(format!("{}: {error}", path.display())))
}

/// By the names that the configuration uses.
fn parse_method(name: &str) -> Result<Method, serde::de::value::Error> {
    Method::deserialize(name.into_deserializer())
}

fn read(path: &Path) -> Result<Rgb, Failure> {
    let named = |error: &dyn std::fmt::Display| Failure::bad_input(format!("{}: {error}", path.display()));
    let bytes = std::fs::read(path).map_err(|error| named(&error))?;
    let image = EncodedImage::of_file(bytes);
    let size_px = recording::size_px(&image).map_err(|error| named(&error))?;
    recording::decode_rgb(&image, size_px).map_err(|error| named(&error))
}
