//! CPU mirror of claims, settling and lifting.

use std::collections::BTreeSet;

use nalgebra::{Point2, Point3, Vector3};

use super::fuse_oracle::{even_color, light_weight};
use super::{claim_pixels, claim_surfels, lift, mark_lifted, settle};
use crate::store::{ALIVE, STABLE};
use crate::testing::{Fixture, SLOTS};
use crate::tone::tone_oracle::falloff;

/// What the table would hold: the claims, and the pixels that registered surfels cover.
struct Claims {
    table: Vec<u32>,
    covered: BTreeSet<usize>,
}

fn cell_of(point: Vector3<f32>, spacing_m: f32) -> [i32; 3] {
    let cells_per_metre = 1.0 / spacing_m;
    [0, 1, 2].map(|axis| (point[axis] * cells_per_metre).floor() as i32)
}

fn place(cell: [i32; 3], seed: u32, mask: u32) -> usize {
    let [x, y, z] = cell.map(|value| value as u32);
    let mut hash = (seed ^ x).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ (hash >> 15) ^ y).wrapping_mul(0xc2b2_ae35);
    hash = (hash ^ (hash >> 13) ^ z).wrapping_mul(0x27d4_eb2f);
    ((hash ^ (hash >> 16)) & mask) as usize
}

fn position(fixture: &Fixture, slot: usize) -> Vector3<f32> {
    let [x, y, z, _] = fixture.rows.geometry[slot];
    Vector3::new(x, y, z)
}

fn seen_now(fixture: &Fixture, slot: usize) -> bool {
    let [_, seen, _, state] = fixture.rows.history[slot];
    state & ALIVE != 0 && seen == fixture.settings.frame
}

fn pixel_in_world(fixture: &Fixture, pixel: usize) -> Vector3<f32> {
    let camera = &fixture.view.pinhole;
    let columns = camera.width_px as usize;
    let at = Point2::new((pixel % columns) as f64, (pixel / columns) as f64);
    let point = camera.back_project(&at, f64::from(fixture.depth[pixel]));
    (fixture.view.world_from_camera * point).coords.map(|value| value as f32)
}

fn is_measured(fixture: &Fixture, pixel: usize) -> bool {
    let (depth, sigma) = (fixture.depth[pixel], fixture.sigma_z[pixel]);
    let finite =
        depth.is_finite() && sigma.is_finite() && fixture.normal[pixel].iter().all(|x| x.is_finite());
    finite && depth > 0.0 && sigma > 0.0 && fixture.normal[pixel][3] != 0.0
}

fn relative_spread(fixture: &Fixture, pixel: usize) -> f32 {
    let depth = fixture.depth[pixel];
    fixture.sigma_z[pixel] / (fixture.settings.reference_sigma_per_square_depth * depth * depth)
}

fn cover(fixture: &Fixture, slot: usize, covered: &mut BTreeSet<usize>) {
    let (settings, camera) = (&fixture.settings, &fixture.view.pinhole);
    let point =
        fixture.view.world_from_camera.inverse() * Point3::from(position(fixture, slot).cast::<f64>());
    let at = camera.project(&point);
    let reach = (f64::from(settings.cover_radius_m) * camera.fx_px / point.z).clamp(0.5, 12.0);
    for pixel in 0..fixture.pixels() {
        let columns = camera.width_px as usize;
        let offset = Point2::new((pixel % columns) as f64, (pixel / columns) as f64) - at;
        let gate_m = settings.gate_m.max(settings.gate_sigmas * fixture.sigma_z[pixel]);
        let gate = f64::from(gate_m + settings.cover_radius_m);
        if offset.norm() <= reach && (f64::from(fixture.depth[pixel]) - point.z).abs() < gate {
            covered.insert(pixel);
        }
    }
}

fn claims(fixture: &Fixture) -> Claims {
    let settings = &fixture.settings;
    let mut table = vec![0u32; settings.table_mask as usize + 1];
    let mut covered = BTreeSet::new();
    for slot in (0..SLOTS).filter(|&slot| seen_now(fixture, slot)) {
        let place =
            place(cell_of(position(fixture, slot), settings.spacing_m), settings.seed, settings.table_mask);
        let rank = ((fixture.rows.orientation[slot][3] / settings.weight_max).clamp(0.0, 1.0) * 127.0) as u32;
        table[place] = table[place].max(0x8000_0000 | (rank << 24) | (0xff_ffff - slot as u32));
        cover(fixture, slot, &mut covered);
    }
    for pixel in
        (0..fixture.pixels()).filter(|pixel| is_measured(fixture, *pixel) && !covered.contains(pixel))
    {
        let cell = cell_of(pixel_in_world(fixture, pixel), settings.spacing_m);
        let place = place(cell, settings.seed, settings.table_mask);
        let spread = (relative_spread(fixture, pixel) * 64.0).clamp(0.0, 255.0) as u32;
        table[place] = table[place].max(((255 - spread) << 23) | (0x7f_ffff - pixel as u32));
    }
    Claims { table, covered }
}

