//! CPU mirror of `follow_patches.wgsl` in double precision, and pictures whose motion is known.

use std::sync::Arc;

use geometry::{Pinhole, Pose};
use gpu::{FrameRecorder, Gpu, StageTimer};
use nalgebra::{Matrix2, Point3, UnitQuaternion, Vector2, Vector3};

use super::{FlowConfig, FlowParts, FlowSettings, PatchFlow};
use crate::testing::{Numbers, config, gpu};
use crate::view::View;
use crate::warp_solver::FrameBefore;
use crate::{DenseConfig, Observation};

const SIZES: [(u32, u32); 3] = [(97, 75), (64, 64), (33, 41)];
const DEPTH_M: f64 = 0.07;

/// Two pictures of a wall: the camera has moved a little, and the wall in itself.
struct Scene {
    gpu: Arc<Gpu>,
    config: DenseConfig,
    size: (u32, u32),
    then: View,
    now: View,
    depth: Vec<f32>,
    grey_then: Vec<f32>,
    grey_now: Vec<f32>,
}

/// Smooth texture without a period that a patch could slip by.
fn texture(at: Vector2<f64>) -> f64 {
    let wave = |x: f64, y: f64, phase: f64| (x * at.x + y * at.y + phase).sin();
    120.0
        + 25.0 * wave(0.55, 0.2, 0.0)
        + 22.0 * wave(-0.21, 0.62, 1.0)
        + 18.0 * wave(0.13, -0.17, 2.0)
        + 14.0 * wave(0.9, 0.8, 3.0)
}

/// How far the wall's own motion moves what was at a pixel, px.
fn own_motion(at: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(1.3 * (0.03 * at.y).sin() + 0.6, -0.9 * (0.04 * at.x).cos())
}

impl Scene {
    fn new(size: (u32, u32), seed: u64) -> Self {
        let pinhole = Pinhole {
            width_px: size.0,
            height_px: size.1,
            fx_px: 80.0,
            fy_px: 82.0,
            cx_px: f64::from(size.0) / 2.0 - 0.7,
            cy_px: f64::from(size.1) / 2.0 + 0.4,
        };
        let then = View { pinhole, world_from_camera: Pose::identity() };
        let rotation = UnitQuaternion::from_euler_angles(0.004, -0.006, 0.002);
        let moved = Pose::from_parts(Vector3::new(0.001, -0.0006, 0.0003).into(), rotation);
        let now = View { pinhole, world_from_camera: moved };
        let mut scene = Self {
            gpu: gpu(),
            config: config(),
            size,
            then,
            now,
            depth: vec![],
            grey_then: vec![],
            grey_now: vec![],
        };
        scene.config.flow.patches_max = 150;
        scene.paint(&mut Numbers::new(seed));
        scene
    }

    /// Paints both pictures; among their pixels are some that show no tissue, among the depths some that are none.
    fn paint(&mut self, numbers: &mut Numbers) {
        for number in 0..self.size.0 * self.size.1 {
            let at = Vector2::new(f64::from(number % self.size.0), f64::from(number / self.size.0));
            let strange = [f32::NAN, f32::INFINITY, 0.0, -1.0][number as usize % 4];
            let step = if at.x > 0.75 * f64::from(self.size.0) { 1.3 } else { 1.0 };
            self.depth.push(if number % 11 == 10 { strange } else { (DEPTH_M * step) as f32 });
            let hidden = |number: u32| (number / 7) % 61 == 60;
            let shown = |value: f64| value as f32;
            self.grey_then.push(if hidden(number) { -1.0 } else { shown(texture(at) + numbers.next()) });
            let was = self.came_from(at);
            let light = 6.0;
            self.grey_now.push(if hidden(number + 13) { -1.0 } else { shown(texture(was) + light) });
        }
    }

