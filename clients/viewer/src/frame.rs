//! One frame: the model as each eye sees it, and over it what has to be said.

use std::sync::Arc;

use gpu::Gpu;
use render::{Coloring, DiscRenderer, Eye, Overlay, OverlayRenderer, Style, SurfelArrays, Target, Viewport};

use crate::shown::Status;
use crate::stereo::Stereo;
use crate::view_control::ViewControl;
use crate::{Message, ViewerError, text};

/// sRGB of what no surfel covers, as in the server's pictures.
const BACKGROUND: [u8; 3] = [18, 18, 22];
/// From the edges of the view to the banner.
const BANNER_MARGIN_PX: u32 = 16;

/// How the model is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// How surfels are coloured.
    pub coloring: Coloring,
    /// Whether each eye has a picture of its own.
    pub stereo: Stereo,
    /// Between the eyes; as far as is comfortable where none is given.
    pub eye_separation_m: Option<f64>,
    /// The model alone: no fading, no banner.
    pub plain: bool,
}

/// What a frame shows.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Where it is seen from.
    pub view: &'a ViewControl,
    /// How.
    pub look: &'a Look,
    /// What is known of the model.
    pub status: &'a Status,
    /// The model, and the weight of a surfel that is as sure as can be.
    pub surfels: (&'a SurfelArrays, f32),
}

/// Draws frames into targets of one format.
#[derive(Debug)]
pub struct FrameRenderer {
    gpu: Arc<Gpu>,
    discs: DiscRenderer,
    overlays: OverlayRenderer,
    /// The plate of the message and width for which it was made.
    banner: Option<(Message, u32, Overlay)>,
}

impl FrameRenderer {
    /// For targets of this format, which is without sRGB conversion.
    ///
    /// # Errors
    /// [`ViewerError::Gpu`].
    pub fn new(gpu: &Arc<Gpu>, format: wgpu::TextureFormat) -> Result<Self, ViewerError> {
        Ok(Self {
            discs: DiscRenderer::new(Arc::clone(gpu), format)?,
            overlays: OverlayRenderer::new(Arc::clone(gpu), format)?,
            gpu: Arc::clone(gpu),
            banner: None,
        })
    }

    /// Draws and submits a frame.
    ///
    /// # Errors
    /// [`ViewerError::Gpu`].
    pub fn draw(
        &mut self,
        (target, size_px): (Target, (u32, u32)),
        frame: &Frame,
    ) -> Result<(), ViewerError> {
        let Frame { view, look, status, surfels: (surfels, weight_max) } = *frame;
        let eye_size_px = look.stereo.eye_size_px(size_px);
        let camera = view.camera(eye_size_px, status.scope.as_ref());
        let eyes = look.stereo.eyes(&camera, size_px, look.eye_separation_m);
        let style = Style {
            coloring: look.coloring,
            weight_max,
            fade: if status.is_stale && !look.plain { 1.0 } else { 0.0 },
            background: BACKGROUND,
        };
        let slots = if status.is_hidden { 0 } else { surfels.slots };
        let shown = SurfelArrays { slots, ..surfels.clone() };
        let descriptor = wgpu::CommandEncoderDescriptor { label: Some("window") };
        let mut encoder = self.gpu.device().create_command_encoder(&descriptor);
        self.discs.draw(&mut encoder, target, (&eyes, &style), &shown)?;
        if let Some(message) = status.message.as_ref().filter(|_| !look.plain) {
            self.draw_banner(&mut encoder, (target.color, size_px), message, (&eyes, eye_size_px))?;
        }
        self.gpu.queue().submit([encoder.finish()]);
        Ok(self.gpu.health()?)
    }

    fn draw_banner(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        target: (&wgpu::TextureView, (u32, u32)),
        message: &Message,
        (eyes, eye_size_px): (&[Eye], (u32, u32)),
    ) -> Result<(), ViewerError> {
        let width_max_px = eye_size_px.0.saturating_sub(2 * BANNER_MARGIN_PX).max(1);
        let known = self.banner.take().filter(|(said, width, _)| (said, *width) == (message, width_max_px));
        let overlay = match known {
            Some((_, _, overlay)) => overlay,
            None => {
                let plate = text::plate(message, width_max_px);
                Overlay::new(&self.gpu, plate.size_px, &plate.rgba)?
            }
        };
        let places: Vec<_> =
            eyes.iter().map(|eye| banner_place(&eye.viewport, eye_size_px, overlay.size_px())).collect();
        self.overlays.draw(encoder, target, &overlay, &places)?;
        self.banner = Some((message.clone(), width_max_px, overlay));
        Ok(())
    }
}

/// In the middle of the upper edge, squeezed as the eye's picture is.
fn banner_place(viewport: &Viewport, eye_size_px: (u32, u32), (width, height): (u32, u32)) -> Viewport {
    let squeezed =
        |side_px: u32| (u64::from(side_px) * u64::from(viewport.width) / u64::from(eye_size_px.0)) as u32;
    let left = squeezed(eye_size_px.0.saturating_sub(width) / 2);
    Viewport { x: viewport.x + left, y: viewport.y + BANNER_MARGIN_PX, width: squeezed(width), height }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_banner_is_squeezed_with_the_eye_that_sees_it() {
        let right = Viewport { x: 320, y: 0, width: 320, height: 480 };
        let place = banner_place(&right, (640, 480), (200, 46));
        assert_eq!(place, Viewport { x: 320 + 110, y: BANNER_MARGIN_PX, width: 100, height: 46 });
    }
}
