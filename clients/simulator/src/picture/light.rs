//! The scope's light: two guides beside the lenses, near enough that distance and angle matter.

use geometry::Pose;
use nalgebra::{Point3, Vector3};

use crate::texture::{Colour, SurfacePoint};

/// Guides lie this far to both sides of the middle between the eyes, and this far above it.
const GUIDE_ASIDE_M: f64 = 4.0e-3;
const GUIDE_ABOVE_M: f64 = 2.5e-3;
/// Light of one guide at 60 mm is 1.
const REFERENCE_DISTANCE_M: f64 = 0.06;
/// How much further red light travels inside tissue than the bumps are wide, against green and blue.
const BUMPS_SEEN: [f32; 3] = [0.45, 0.85, 1.0];
/// Light that comes back from the walls all around, as a share of the direct light.
const AMBIENT: f32 = 0.10;
/// Exponents of the mirror lobes: the wet film, and the rougher tissue under it.
const FILM_EXPONENT: f32 = 340.0;
const TISSUE_EXPONENT: i32 = 20;
const FILM_STRENGTH: f32 = 0.030;
const TISSUE_STRENGTH: f32 = 0.022;

/// Both guides in the world.
pub(crate) struct ScopeLight {
    guides_m: [Point3<f64>; 2],
    axis: Vector3<f64>,
    highlights: bool,
}

/// The place that is lit.
pub(crate) struct Lit<'a> {
    pub at_m: Point3<f64>,
    /// Of the mesh, and of the mesh with its bumps.
    pub normals: [Vector3<f32>; 2],
    /// Unit, from the place to the camera.
    pub to_camera: Vector3<f32>,
    pub occlusion: f32,
    pub surface: &'a SurfacePoint,
}

impl ScopeLight {
    pub fn new(world_from_left: &Pose, baseline_m: f64, highlights: bool) -> Self {
        let guide = |side: f64| {
            let in_left = Point3::new(0.5 * baseline_m + side * GUIDE_ASIDE_M, -GUIDE_ABOVE_M, 0.0);
            world_from_left * in_left
        };
        let axis = world_from_left * Vector3::z();
        Self { guides_m: [guide(-1.0), guide(1.0)], axis, highlights }
    }

    /// Light that the place sends to the camera.
    pub fn radiance(&self, lit: &Lit<'_>) -> Colour {
        self.guides_m.iter().map(|guide| self.light_by(guide, lit)).sum()
    }

    fn light_by(&self, guide_m: &Point3<f64>, lit: &Lit<'_>) -> Colour {
        let to_light = guide_m - lit.at_m;
        let distance = to_light.norm();
        let direction: Vector3<f32> = (to_light / distance).cast();
        let off_axis = (-self.axis.dot(&to_light) / distance).max(0.0) as f32;
        let arriving = (REFERENCE_DISTANCE_M / distance).powi(2) as f32 * off_axis * off_axis;
        let softness = 0.25 * lit.surface.softness;
        let wrap = |cosine: f32| ((cosine + softness) / (1.0 + softness)).max(0.0);
        let [smooth, bumpy] = lit.normals.map(|normal| normal.dot(&direction));
        let open = 1.0 - lit.occlusion;
        let mut out = Colour::zeros();
        for channel in 0..3 {
            let cosine = wrap(smooth + (bumpy - smooth) * BUMPS_SEEN[channel]);
            // between red walls light turns red: what is occluded loses least red
            let ambient = AMBIENT * open.powi(channel as i32 + 1);
            let direct = cosine * (0.55 + 0.45 * open);
            out[channel] = lit.surface.albedo[channel] * (direct + ambient) * arriving;
        }
        out.add_scalar(arriving * self.mirrored(lit, &direction) * open)
    }

    /// Blinn's lobes, normalised, with Schlick's rise towards grazing angles.
    fn mirrored(&self, lit: &Lit<'_>, to_light: &Vector3<f32>) -> f32 {
        if !self.highlights || lit.surface.wetness <= 0.0 {
            return 0.0;
        }
        let half = (to_light + lit.to_camera).normalize();
        let cosine = lit.normals[1].dot(&half).max(0.0);
        let grazing = (1.0 - half.dot(&lit.to_camera)).max(0.0);
        let fresnel = 1.0 + 20.0 * grazing.powi(5);
        let film = if cosine > 0.9 { (FILM_EXPONENT + 8.0) / 8.0 * cosine.powf(FILM_EXPONENT) } else { 0.0 };
        let tissue = (TISSUE_EXPONENT as f32 + 8.0) / 8.0 * cosine.powi(TISSUE_EXPONENT);
        lit.surface.wetness * fresnel * (FILM_STRENGTH * film + TISSUE_STRENGTH * tissue)
    }
}
