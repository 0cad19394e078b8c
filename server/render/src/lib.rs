//! Draws surfels as oriented, shaded, depth-tested discs, into a window or a picture.
//!
//! [`DiscRenderer`] reads [`SurfelArrays`] in the layout of the dense model, so it draws a model from the very buffers
//! that it lives in, or from rows that a viewer uploaded ([`SurfelUpload`]). [`OverlayRenderer`] lays a picture of text
//! over it, and [`Canvas`] is a target that can be read back.

mod canvas;
mod discs;
mod overlay;
mod surfels;
mod target;

pub use canvas::Canvas;
pub use discs::{Coloring, DiscRenderer, Eye, Style, Viewport};
pub use overlay::{Overlay, OverlayRenderer};
pub use surfels::{SurfelArrays, SurfelRow, SurfelUpload};
pub use target::{DepthBuffer, Target};
