//! The model as a picture file, without a window.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use geometry::Rgb;
use gpu::Gpu;
use render::Canvas;

pub use crate::frame::Frame;
use crate::frame::FrameRenderer;
use crate::shown::{Shown, Status};
use crate::{Look, ViewControl, ViewerError};

/// Between two looks at whether the model has come.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Waits until all of the model is there; gives what is then known of it.
///
/// # Errors
/// [`ViewerError::NoModel`] after `patience`, with what is known of the reason.
pub fn wait_for(shown: &mut dyn Shown, patience: Duration) -> Result<Status, ViewerError> {
    let started = Instant::now();
    loop {
        let status = shown.status(Instant::now());
        if status.is_complete {
            return Ok(status);
        }
        if started.elapsed() >= patience {
            let why =
                status.message.map_or_else(String::new, |said| format!("{}. {}", said.title, said.detail));
            return Err(ViewerError::NoModel { after: patience, why });
        }
        std::thread::park_timeout(POLL_INTERVAL);
    }
}

/// Draws a picture of this size.
///
/// # Errors
/// [`ViewerError::Gpu`].
pub fn draw(gpu: &Arc<Gpu>, size_px: (u32, u32), frame: &Frame) -> Result<Rgb, ViewerError> {
    let canvas = Canvas::new(gpu, size_px)?;
    FrameRenderer::new(gpu, Canvas::FORMAT)?.draw((canvas.target(), size_px), frame)?;
    Ok(canvas.read(gpu)?)
}

/// Waits for the model and writes a picture of it; its format is that of the file's name.
///
/// # Errors
/// [`ViewerError`].
pub fn take(
    gpu: &Arc<Gpu>,
    shown: &mut dyn Shown,
    (mut view, look): (ViewControl, Look),
    (file, size_px, patience): (&Path, (u32, u32), Duration),
) -> Result<(), ViewerError> {
    let status = wait_for(shown, patience)?;
    if let Some(bounds) = &status.bounds {
        view.model_is_at(bounds);
    }
    let (arrays, weight_max) = (shown.arrays(gpu)?, shown.weight_max());
    let frame = Frame { view: &view, look: &look, status: &status, surfels: (&arrays, weight_max) };
    write(file, &draw(gpu, size_px, &frame)?)
}

/// Writes a picture; its format is that of the file's name.
///
/// # Errors
/// [`ViewerError::Picture`].
pub fn write(file: &Path, picture: &Rgb) -> Result<(), ViewerError> {
    let bytes: Vec<u8> = picture.pixels().iter().flatten().copied().collect();
    image::save_buffer(file, &bytes, picture.width(), picture.height(), image::ExtendedColorType::Rgb8)
        .map_err(|source| ViewerError::Picture { path: file.to_path_buf(), source })
}
