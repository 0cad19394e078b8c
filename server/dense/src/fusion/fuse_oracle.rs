//! CPU mirror of `fuse.wgsl`.

use nalgebra::{Point3, Vector3};

use super::fuse;
use crate::store::{ALIVE, SurfelRows};
use crate::testing::{Fixture, SLOTS, TONE};
use crate::tone::Tone;
use crate::tone::tone_oracle::falloff;

/// What a surfel becomes: its rows, and how near it came to one of the decisions (relative to their limits).
struct Fused {
    geometry: [f64; 4],
    orientation: [f64; 4],
    appearance: [f64; 4],
    seen: bool,
    close_call: bool,
}

fn depth_at(fixture: &Fixture, x: i64, y: i64) -> f64 {
    let (width, height) =
        (i64::from(fixture.view.pinhole.width_px), i64::from(fixture.view.pinhole.height_px));
    let inside = x >= 0 && y >= 0 && x < width && y < height;
    if inside { f64::from(fixture.depth[(y * width + x) as usize]) } else { 0.0 }
}

fn depth_between(fixture: &Fixture, at: (f64, f64), nearest: f64, gate: f64) -> f64 {
    let (x, y) = (at.0.floor(), at.1.floor());
    let corner = |dx: i64, dy: i64| depth_at(fixture, x as i64 + dx, y as i64 + dy);
    let four = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
    if four.iter().any(|depth| (depth - nearest).abs().partial_cmp(&gate) != Some(std::cmp::Ordering::Less)) {
        return nearest;
    }
    let (s, t) = (at.0 - x, at.1 - y);
    (1.0 - t) * ((1.0 - s) * four[0] + s * four[1]) + t * ((1.0 - s) * four[2] + s * four[3])
}

fn all_around_between(fixture: &Fixture, pixel: (i64, i64), near: f64, far: f64) -> bool {
    let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
    let mut depths = around.map(|(dx, dy)| depth_at(fixture, pixel.0 + dx, pixel.1 + dy));
    depths.all(|depth| depth.is_nan() || depth <= 0.0 || (near..=far).contains(&depth))
}

/// With the gates widened by `slack`, to find close calls.
fn is_contradicted(
    fixture: &Fixture,
    slot: usize,
    pixel: (i64, i64),
    (depth, gate, slack): (f64, f64, f64),
) -> bool {
    let settings = &fixture.settings;
    let index = (pixel.1 * i64::from(fixture.view.pinhole.width_px) + pixel.0) as usize;
    let vector = |row: &[f32; 4]| Vector3::new(row[0], row[1], row[2]).cast::<f64>();
    let seen = fixture.view.world_from_camera.rotation * vector(&fixture.normal[index]);
    let same_facing = vector(&fixture.rows.orientation[slot]).dot(&seen) > f64::from(settings.angle_cos_min);
    let beyond = depth + f64::from(settings.free_space_gate_m).max(gate) - slack;
    let doubled = f64::from(settings.doubled_gate_m) + slack;
    all_around_between(fixture, pixel, beyond, 1e30)
        || (same_facing && all_around_between(fixture, pixel, depth - doubled, depth - gate + slack))
}

fn fuse_one(fixture: &Fixture, rows: &SurfelRows, slot: usize) -> Fused {
    let settings = &fixture.settings;
    let mut fused = Fused {
        geometry: rows.geometry[slot].map(f64::from),
        orientation: rows.orientation[slot].map(f64::from),
        appearance: rows.appearance[slot].map(f64::from),
        seen: false,
        close_call: false,
    };
    let camera = &fixture.view.pinhole;
    let [x, y, z, _] = fused.geometry;
    let point = fixture.view.world_from_camera.inverse() * Point3::new(x, y, z);
    if rows.history[slot][3] & ALIVE == 0
        || !point.coords.iter().all(|value| value.is_finite())
        || point.z < 1e-4
    {
        return fused;
    }
    let at = camera.project(&point);
    let (column, row) = (at.x.round() as i64, at.y.round() as i64);
    fused.close_call |= [at.x, at.y].iter().any(|value| (value.fract().abs() - 0.5).abs() < 1e-3);
    if column < 0 || row < 0 || column >= i64::from(camera.width_px) || row >= i64::from(camera.height_px) {
        return fused;
    }
    let pixel = (row * i64::from(camera.width_px) + column) as usize;
    let (measured, sigma) = (f64::from(fixture.depth[pixel]), f64::from(fixture.sigma_z[pixel]));
    if !(measured.is_finite() && sigma.is_finite()) || measured <= 0.0 || sigma <= 0.0 {
        return fused;
    }
    let gate = f64::from(settings.gate_m).max(f64::from(settings.gate_sigmas) * sigma);
    let ratio = f64::from(settings.reference_sigma_per_square_depth) * measured * measured / sigma;
    let weight = (ratio * ratio).clamp(settings.weight_min.into(), 1.0);
    let between = depth_between(fixture, (at.x, at.y), measured, gate);
    fused.close_call |= ((point.z - between).abs() - gate).abs() < 1e-6;
    if (point.z - between).abs() < gate {
        average(fixture, &mut fused, (&point, pixel), (between, weight));
    } else {
        let decide = |slack: f64| is_contradicted(fixture, slot, (column, row), (point.z, gate, slack));
        fused.close_call |= decide(1e-6) != decide(-1e-6);
        if decide(0.0) {
            let left = fused.orientation[3] - f64::from(settings.contradiction_loss) * weight;
            fused.orientation[3] = left.max(0.0);
        }
    }
    fused
}