    /// Where what is at a pixel now was then: the inverse of `goes_to`, by iteration.
    fn came_from(&self, at: Vector2<f64>) -> Vector2<f64> {
        (0..30).fold(at, |was, _| was + (at - self.goes_to(was)))
    }

    fn expected(&self, was: Vector2<f64>, depth_m: f64) -> Option<Vector2<f64>> {
        let camera = &self.then.pinhole;
        let point = Point3::new(
            (was.x - camera.cx_px) / camera.fx_px * depth_m,
            (was.y - camera.cy_px) / camera.fy_px * depth_m,
            depth_m,
        );
        let seen = self.now.world_from_camera.inverse() * (self.then.world_from_camera * point);
        let at = Vector2::new(
            seen.x / seen.z * camera.fx_px + camera.cx_px,
            seen.y / seen.z * camera.fy_px + camera.cy_px,
        );
        let inside = |at: f64, extent: u32| at.round() >= 0.0 && at.round() < f64::from(extent);
        (inside(at.x, self.size.0) && inside(at.y, self.size.1)).then_some(at)
    }

    fn goes_to(&self, was: Vector2<f64>) -> Vector2<f64> {
        let camera = &self.then.pinhole;
        let point =
            Vector3::new((was.x - camera.cx_px) / camera.fx_px, (was.y - camera.cy_px) / camera.fy_px, 1.0)
                * DEPTH_M;
        let seen = self.now.world_from_camera.inverse() * Point3::from(point);
        Vector2::new(
            seen.x / seen.z * camera.fx_px + camera.cx_px,
            seen.y / seen.z * camera.fy_px + camera.cy_px,
        ) + own_motion(was)
    }

    /// What the kernel finds.
    fn found(&self, usable: bool) -> Vec<[f32; 4]> {
        let gpu = &self.gpu;
        let observation = Observation::new(gpu, self.size.0, self.size.1).unwrap();
        let before = FrameBefore::new(gpu, &observation, &self.config).unwrap();
        gpu.write(&observation.grey, 0, &self.grey_now).unwrap();
        gpu.write(&before.grey, 0, &self.grey_then).unwrap();
        gpu.write(&before.depth, 0, &self.depth).unwrap();
        gpu.write(&before.view, 0, &[self.then.to_gpu()]).unwrap();
        let view = gpu.uniform("view", &self.now.to_gpu()).unwrap();
        let parts = FlowParts { view: &view, grey: &observation.grey, before: &before };
        let mut flow = PatchFlow::new(gpu, &self.config.flow, self.size, &parts).unwrap();
        flow.prepare(gpu, usable).unwrap();
        let timer = StageTimer::new(gpu, 1).unwrap();
        let mut frame = FrameRecorder::begin(gpu, &timer);
        flow.record(&mut frame).unwrap();
        frame.submit().collect().unwrap();
        gpu.read(&before.matches).unwrap()[..before.patches as usize].to_vec()
    }

    fn grey(picture: &[f32], (width, height): (u32, u32), x: i64, y: i64) -> Option<f64> {
        let inside = (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y);
        let value = inside.then(|| f64::from(picture[(y * i64::from(width) + x) as usize]))?;
        (value >= 0.0).then_some(value)
    }

    fn now(&self, at: Vector2<f64>) -> Option<f64> {
        let (x, y) = (at.x.floor(), at.y.floor());
        let value = |dx: i64, dy: i64| Self::grey(&self.grey_now, self.size, x as i64 + dx, y as i64 + dy);
        let (u, v) = (at.x - x, at.y - y);
        let left = value(0, 0)? * (1.0 - v) + value(0, 1)? * v;
        let right = value(1, 0)? * (1.0 - v) + value(1, 1)? * v;
        Some(left * (1.0 - u) + right * u)
    }