/// The state that settling leaves each slot in.
fn settled(fixture: &Fixture, claims: &Claims, slot: usize) -> u32 {
    let settings = &fixture.settings;
    let [_, seen, _, mut state] = fixture.rows.history[slot];
    if state & ALIVE == 0 {
        return state;
    }
    let weight = fixture.rows.orientation[slot][3];
    if weight >= settings.weight_stable {
        state |= STABLE;
    } else if weight < 0.5 * settings.weight_stable {
        state &= !STABLE;
    }
    let redundant = seen == settings.frame && is_redundant(fixture, claims, slot);
    if weight <= 0.0 || redundant { 0 } else { state }
}

fn is_redundant(fixture: &Fixture, claims: &Claims, slot: usize) -> bool {
    let settings = &fixture.settings;
    let cell = |slot| cell_of(position(fixture, slot), settings.spacing_m);
    let claim = claims.table[place(cell(slot), settings.seed, settings.table_mask)];
    let winner = (0xff_ffff - (claim & 0xff_ffff)) as usize;
    let normal = |slot: usize| Vector3::from_column_slice(&fixture.rows.orientation[slot][..3]);
    claim >> 31 == 1
        && winner != slot
        && cell(winner) == cell(slot)
        && normal(winner).dot(&normal(slot)) > 0.0
}

/// A fixture in which half of the surfels were seen now, many share cells, and some are weak.
fn crowded(seed: u64) -> Fixture {
    let mut fixture = Fixture::new(seed);
    for slot in 0..SLOTS {
        if slot % 2 == 0 && slot % 17 != 16 {
            fixture.rows.history[slot][1] = fixture.settings.frame;
        }
        if slot % 6 == 4 && slot % 17 != 16 && (slot - 2) % 17 != 16 {
            fixture.rows.geometry[slot] = fixture.rows.geometry[slot - 2];
        }
        if slot % 9 == 8 {
            fixture.rows.orientation[slot][3] = if slot % 2 == 0 { 0.0 } else { 0.3 };
        }
    }
    crate::testing::upload(&fixture.gpu, &fixture.buffers.store, &fixture.rows);
    fixture.write_results(&[0, 1]);
    let buffers = &fixture.buffers;
    let surfels = claim_surfels::bind(&fixture.gpu, buffers).unwrap();
    let pixels = claim_pixels::bind(&fixture.gpu, buffers).unwrap();
    fixture.run(&surfels, SLOTS, |frame| {
        frame.clear(&buffers.covered);
        frame.clear(&buffers.claims);
    });
    fixture.run(&pixels, fixture.pixels(), |_| ());
    fixture
}

#[test]
fn claims_and_covered_pixels_agree_with_the_oracle() {
    let fixture = crowded(11);
    let expected = claims(&fixture);
    let words = fixture.gpu.read(&fixture.buffers.covered).unwrap();
    let covered: BTreeSet<usize> =
        (0..fixture.pixels()).filter(|pixel| words[pixel / 32] & (1 << (pixel % 32)) != 0).collect();
    assert!(covered.len() > 20, "{}", covered.len());
    assert!(covered.symmetric_difference(&expected.covered).count() <= 1);
    let table = fixture.gpu.read(&fixture.buffers.claims).unwrap();
    let surfels = table.iter().filter(|claim| **claim >> 31 == 1).count();
    let filled = table.iter().filter(|claim| **claim != 0).count();
    assert!(surfels > 50 && filled > 300, "{surfels} {filled}");
    // single precision may put a pixel into the cell beside
    let differ = table.iter().zip(&expected.table).filter(|(found, wanted)| found != wanted).count();
    assert!(differ * 100 <= filled, "{differ} of {filled}");
}