fn average(
    fixture: &Fixture,
    fused: &mut Fused,
    (point, pixel): (&Point3<f64>, usize),
    (depth, weight): (f64, f64),
) {
    let settings = &fixture.settings;
    let [sx, sy, sz, valid] = fixture.normal[pixel].map(f64::from);
    let seen = Vector3::new(sx, sy, sz);
    let seen_in_world = fixture.view.world_from_camera.rotation * seen;
    let [nx, ny, nz, omega] = fused.orientation;
    let normal = Vector3::new(nx, ny, nz);
    let cosine = normal.dot(&seen_in_world);
    fused.close_call |= (cosine - f64::from(settings.angle_cos_min)).abs() < 1e-5;
    if valid == 0.0 || cosine < f64::from(settings.angle_cos_min) {
        return;
    }
    let total = omega + weight;
    let fused_depth = (point.z * omega + depth * weight) / total;
    let moved = fixture.view.world_from_camera * Point3::from(point.coords * (fused_depth / point.z));
    let turned = (normal * omega + seen_in_world * weight).normalize();
    let facing = -seen.dot(&point.coords.normalize());
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let pixel_radius = half * fused_depth / fixture.view.pinhole.fx_px / facing.max(0.25);
    let radius = pixel_radius.max(0.9 * f64::from(settings.spacing_m));
    fused.geometry = [moved.x, moved.y, moved.z, fused.geometry[3].min(radius)];
    fused.orientation = [turned.x, turned.y, turned.z, total.min(settings.weight_max.into())];
    let [red, green, blue, alpha] = fixture.color[pixel].to_le_bytes().map(f64::from);
    if alpha > 0.0 {
        let falloff = falloff(fixture, pixel, &point.coords);
        mix_color(fixture, &mut fused.appearance, ([red, green, blue], falloff), weight);
    }
    fused.seen = true;
}

fn mix_color(fixture: &Fixture, color: &mut [f64; 4], (levels, falloff): ([f64; 3], f64), weight: f64) {
    let (settings, seen) = (&fixture.settings, even_color(levels, falloff));
    let glare: f64 = (0..3).map(|c| [0.299, 0.587, 0.114][c] * (seen[c] - color[c])).sum();
    let glare = glare.max(0.0) / f64::from(settings.highlight_levels);
    let weight = weight * light_weight(falloff) / (1.0 + glare * glare);
    let total = color[3] + weight;
    for (mean, level) in color.iter_mut().zip(seen) {
        *mean = (*mean * (total - weight) + level * weight) / total;
    }
    color[3] = total.min(settings.color_weight_max.into());
}

/// The colour under even light in a frame of the fixture's tone.
pub(super) fn even_color(levels: [f64; 3], falloff: f64) -> [f64; 3] {
    let Tone { gain, bias } = TONE;
    [0, 1, 2].map(|c| ((levels[c] - f64::from(bias[c])) / (f64::from(gain[c]) * falloff)).max(0.0))
}

/// Share of a measurement's weight that its colour has.
pub(super) fn light_weight(falloff: f64) -> f64 {
    let gain: f64 = TONE.gain[..3].iter().copied().map(f64::from).sum::<f64>() / 3.0;
    (gain * falloff).powi(2).clamp(0.02, 1.0)
}

fn assert_close(rows: &[f32; 4], expected: &[f64; 4], tolerance: f64, slot: usize) {
    for (value, wanted) in rows.iter().zip(expected) {
        let same = (f64::from(*value) - wanted).abs() <= tolerance || !wanted.is_finite();
        assert!(same, "slot {slot}: {rows:?} for {expected:?}");
    }
}

fn fused_rows(fixture: &Fixture) -> SurfelRows {
    fixture.write_results(&[0, 1]);
    let kernel = fuse::bind(&fixture.gpu, &fixture.buffers).unwrap();
    fixture.run(&kernel, SLOTS, |_| ());
    fixture.read()
}

#[test]
fn registration_and_averages_agree_with_the_oracle() {
    let fixture = Fixture::new(1);
    let rows = fused_rows(&fixture);
    let (mut registered, mut contradicted, mut skipped) = (0, 0, 0);
    for slot in 0..SLOTS {
        let expected = fuse_one(&fixture, &fixture.rows, slot);
        if expected.close_call {
            skipped += 1;
            continue;
        }
        registered += usize::from(expected.seen);
        contradicted += usize::from(
            !expected.seen && expected.orientation[3] < f64::from(fixture.rows.orientation[slot][3]),
        );
        assert_close(&rows.geometry[slot], &expected.geometry, 2e-7, slot);
        assert_close(&rows.orientation[slot], &expected.orientation, 2e-5, slot);
        assert_close(&rows.appearance[slot], &expected.appearance, 2e-3, slot);
        let stamp = if expected.seen { fixture.settings.frame } else { fixture.rows.history[slot][1] };
        assert_eq!(rows.history[slot][1], stamp, "slot {slot}");
    }
    assert!(registered > 40 && contradicted > 10 && skipped < 8, "{registered} {contradicted} {skipped}");
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let bits = |rows: SurfelRows| {
        let floats = [rows.geometry, rows.orientation, rows.appearance].concat();
        (floats.into_iter().map(|row| row.map(f32::to_bits)).collect::<Vec<_>>(), rows.history)
    };
    assert!(bits(fused_rows(&Fixture::new(2))) == bits(fused_rows(&Fixture::new(2))));
}

#[test]
fn a_rejected_frame_changes_nothing() {
    let fixture = Fixture::new(4);
    fixture.write_results(&[0, 0]);
    let kernel = fuse::bind(&fixture.gpu, &fixture.buffers).unwrap();
    fixture.run(&kernel, SLOTS, |_| ());
    let rows = fixture.read();
    assert_eq!(
        (rows.orientation, rows.history),
        (fixture.rows.orientation.clone(), fixture.rows.history.clone())
    );
}
