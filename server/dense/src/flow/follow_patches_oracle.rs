//! CPU mirror of `follow_patches.wgsl` in double precision, and pictures whose motion is known.

use std::sync::Arc;

use geometry::{Pinhole, Pose};
use gpu::{FrameRecorder, Gpu, StageTimer};
use nalgebra::{Matrix2, Point3, UnitQuaternion, Vector2, Vector3};

use super::{FlowConfig, FlowParts, FlowSettings, Keyframe, PatchFlow};
use crate::store::Row;
use crate::testing::{Numbers, config, gpu};
use crate::view::View;
use crate::{DenseConfig, Observation};

const SIZES: [(u32, u32); 3] = [(97, 75), (64, 64), (33, 41)];
const DEPTH_M: f64 = 0.07;
/// What a match of no patch is.
const NOWHERE: Row = [-2.0; 4];

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

/// Where a patch is looked for.
struct Place {
    distortion: Matrix2<f64>,
    middle: Vector2<f64>,
}

struct Sample {
    gradient: Vector2<f64>,
    level: f64,
    off: f64,
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
            let lit = 1.08 * texture(was) + 6.0;
            self.grey_now.push(if hidden(number + 13) { -1.0 } else { shown(lit) });
        }
    }

    /// Where what is at a pixel now was then: the inverse of `goes_to`, by iteration.
    fn came_from(&self, at: Vector2<f64>) -> Vector2<f64> {
        (0..30).fold(at, |was, _| was + (at - self.goes_to(was)))
    }

    fn patches(&self) -> FlowSettings {
        FlowSettings::new(&self.config.flow, self.size)
    }

    fn depth_at(&self, (x, y): (i64, i64)) -> f64 {
        f64::from(self.depth[(y * i64::from(self.size.0) + x) as usize])
    }

    /// The tissue of each patch, which has not moved since the keyframe as far as the warp knows.
    fn tissue(&self) -> Vec<Row> {
        let camera = &self.then.pinhole;
        let lifted = |&(x, y): &(i64, i64)| {
            let z = self.depth_at((x, y));
            if !z.is_finite() || z <= 0.0 {
                return [0.0; 4];
            }
            let across = Vector3::new(
                (x as f64 - camera.cx_px) / camera.fx_px,
                (y as f64 - camera.cy_px) / camera.fy_px,
                1.0,
            );
            let point = self.then.world_from_camera * Point3::from(z * across);
            [point.x as f32, point.y as f32, point.z as f32, 1.0]
        };
        self.centres().iter().map(lifted).collect()
    }

    fn seen_at(&self, tissue: &Row) -> Option<Vector2<f64>> {
        let [x, y, z, known] = tissue.map(f64::from);
        if known == 0.0 {
            return None;
        }
        let at = self.now.pinhole.project(&(self.now.world_from_camera.inverse() * Point3::new(x, y, z)));
        let inside = |at: f64, extent: u32| at.round() >= 0.0 && at.round() < f64::from(extent);
        (inside(at.x, self.size.0) && inside(at.y, self.size.1)).then(|| Vector2::new(at.x, at.y))
    }

    fn on_surface(&self, centre: (i64, i64), (u, v): (i64, i64)) -> bool {
        let way = ((u * u + v * v) as f64).sqrt() / self.then.pinhole.fx_px;
        let (here, there) = (self.depth_at(centre), self.depth_at((centre.0 + u, centre.1 + v)));
        (there - here).abs() <= here * (0.03 + 1.5 * way)
    }

    /// What a pixel has become along x or y.
    fn stretched(&self, tissue: &[Row], patch: usize, along: (i64, i64)) -> Vector2<f64> {
        let FlowSettings { columns, rows, spacing, .. } = self.patches();
        let (column, row) = (patch as i64 % i64::from(columns), patch as i64 / i64::from(columns));
        let centre = self.centres()[patch];
        let neighbour = |side: i64| {
            let (column, row) = (column + side * along.0, row + side * along.1);
            let inside = (0..i64::from(columns)).contains(&column) && (0..i64::from(rows)).contains(&row);
            let offset = (side * i64::from(spacing) * along.0, side * i64::from(spacing) * along.1);
            (inside && self.on_surface(centre, offset))
                .then(|| self.seen_at(&tissue[(row * i64::from(columns) + column) as usize]))
                .flatten()
        };
        let undistorted = Vector2::new(along.0 as f64, along.1 as f64);
        let (Some(own), behind, ahead) = (self.seen_at(&tissue[patch]), neighbour(-1), neighbour(1)) else {
            return undistorted;
        };
        let steps = f64::from(u32::from(behind.is_some()) + u32::from(ahead.is_some()));
        let change = (ahead.unwrap_or(own) - behind.unwrap_or(own)) / (steps.max(1.0) * f64::from(spacing));
        if steps > 0.0 && (change - undistorted).norm() < 0.5 { change } else { undistorted }
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
    fn found(&self, usable: bool) -> Vec<Row> {
        let gpu = &self.gpu;
        let observation = Observation::new(gpu, self.size.0, self.size.1).unwrap();
        let keyframe = Keyframe::new(gpu, &observation, &self.config).unwrap();
        gpu.write(&observation.grey, 0, &self.grey_then).unwrap();
        gpu.write(&observation.depth, 0, &self.depth).unwrap();
        self.run(&observation, &keyframe, |flow, frame| {
            flow.record_keyframe(frame, &keyframe, &observation).unwrap();
        });
        gpu.write(&observation.grey, 0, &self.grey_now).unwrap();
        gpu.write(&keyframe.tissue.rows, 0, &self.tissue()).unwrap();
        self.run(&observation, &keyframe, |flow, frame| {
            flow.prepare(gpu, usable).unwrap();
            flow.record(frame).unwrap();
        })
    }

    /// What the kernel takes the tissue of this frame's patches to be.
    fn lifted(&self) -> Vec<Row> {
        let gpu = &self.gpu;
        let observation = Observation::new(gpu, self.size.0, self.size.1).unwrap();
        let keyframe = Keyframe::new(gpu, &observation, &self.config).unwrap();
        gpu.write(&observation.depth, 0, &self.depth).unwrap();
        self.run(&observation, &keyframe, |flow, frame| {
            flow.record_keyframe(frame, &keyframe, &observation).unwrap();
        });
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<u32>>();
        assert_eq!(bits(&gpu.read(&keyframe.depth).unwrap()), bits(&self.depth));
        gpu.read(&keyframe.tissue.rows).unwrap()
    }

    /// Runs passes and reads the matches.
    fn run(
        &self,
        observation: &Observation,
        keyframe: &Keyframe,
        record: impl FnOnce(&mut PatchFlow, &mut FrameRecorder),
    ) -> Vec<Row> {
        let gpu = &self.gpu;
        let view = gpu.uniform("view", &self.now.to_gpu()).unwrap();
        let refined = gpu.storage_from("refined view", &[self.then.to_gpu()]).unwrap();
        let matches = gpu.storage("matches", keyframe.patches as usize).unwrap();
        let parts = FlowParts { view: &view, refined: &refined, observation, keyframe, matches: &matches };
        let mut flow = PatchFlow::new(gpu, &self.config.flow, &parts).unwrap();
        let timer = StageTimer::new(gpu, 2).unwrap();
        let mut frame = FrameRecorder::begin(gpu, &timer);
        record(&mut flow, &mut frame);
        frame.submit().collect().unwrap();
        gpu.read(&matches).unwrap()
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

    /// The grey value of a sample then about the middle's, its gradient, and the difference of now.
    fn sample(&self, centre: (i64, i64), place: &Place, offset: (i64, i64), spread: i64) -> Option<Sample> {
        let then = |x, y| Self::grey(&self.grey_then, self.size, x, y);
        let (x, y) = (centre.0 + offset.0, centre.1 + offset.1);
        let corners = [(x - spread, y - spread), (x + spread, y + spread)];
        let whole = |(x, y): (i64, i64)| {
            (0..i64::from(self.size.0)).contains(&x) && (0..i64::from(self.size.1)).contains(&y)
        };
        (corners.into_iter().all(whole) && self.on_surface(centre, offset)).then_some(())?;
        let across = then(x + spread, y)? - then(x - spread, y)?;
        let down = then(x, y + spread)? - then(x, y - spread)?;
        let now =
            self.now(place.middle + place.distortion * Vector2::new(offset.0 as f64, offset.1 as f64))?;
        Some(Sample {
            gradient: Vector2::new(across, down) / (2.0 * spread as f64),
            level: then(x, y)?,
            off: now - then(x, y)?,
        })
    }

    /// One linearisation: the way, what is left, the contrast.
    fn linearise(&self, centre: (i64, i64), place: &Place, spread: i64) -> Option<(Vector2<f64>, f64, f64)> {
        let radius = i64::from(self.config.flow.radius);
        let side = 2 * radius + 1;
        let samples: Vec<Sample> = (0..side * side)
            .map(|number| (spread * (number % side - radius), spread * (number / side - radius)))
            .filter_map(|offset| self.sample(centre, place, offset, spread))
            .collect();
        let count = samples.len() as f64;
        if count < 0.7 * (side * side) as f64 {
            return None;
        }
        // least squares over the way, a gain and a bias, the last two taken out first
        let mean = |value: &dyn Fn(&Sample) -> f64| samples.iter().map(value).sum::<f64>() / count;
        let (level, off) = (mean(&|sample| sample.level), mean(&|sample| sample.off));
        let gradient = Vector2::new(mean(&|sample| sample.gradient.x), mean(&|sample| sample.gradient.y));
        let levels = samples.iter().map(|sample| (sample.level - level).powi(2)).sum::<f64>();
        let by_level = |value: &dyn Fn(&Sample) -> f64| {
            let product = samples.iter().map(|sample| (sample.level - level) * value(sample)).sum::<f64>();
            if levels > count { product / levels } else { 0.0 }
        };
        let off_gain = by_level(&|sample| sample.off - off);
        let gradient_gain = Vector2::new(
            by_level(&|sample| sample.gradient.x - gradient.x),
            by_level(&|sample| sample.gradient.y - gradient.y),
        );
        let (mut normal, mut right, mut square) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
        for sample in &samples {
            let own = sample.gradient - gradient - gradient_gain * (sample.level - level);
            let error = sample.off - off - off_gain * (sample.level - level);
            normal += own * own.transpose();
            right += error * own;
            square += error * error;
        }
        let contrast = normal.symmetric_eigenvalues().min();
        if contrast <= 1e-3 * count {
            return None;
        }
        let way = -(normal.try_inverse()? * right);
        let bounded = way * (2.0 * spread as f64 / way.norm().max(1e-6)).min(1.0);
        Some((place.distortion * bounded, square / count, contrast))
    }

    /// What the kernel should find at a patch, and whether rounding may decide otherwise.
    fn mirrored(&self, tissue: &[Row], patch: usize) -> (Option<Vector2<f64>>, bool) {
        let FlowConfig { steps, spread_max_px, reach_px, misfit_max, .. } = self.config.flow;
        let centre = self.centres()[patch];
        let Some(first) = self.seen_at(&tissue[patch]) else { return (None, false) };
        let columns = [(1, 0), (0, 1)].map(|along| self.stretched(tissue, patch, along));
        let mut place = Place { distortion: Matrix2::from_columns(&columns), middle: first };
        let (mut last, mut close) = (None, false);
        for spread in [4, 2, 1] {
            for _ in 0..steps {
                last = self.linearise(centre, &place, spread);
                let Some((way, ..)) = last else { break };
                place.middle += way;
                close |= (way.norm() - 0.02).abs() < 2e-3;
                if way.norm() < 0.02 {
                    break;
                }
            }
        }
        let Some((way, misfit, contrast)) = last else { return (None, close) };
        let limits = [
            (way.norm(), 0.1),
            ((place.middle - first).norm(), reach_px),
            (misfit.sqrt(), misfit_max),
            (((misfit + 1.0) / contrast).sqrt(), spread_max_px),
        ];
        close |= limits.iter().any(|&(value, limit)| (value - limit).abs() < 0.02 * limit);
        let holds = limits.iter().all(|(value, limit)| value <= limit);
        (holds.then_some(place.middle), close)
    }

    fn centres(&self) -> Vec<(i64, i64)> {
        let FlowSettings { columns, rows, spacing, .. } = self.patches();
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
        let tissue = scene.tissue();
        for (patch, (&row, &centre)) in found.iter().zip(&centres).enumerate() {
            let (expected, close) = scene.mirrored(&tissue, patch);
            if close {
                continue;
            }
            compared += 1;
            match expected {
                None => assert_eq!(row, NOWHERE, "{centre:?} of {size:?}"),
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
fn the_tissue_of_a_patch_is_what_its_middle_shows() {
    for (seed, size) in SIZES.into_iter().enumerate() {
        let scene = Scene::new(size, seed as u64 + 30);
        let (lifted, expected) = (scene.lifted(), scene.tissue());
        assert_eq!(lifted.len(), expected.len());
        assert!(expected.iter().any(|row| row[3] == 0.0) && expected.iter().any(|row| row[3] == 1.0));
        for (found, expected) in lifted.iter().zip(&expected) {
            let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(off < 1e-7, "{found:?}, expected {expected:?}");
        }
    }
}

#[test]
fn nothing_is_followed_without_a_keyframe_or_where_it_shows_no_depth() {
    let mut scene = Scene::new((64, 64), 4);
    assert!(scene.found(false).iter().all(|row| *row == NOWHERE));
    let pixels = scene.depth.len();
    for strange in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
        scene.depth = vec![strange; pixels];
        assert!(scene.found(true).iter().all(|row| *row == NOWHERE), "depth {strange}");
    }
}

#[test]
fn pictures_without_texture_or_without_tissue_give_no_match() {
    let mut scene = Scene::new((64, 64), 5);
    let pixels = scene.depth.len();
    for flat in [120.0, -1.0, f32::NAN, f32::INFINITY] {
        (scene.grey_then, scene.grey_now) = (vec![flat; pixels], vec![flat; pixels]);
        assert!(scene.found(true).iter().all(|row| *row == NOWHERE), "grey {flat}");
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
