//! CPU mirrors of both passes.

use nalgebra::{Point2, Point3, Vector3};

use super::{INVOCATIONS, Tone, fit_tone, sample_tone};
use crate::store::Row;
use crate::testing::{Fixture, SLOTS, gpu};

/// Fall-off of light at a pixel of the fixture, as `shared/light.wgsl`.
pub(crate) fn falloff(fixture: &Fixture, pixel: usize, point_in_camera: &Vector3<f64>) -> f64 {
    let settings = &fixture.settings;
    let direction = point_in_camera.normalize();
    let [x, y, z, _] = fixture.normal[pixel].map(f64::from);
    let facing = (-Vector3::new(x, y, z).dot(&direction)).clamp(0.2, 1.0);
    let near = f64::from(settings.reference_distance_m).powi(2) / point_in_camera.norm_squared();
    facing * near * direction.z.max(0.01).powf(settings.axis_power.into())
}

fn slot_of(pixel: usize) -> usize {
    pixel % SLOTS
}

/// What one pixel adds to the sums of a channel and to the counts.
fn sample(fixture: &Fixture, pixel: usize) -> ([[f64; 4]; 3], [f64; 4]) {
    let nothing = ([[0.0; 4]; 3], [0.0; 4]);
    let measured = f64::from(fixture.depth[pixel]);
    let [nx, ny, nz, valid] = fixture.normal[pixel];
    let [red, green, blue, alpha] = fixture.color[pixel].to_le_bytes();
    let finite = measured.is_finite() && [nx, ny, nz].iter().all(|value| value.is_finite());
    if !finite || measured <= 0.0 || valid == 0.0 || alpha == 0 {
        return nothing;
    }
    let columns = fixture.view.pinhole.width_px as usize;
    let at = Point2::new((pixel % columns) as f64, (pixel / columns) as f64);
    let falloff = falloff(fixture, pixel, &fixture.view.pinhole.back_project(&at, measured).coords);
    let lit = [0.0, falloff, 1.0, 0.0];
    let [x, y, z, _] = fixture.rows.geometry[slot_of(pixel)].map(f64::from);
    let center = fixture.view.world_from_camera.inverse() * Point3::new(x, y, z);
    let observed = [red, green, blue].map(f64::from);
    let usable = observed.iter().all(|&level| level > 8.0 && level < 245.0);
    let near = (center.z - measured).abs() < f64::from(fixture.settings.gate_m);
    if !near || !usable {
        return ([[0.0; 4]; 3], lit);
    }
    let known = fixture.rows.appearance[slot_of(pixel)].map(f64::from);
    let channel = |c: usize| {
        let (m, o) = (known[c] * falloff, observed[c]);
        [m, o, m * m, m * o]
    };
    ([0, 1, 2].map(channel), [1.0, falloff, 1.0, 0.0])
}

#[test]
fn sums_agree_with_the_oracle() {
    let fixture = Fixture::new(12);
    let slots: Vec<u32> = (0..fixture.pixels()).map(|pixel| !(slot_of(pixel) as u32)).collect();
    fixture.gpu.write(&fixture.buffers.index_map.slots, 0, &slots).unwrap();
    let sums = fixture.gpu.storage::<Row>("sums", 4 * INVOCATIONS as usize).unwrap();
    let kernel = sample_tone::bind(&fixture.gpu, &fixture.buffers, &sums).unwrap();
    fixture.run(&kernel, INVOCATIONS as usize, |_| ());
    let found = fixture.gpu.read(&sums).unwrap();
    let camera = &fixture.view.pinhole;
    let (columns, rows) = (camera.width_px as usize / 4, camera.height_px as usize / 4);
    let mut pairs = 0.0;
    for number in 0..columns * rows {
        let pixel = 4 * (number / columns) * camera.width_px as usize + 4 * (number % columns);
        let (channels, counts) = sample(&fixture, pixel);
        pairs += counts[0];
        for (row, wanted) in channels.into_iter().chain([counts]).enumerate() {
            for (value, wanted) in found[4 * number + row].iter().zip(wanted) {
                let off = (f64::from(*value) - wanted).abs();
                assert!(off <= 1e-4 * wanted.abs().max(1.0), "sample {number} row {row}: {value} {wanted}");
            }
        }
    }
    assert!(pairs >= 8.0, "{pairs}");
    assert!(found[4 * columns * rows..].iter().all(|row| *row == [0.0; 4]), "no samples, no sums");
}

/// Sums over pairs whose observed levels follow from the model's by a gain and a bias, spread over the invocations.
fn sums_of(gain: [f64; 3], bias: [f64; 3], pairs: u32) -> Vec<Row> {
    let mut sums = vec![[0.0f32; 4]; 4 * INVOCATIONS as usize];
    for pair in 0..pairs {
        let first = 4 * (pair % INVOCATIONS) as usize;
        let model = 40.0 + f64::from(pair * 37 % 120);
        for channel in 0..3 {
            let observed = gain[channel] * model + bias[channel];
            let row = [model, observed, model * model, model * observed].map(|value| value as f32);
            (0..4).for_each(|i| sums[first + channel][i] += row[i]);
        }
        (0..3).for_each(|i| sums[first + 3][i] += [1.0, 0.5, 1.0][i]);
    }
    sums
}

fn fitted(sums: &[Row], before: Tone) -> Tone {
    let gpu = gpu();
    let (sums, tone) =
        (gpu.storage_from("sums", sums).unwrap(), gpu.storage_from("tone", &[before]).unwrap());
    let kernel = fit_tone::bind(&gpu, &sums, &tone).unwrap();
    let timer = gpu::StageTimer::new(&gpu, 1).unwrap();
    let mut frame = gpu::FrameRecorder::begin(&gpu, &timer);
    frame.stage("fit", |stage| stage.run(&kernel, [1, 1, 1])).unwrap();
    frame.submit().collect().unwrap();
    gpu.read(&tone).unwrap()[0]
}

#[test]
fn gain_and_bias_of_a_picture_are_found() {
    let (gain, bias) = ([0.8, 1.1, 1.3], [6.0, -4.0, 0.0]);
    let tone = fitted(&sums_of(gain, bias, 3000), Tone { gain: [1.0; 4], bias: [0.0; 4] });
    for channel in 0..3 {
        // the priors cost a little of the bias
        assert!((f64::from(tone.gain[channel]) - gain[channel]).abs() < 0.03, "{tone:?}");
        assert!((f64::from(tone.bias[channel]) - bias[channel]).abs() < 3.0, "{tone:?}");
    }
}

#[test]
fn the_first_picture_is_as_bright_as_its_model_and_little_overlap_changes_nothing() {
    let first = fitted(&sums_of([2.0; 3], [0.0; 3], 100), Tone::UNKNOWN);
    assert_eq!(first, Tone { gain: [2.0, 2.0, 2.0, 1.0], bias: [0.0; 4] });
    let before = Tone { gain: [1.5, 1.4, 1.3, 1.0], bias: [2.0, 1.0, 0.0, 0.0] };
    assert_eq!(fitted(&sums_of([0.5; 3], [0.0; 3], 100), before), before);
    let dark = vec![[0.0; 4]; 4 * INVOCATIONS as usize];
    assert_eq!(fitted(&dark, Tone::UNKNOWN), Tone::UNKNOWN);
}