    /// One linearisation: the way, what is left, the contrast.
    fn linearise(
        &self,
        centre: (i64, i64),
        shift: Vector2<f64>,
        spread: i64,
    ) -> Option<(Vector2<f64>, f64, f64)> {
        let radius = i64::from(self.config.flow.radius);
        let then = |x, y| Self::grey(&self.grey_then, self.size, x, y);
        let (mut count, mut error, mut square) = (0.0, 0.0, 0.0);
        let (mut sum, mut normal, mut right) = (Vector2::zeros(), Matrix2::zeros(), Vector2::zeros());
        for (u, v) in (-radius..=radius).flat_map(|v| (-radius..=radius).map(move |u| (u, v))) {
            let (x, y) = (centre.0 + spread * u, centre.1 + spread * v);
            let sample = || {
                let corners = [(x - spread, y - spread), (x + spread, y + spread)];
                let whole = |x: i64, y: i64| {
                    (0..i64::from(self.size.0)).contains(&x) && (0..i64::from(self.size.1)).contains(&y)
                };
                corners.iter().all(|&(x, y)| whole(x, y)).then_some(())?;
                let depth =
                    |(x, y): (i64, i64)| f64::from(self.depth[(y * i64::from(self.size.0) + x) as usize]);
                let way = spread as f64 * ((u * u + v * v) as f64).sqrt() / self.then.pinhole.fx_px;
                let near = depth(centre) * (0.03 + 1.5 * way);
                ((depth((x, y)) - depth(centre)).abs() <= near).then_some(())?;
                let across = then(x + spread, y)? - then(x - spread, y)?;
                let down = then(x, y + spread)? - then(x, y - spread)?;
                let off = self.now(Vector2::new(x as f64, y as f64) + shift)? - then(x, y)?;
                Some((Vector2::new(across, down) / (2.0 * spread as f64), off))
            };
            let Some((gradient, off)) = sample() else { continue };
            count += 1.0;
            error += off;
            square += off * off;
            sum += gradient;
            normal += gradient * gradient.transpose();
            right += off * gradient;
        }
        if count < 0.7 * ((2 * radius + 1) * (2 * radius + 1)) as f64 {
            return None;
        }
        normal -= sum * sum.transpose() / count;
        right -= sum * (error / count);
        let contrast = normal.symmetric_eigenvalues().min();
        if contrast <= 1e-3 * count {
            return None;
        }
        let way = -(normal.try_inverse()? * right);
        let bounded = way * (2.0 * spread as f64 / way.norm().max(1e-6)).min(1.0);
        Some((bounded, (square - error * error / count).max(0.0) / count, contrast))
    }

    /// What the kernel should find at a patch, and whether rounding may decide otherwise.
    fn mirrored(&self, centre: (i64, i64)) -> (Option<Vector2<f64>>, bool) {
        let FlowConfig { steps, spread_max_px, reach_px, misfit_max, .. } = self.config.flow;
        let depth = self.depth[(centre.1 * i64::from(self.size.0) + centre.0) as usize];
        if !depth.is_finite() || depth <= 0.0 {
            return (None, false);
        }
        let from = Vector2::new(centre.0 as f64, centre.1 as f64);
        let Some(start) = self.expected(from, f64::from(depth)) else { return (None, false) };
        let first = start - from;
        let (mut shift, mut last, mut close) = (first, None, false);
        for spread in [4, 2, 1] {
            for _ in 0..steps {
                last = self.linearise(centre, shift, spread);
                let Some((way, ..)) = last else { break };
                shift += way;
                close |= (way.norm() - 0.02).abs() < 2e-3;
                if way.norm() < 0.02 {
                    break;
                }
            }
        }
        let Some((way, misfit, contrast)) = last else { return (None, close) };
        let limits = [
            (way.norm(), 0.1),
            ((shift - first).norm(), reach_px),
            (misfit.sqrt(), misfit_max),
            (((misfit + 1.0) / contrast).sqrt(), spread_max_px),
        ];
        close |= limits.iter().any(|&(value, limit)| (value - limit).abs() < 0.02 * limit);
        let holds = limits.iter().all(|(value, limit)| value <= limit);
        (holds.then_some(from + shift), close)
    }

