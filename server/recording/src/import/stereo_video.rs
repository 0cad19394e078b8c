//! Pairs out of videos: both eyes in one picture, side by side or one above the other, or a file for each.

use std::path::{Path, PathBuf};

use geometry::{Raster, Rgb};

use super::ffmpeg::{Ffmpeg, Pictures, VideoFacts};
use crate::{EncodedImage, RecordingError, encode_jpeg};

/// Where the eyes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// The left eye in the left half.
    SideBySide,
    /// The left eye in the upper half.
    TopBottom,
}

/// The files of a stereo video.
#[derive(Clone, Debug)]
pub(super) enum VideoFiles {
    /// Both eyes in one.
    One(PathBuf),
    /// Left and right.
    Two(PathBuf, PathBuf),
}

/// A stereo video being decoded.
pub(super) enum StereoVideo {
    /// Both eyes in one file.
    One(Pictures, Layout),
    /// A file for each eye.
    Two(Box<[Pictures; 2]>),
}

/// A video's files, opened as far as their heads.
pub(super) struct OpenedVideo {
    files: VideoFiles,
    facts: Vec<VideoFacts>,
    ffmpeg: Ffmpeg,
}

impl OpenedVideo {
    /// Reads the heads.
    ///
    /// # Errors
    /// [`RecordingError::Input`] names the file that FFmpeg cannot read, or the two that differ.
    pub fn open(files: VideoFiles) -> Result<Self, RecordingError> {
        let ffmpeg = Ffmpeg::installed();
        let facts = match &files {
            VideoFiles::One(path) => vec![ffmpeg.probe(path)?],
            VideoFiles::Two(left, right) => vec![ffmpeg.probe(left)?, ffmpeg.probe(right)?],
        };
        if let (VideoFiles::Two(_, path), [left, right]) = (&files, &facts[..])
            && left.pictures != right.pictures
        {
            let problem = format!("{} pictures, but {} of the left eye", right.pictures, left.pictures);
            return Err(RecordingError::input(path, problem));
        }
        Ok(Self { files, facts, ffmpeg })
    }

    /// When each pair was taken: by the left file's own times, or by a rate where one is given.
    ///
    /// # Errors
    /// [`RecordingError::Input`] where neither is known.
    pub fn stamps_ns(&self, frame_rate_hz: Option<f64>) -> Result<Vec<u64>, RecordingError> {
        let facts = &self.facts[0];
        if let Some(rate_hz) = frame_rate_hz {
            return Ok((0..facts.pictures as u64)
                .map(|number| super::files::stamp_ns(number, rate_hz))
                .collect());
        }
        facts.stamps_ns.clone().ok_or_else(|| {
            RecordingError::input(
                self.path(),
                "the video does not tell when its pictures are: name --frame-rate",
            )
        })
    }

    /// Starts decoding, having found out where the eyes are by the size that the calibration tells.
    ///
    /// # Errors
    /// [`RecordingError::Input`] where no layout fits.
    pub fn decode(self, eye_px: (u32, u32)) -> Result<StereoVideo, RecordingError> {
        let (width, height) = eye_px;
        let size = |facts: &VideoFacts| (facts.width_px, facts.height_px);
        match &self.files {
            VideoFiles::Two(left, right) => {
                for (path, facts) in [left, right].into_iter().zip(&self.facts) {
                    if size(facts) != eye_px {
                        return Err(self.misfit(path, facts, eye_px));
                    }
                }
                let decode = |path: &Path, facts| self.ffmpeg.decode(path, facts);
                let both = [decode(left, &self.facts[0])?, decode(right, &self.facts[1])?];
                Ok(StereoVideo::Two(Box::new(both)))
            }
            VideoFiles::One(path) => {
                let facts = &self.facts[0];
                let layout = match size(facts) {
                    found if found == (2 * width, height) => Layout::SideBySide,
                    found if found == (width, 2 * height) => Layout::TopBottom,
                    _ => return Err(self.misfit(path, facts, eye_px)),
                };
                Ok(StereoVideo::One(self.ffmpeg.decode(path, facts)?, layout))
            }
        }
    }

    fn path(&self) -> &Path {
        match &self.files {
            VideoFiles::One(path) | VideoFiles::Two(path, _) => path,
        }
    }

    fn misfit(&self, path: &Path, facts: &VideoFacts, (width, height): (u32, u32)) -> RecordingError {
        let wanted = match self.files {
            VideoFiles::One(_) => {
                format!("{}x{height} side by side or {width}x{} top and bottom", 2 * width, 2 * height)
            }
            VideoFiles::Two(..) => format!("{width}x{height}"),
        };
        let problem =
            format!("pictures of {}x{}, the calibration expects {wanted}", facts.width_px, facts.height_px);
        RecordingError::input(path, problem)
    }
}

impl StereoVideo {
    /// Pair `number` of the video, counted from 0, as JPEG of `quality`; pairs are had in their order only.
    ///
    /// # Errors
    /// [`RecordingError::Input`] where a file ends before.
    pub fn pair(&mut self, number: usize, quality: u8) -> Result<[EncodedImage; 2], RecordingError> {
        let [left, right] = match self {
            Self::One(pictures, layout) => {
                let size_px = pictures.size_px();
                halves(&pictures.picture(number)?, size_px, *layout)
            }
            Self::Two(both) => {
                let [left, right] = both.as_mut();
                [left.picture(number)?, right.picture(number)?]
            }
        };
        Ok([encode_jpeg(&left, quality)?, encode_jpeg(&right, quality)?])
    }
}

fn halves(picture: &Rgb, (width, height): (u32, u32), layout: Layout) -> [Rgb; 2] {
    let part = |x0: u32, y0: u32, width: u32, height: u32| {
        Raster::from_fn(width, height, |x, y| picture[(x0 + x, y0 + y)])
    };
    match layout {
        Layout::SideBySide => [part(0, 0, width / 2, height), part(width / 2, 0, width / 2, height)],
        Layout::TopBottom => [part(0, 0, width, height / 2), part(0, height / 2, width, height / 2)],
    }
}
