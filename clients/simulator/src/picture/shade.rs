//! Light, depth and motion of every pixel of one eye.

use geometry::{DepthMap, Pinhole, Pose, Raster};
use nalgebra::{Point3, Vector2, Vector3};
use rayon::prelude::*;

use super::light::{Lit, ScopeLight};
use super::visibility::{Hit, VisibilityBuffer};
use super::{Radiance, motion_blur};
use crate::scene::Scene;
use crate::texture::Colour;

/// Grazing surfaces are compressed at most this much when the footprint is judged.
const COSINE_MIN: f32 = 0.12;

/// The scene at one instant, seen by one eye.
pub(crate) struct Shot<'a> {
    pub scene: &'a Scene,
    pub positions: &'a [Point3<f64>],
    pub normals: &'a [Vector3<f32>],
    pub camera: &'a Pinhole,
    /// In the middle of the exposure: the pose of the truth.
    pub camera_from_world: Pose,
    /// When the shutter opens and closes.
    pub shutter: [Pose; 2],
    pub light: &'a ScopeLight,
}

struct Pixel {
    radiance: Colour,
    depth_m: f32,
    motion_px: Vector2<f32>,
}

/// The eye's light with motion blur, and its depth.
pub(crate) fn shade(shot: &Shot<'_>) -> (Radiance, DepthMap) {
    let view = VisibilityBuffer::new(shot.positions, &shot.scene.faces, &shot.camera_from_world, shot.camera);
    let (width, height) = (shot.camera.width_px, shot.camera.height_px);
    let eye_m = shot.camera_from_world.inverse().translation.vector.into();
    let dark = || Pixel { radiance: Colour::zeros(), depth_m: 0.0, motion_px: Vector2::zeros() };
    let mut pixels: Vec<Pixel> = (0..width * height).map(|_| dark()).collect();
    pixels.par_chunks_mut(width as usize).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            if let Some(hit) = view.hit(&shot.scene.faces, x as u32, y as u32) {
                *pixel = shot.pixel(&hit, &eye_m);
            }
        }
    });
    let raster = |x: u32, y: u32| &pixels[y as usize * width as usize + x as usize];
    let sharp = Radiance::from_fn(width, height, |x, y| raster(x, y).radiance);
    let depth = DepthMap::from_fn(width, height, |x, y| raster(x, y).depth_m);
    let motion = Raster::from_fn(width, height, |x, y| raster(x, y).motion_px);
    (motion_blur::blur(sharp, &motion), depth)
}

impl Shot<'_> {
    fn pixel(&self, hit: &Hit, eye_m: &Point3<f64>) -> Pixel {
        let corners = self.scene.faces[hit.face as usize].map(|i| i as usize);
        let vertices = corners.map(|i| self.scene.vertices[i]);
        let weight = hit.barycentric;
        let share = weight.map(|w| w as f32);
        let sum =
            |point: [Vector3<f64>; 3]| point[0] * weight[0] + point[1] * weight[1] + point[2] * weight[2];
        let at_m = Point3::from(sum(corners.map(|i| self.positions[i].coords)));
        let rest_mm = Point3::from(sum(vertices.map(|v| v.position_m.coords)) * 1e3);
        let along = |values: [f32; 3]| values[0] * share[0] + values[1] * share[1] + values[2] * share[2];
        let [a, b, c] = corners.map(|i| self.normals[i]);
        let normal = (a * share[0] + b * share[1] + c * share[2]).normalize();

        let to_camera: Vector3<f32> = (eye_m - at_m).normalize().cast();
        let cosine = normal.dot(&to_camera).max(COSINE_MIN);
        let footprint_mm = (hit.depth_m * 1e3 / self.camera.fx_px) as f32 / cosine.sqrt();
        let texture = &self.scene.textures[usize::from(vertices[0].organ)];
        let overlay = along(vertices.map(|v| v.overlay));
        let surface = texture.at(&self.scene.lattice, &rest_mm, overlay, footprint_mm);
        let slope = surface.height_gradient - normal * normal.dot(&surface.height_gradient);
        let bumpy = (normal - slope).normalize();
        let occlusion = along(vertices.map(|v| v.occlusion));
        let lit = Lit { at_m, normals: [normal, bumpy], to_camera, occlusion, surface: &surface };
        Pixel {
            radiance: self.light.radiance(&lit),
            depth_m: hit.depth_m as f32,
            motion_px: self.motion_px(&at_m),
        }
    }

    /// How far the place moves on the picture while the shutter is open.
    ///
    /// The camera's motion only: tissue moves by less than a tenth of a millimetre meanwhile.
    fn motion_px(&self, at_m: &Point3<f64>) -> Vector2<f32> {
        let [opens, closes] =
            self.shutter.map(|camera_from_world| self.camera.project(&(camera_from_world * at_m)));
        (closes - opens).cast()
    }
}
