//! From a deformed scene and a camera to pixels: visibility, light, motion blur, sensor.

mod light;
mod motion_blur;
mod sensor;
mod shade;
mod visibility;

pub(crate) use light::ScopeLight;
pub(crate) use sensor::{Sensor, exposure_gain};
pub(crate) use shade::{Shot, shade};
pub(crate) use visibility::{VisibilityBuffer, thumbnail_camera};

use geometry::Raster;

use crate::texture::Colour;

/// Linear light per pixel before exposure.
pub(crate) type Radiance = Raster<Colour>;