    fn centres(&self) -> Vec<(i64, i64)> {
        let FlowSettings { columns, rows, spacing, .. } = FlowSettings::new(&self.config.flow, self.size);
        let place = |cell: u32| i64::from(cell * spacing + spacing / 2);
        (0..columns * rows).map(|patch| (place(patch % columns), place(patch / columns))).collect()
    }
}

#[test]
fn patches_are_followed_as_the_mirror_does() {
    for (seed, size) in SIZES.into_iter().enumerate() {
        let scene = Scene::new(size, seed as u64 + 3);
        let found = scene.found(true);
        let centres = scene.centres();
        assert_eq!(found.len(), centres.len());
        let (mut compared, mut followed) = (0, 0);
        for (&row, &centre) in found.iter().zip(&centres) {
            let (expected, close) = scene.mirrored(centre);
            if close {
                continue;
            }
            compared += 1;
            match expected {
                None => assert_eq!(row, [-2.0; 4], "{centre:?} of {size:?}"),
                Some(at) => {
                    followed += 1;
                    let off = (Vector2::new(f64::from(row[2]), f64::from(row[3])) - at).norm();
                    assert!(off < 0.02, "{centre:?} of {size:?}: {row:?}, expected {at:?}");
                    assert_eq!([row[0], row[1]], [centre.0 as f32, centre.1 as f32]);
                }
            }
        }
        eprintln!("{size:?}: {compared} of {} compared, {followed} followed", centres.len());
        assert!(compared * 2 > centres.len() && followed * 8 > centres.len());
    }
}

#[test]
fn followed_patches_are_where_the_tissue_went() {
    let scene = Scene::new((97, 75), 9);
    let mut off: Vec<f64> = Vec::new();
    for row in scene.found(true).into_iter().filter(|row| row[0] >= 0.0) {
        let [x, y, to_x, to_y] = row.map(f64::from);
        off.push((Vector2::new(to_x, to_y) - scene.goes_to(Vector2::new(x, y))).norm());
    }
    off.sort_by(f64::total_cmp);
    eprintln!(
        "{} patches, median {:.3} px, largest {:.3} px",
        off.len(),
        off[off.len() / 2],
        off[off.len() - 1]
    );
    assert!(off.len() > 40 && off[off.len() / 2] < 0.05);
}

#[test]
fn nothing_is_followed_where_the_last_picture_does_not_count() {
    let mut scene = Scene::new((64, 64), 4);
    assert!(scene.found(false).iter().all(|row| *row == [-2.0; 4]));
    let pixels = scene.depth.len();
    for strange in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
        scene.depth = vec![strange; pixels];
        assert!(scene.found(true).iter().all(|row| *row == [-2.0; 4]), "depth {strange}");
    }
}

#[test]
fn pictures_without_texture_or_without_tissue_give_no_match() {
    let mut scene = Scene::new((64, 64), 5);
    let pixels = scene.depth.len();
    for flat in [120.0, -1.0, f32::NAN, f32::INFINITY] {
        (scene.grey_then, scene.grey_now) = (vec![flat; pixels], vec![flat; pixels]);
        assert!(scene.found(true).iter().all(|row| *row == [-2.0; 4]), "grey {flat}");
    }
}

#[test]
fn the_grid_has_no_more_patches_than_allowed() {
    let allowed = |patches_max: u32, size| {
        let (spacing, [columns, rows]) = FlowConfig { patches_max, ..config().flow }.grid(size);
        assert!(columns * rows <= patches_max && spacing >= 2, "{patches_max} at {size:?}");
        columns * rows
    };
    assert_eq!(allowed(0, (640, 480)), 0);
    assert!(allowed(2000, (640, 480)) > 1500);
    assert_eq!(allowed(1, (7, 5)), 1);
    allowed(3, (1, 1));
}