#[test]
fn settling_agrees_with_the_oracle() {
    let fixture = crowded(12);
    let expected = claims(&fixture);
    fixture.write_results(&[0, 1]);
    let kernel = settle::bind(&fixture.gpu, &fixture.buffers).unwrap();
    fixture.run(&kernel, SLOTS, |_| ());
    let states: Vec<u32> = fixture.read().history.iter().map(|row| row[3]).collect();
    let wanted: Vec<u32> = (0..SLOTS).map(|slot| settled(&fixture, &expected, slot)).collect();
    assert_eq!(states, wanted);
    let died = (0..SLOTS).filter(|&slot| fixture.rows.history[slot][3] != 0 && states[slot] == 0).count();
    assert!(died > 40, "{died}");
    let results = fixture.gpu.read(&fixture.buffers.results).unwrap();
    let stable = |state: u32| state & STABLE != 0;
    let changed = |was: bool, is: bool| {
        let slots = (0..SLOTS).filter(|&slot| stable(fixture.rows.history[slot][3]) == was);
        slots.filter(|&slot| stable(states[slot]) == is).count() as u32
    };
    let counts = [died as u32, changed(false, true), changed(true, false)];
    assert!(counts[1] > 0 && counts[2] > 0, "{counts:?}");
    assert_eq!([results[2], results[3], results[5]], counts);
}

#[test]
fn the_pixels_that_won_a_cell_are_lifted_in_order() {
    let fixture = crowded(13);
    let buffers = &fixture.buffers;
    let table = fixture.gpu.read(&buffers.claims).unwrap();
    let won = table.iter().filter(|claim| **claim != 0 && **claim >> 31 == 0);
    let pixels: BTreeSet<usize> = won.map(|claim| (0x7f_ffff - (claim & 0x7f_ffff)) as usize).collect();
    let mark = mark_lifted::bind(&fixture.gpu, buffers).unwrap();
    fixture.run(&mark, table.len(), |frame| frame.clear(&buffers.lifted.flags));
    let timer = gpu::StageTimer::new(&fixture.gpu, 2).unwrap();
    let mut frame = gpu::FrameRecorder::begin(&fixture.gpu, &timer);
    let count = fixture.pixels() as u32;
    frame.stage("scan", |stage| buffers.lifted.record(&fixture.gpu, stage, count)).unwrap();
    let lift = lift::bind(&fixture.gpu, buffers).unwrap();
    frame.stage("lift", |stage| stage.run(&lift, [count, 1, 1])).unwrap();
    frame.submit().collect().unwrap();
    assert_eq!(fixture.gpu.read(&buffers.lifted.total).unwrap(), [pixels.len() as u32]);
    let all = buffers.store.read(&fixture.gpu, (SLOTS + pixels.len()) as u32).unwrap();
    for (number, pixel) in pixels.into_iter().enumerate() {
        let slot = SLOTS + number;
        let expected = pixel_in_world(&fixture, pixel);
        let off = (Vector3::from_column_slice(&all.geometry[slot][..3]) - expected).norm();
        assert!(off < 1e-7, "pixel {pixel}: {off}");
        let spread = relative_spread(&fixture, pixel);
        let weight = (1.0 / (spread * spread)).clamp(fixture.settings.weight_min, 1.0);
        assert!((all.orientation[slot][3] - weight).abs() < 1e-5);
        assert_color(&fixture, pixel, &all.appearance[slot], weight);
        let id = fixture.settings.next_id + number as u32;
        assert_eq!(all.history[slot], [id, fixture.settings.frame, fixture.settings.frame, ALIVE]);
    }
}

fn assert_color(fixture: &Fixture, pixel: usize, found: &[f32; 4], weight: f32) {
    let camera = &fixture.view.pinhole;
    let columns = camera.width_px as usize;
    let at = Point2::new((pixel % columns) as f64, (pixel / columns) as f64);
    let point = camera.back_project(&at, f64::from(fixture.depth[pixel])).coords;
    let falloff = falloff(fixture, pixel, &point);
    let [red, green, blue, alpha] = fixture.color[pixel].to_le_bytes();
    let [red, green, blue] = even_color([red, green, blue].map(f64::from), falloff);
    let known = if alpha == 0 { 0.0 } else { f64::from(weight) * light_weight(falloff) };
    for (value, wanted) in found.iter().zip([red, green, blue, known]) {
        assert!((f64::from(*value) - wanted).abs() < 2e-3, "pixel {pixel}: {found:?}");
    }
}
