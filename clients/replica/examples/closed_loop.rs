//! What epochs cost, on the CPU alone: a sheet that never rests, published by the rule of SPEC.md with a replica in the
//! place of the server's copy.
//!
//! `cargo run -p replica --example closed_loop [SURFELS] [FRAMES]`. The same loop runs on the GPU in `dense`;
//! `cargo run -p tests --bin stream` measures that one through a server.

#![expect(clippy::print_stdout, reason = "what an example prints is its result")]

use std::f64::consts::TAU;
use std::time::Instant;

use protocol::v1::{ModelEpoch, from_server};
use protocol::{
    AFFINE_STEP, NODE_STEP_M, NodePosition, NodeTransform, PackedModel, ProtocolError, WireSurfel,
    pack_nodes, pack_surfels, pack_transforms,
};
use replica::{Replica, ReplicaError};

type Vector = [f64; 3];

const SURFEL_SPACING_M: f64 = 4e-4;
const NODE_SPACING_M: f64 = 4e-3;
const REACH_M: f32 = 8e-3;
const NOISE_M: f64 = 3e-5;
/// The bound at the viewer less the rounding of a late joiner.
const SENT_BEYOND_M: f64 = 2e-4 - 1.74e-5 - 2e-6;
const RATE_HZ: f64 = 30.0;

fn main() -> Result<(), ReplicaError> {
    let mut arguments = std::env::args().skip(1).filter_map(|text| text.parse().ok());
    let surfels = arguments.next().unwrap_or(100_000);
    let frames = arguments.next().unwrap_or(60);
    let sheet = Sheet::new(surfels);
    let (mut account, mut viewer) = (PackedModel::default(), Replica::from_the_start());
    let (mut bytes, mut plain_bytes, mut anew) = (Vec::new(), Vec::new(), Vec::new());
    let (mut errors_mm, mut encode_ms, mut apply_ms) = (Vec::new(), Vec::new(), Vec::new());
    for frame in 0..frames {
        let changes = sheet.epoch(&account, &viewer, frame)?;
        let begin = Instant::now();
        let epoch = account.advance(changes)?;
        let message = protocol::from_server_compressed(from_server::Body::Epoch(epoch.clone()));
        encode_ms.push(begin.elapsed().as_secs_f64() * 1e3);
        let begin = Instant::now();
        viewer.take_epoch(&epoch)?;
        apply_ms.push(begin.elapsed().as_secs_f64() * 1e3);
        if frame > 0 {
            bytes.push(message.len() as f64);
            plain_bytes.push(protocol::from_server(from_server::Body::Epoch(epoch.clone())).len() as f64);
            anew.push(epoch.updated.as_ref().map_or(0.0, |block| block.records.len() as f64 / 16.0));
            errors_mm.extend(sheet.errors_mm(&viewer, frame));
        }
    }
    println!(
        "{surfels} surfels, {} nodes, {frames} frames at {RATE_HZ} Hz",
        sheet.node_side * sheet.node_side
    );
    println!(
        "bytes a frame      mean {:.0}, p95 {:.0}; not compressed {:.0}",
        mean(&bytes),
        quantile(&mut bytes, 0.95),
        mean(&plain_bytes)
    );
    println!("surfels sent anew  mean {:.0} a frame", mean(&anew));
    println!(
        "error, mm          p50 {:.4}, p99 {:.4}, worst {:.4}",
        quantile(&mut errors_mm, 0.5),
        quantile(&mut errors_mm, 0.99),
        quantile(&mut errors_mm, 1.0)
    );
    println!("encode, ms         p50 {:.2}", quantile(&mut encode_ms[1..], 0.5));
    println!("apply, ms          p50 {:.2}", quantile(&mut apply_ms[1..], 0.5));
    snapshot(&mut account, &viewer)?;
    Ok(())
}

/// What a late joiner is sent.
fn snapshot(account: &mut PackedModel, viewer: &Replica) -> Result<(), ProtocolError> {
    let rows = viewer.surfels().ids().iter().zip(viewer.surfels().rows());
    let shapes: Vec<WireSurfel> = rows
        .map(|(&id, row)| WireSurfel {
            id,
            position_in_world_m: row.position_in_world_m,
            normal_in_world: row.normal_in_world,
            radius_m: row.radius_m,
            color: row.color,
            confidence: row.confidence,
        })
        .collect();
    let begin = Instant::now();
    account.refresh(&shapes)?;
    let chunks = account.snapshot()?;
    let sizes = chunks
        .into_iter()
        .map(|placed| protocol::from_server_compressed(from_server::Body::Snapshot(placed.chunk)).len());
    let (count, total) = sizes.fold((0, 0), |(count, total), size| (count + 1, total + size));
    let per_surfel = total as f64 / shapes.len() as f64;
    println!(
        "snapshot           {total} bytes in {count} chunks, {per_surfel:.2} a surfel, {:.2} s at 50 Mbit/s, packed in {:.0} ms",
        total as f64 * 8.0 / 50e6,
        begin.elapsed().as_secs_f64() * 1e3,
    );
    Ok(())
}

struct Sheet {
    surfels: u32,
    side: u32,
    node_side: u32,
}

impl Sheet {
    fn new(surfels: u32) -> Self {
        let side = f64::from(surfels).sqrt().ceil() as u32;
        let node_side = (f64::from(side) * SURFEL_SPACING_M / NODE_SPACING_M).ceil() as u32 + 1;
        Self { surfels, side, node_side }
    }

    /// The warp, and the surfels that it leaves too far off.
    fn epoch(&self, account: &PackedModel, viewer: &Replica, frame: u32) -> Result<ModelEpoch, ReplicaError> {
        let base = ModelEpoch {
            epoch: account.epoch() + 1,
            base_epoch: account.epoch(),
            node_reach_m: REACH_M,
            ..ModelEpoch::default()
        };
        if frame == 0 {
            let all: Vec<WireSurfel> = (0..self.surfels).map(|id| self.surfel(id, frame)).collect();
            let ids: Vec<u32> = (0..self.node_side * self.node_side).collect();
            let places: Vec<_> =
                ids.iter().map(|&id| NodePosition::pack(self.node(id, 0.0).map(|x| x as f32))).collect();
            let added_nodes = Some(pack_nodes(&ids, &places)?);
            return Ok(ModelEpoch { added: Some(pack_surfels(&all)?), added_nodes, ..base });
        }
        let transforms: Vec<_> = viewer
            .nodes()
            .positions()
            .iter()
            .zip(0..)
            .map(|(held, id)| self.transform(*held, id, frame))
            .collect();
        let warped = ModelEpoch { node_transforms: pack_transforms(&transforms), ..base };
        let mut copy = viewer.clone();
        let mut account = account.clone();
        copy.take_epoch(&account.advance(warped.clone())?)?;
        let off = |&(id, position): &(u32, [f32; 3])| {
            distance_m(self.surfel(id, frame).position_in_world_m, position) > SENT_BEYOND_M
        };
        let held = copy
            .surfels()
            .ids()
            .iter()
            .zip(copy.surfels().rows())
            .map(|(&id, row)| (id, row.position_in_world_m));
        let anew: Vec<_> = held.filter(off).map(|(id, _)| self.surfel(id, frame)).collect();
        Ok(ModelEpoch { updated: Some(pack_surfels(&anew)?), ..warped })
    }

    fn errors_mm(&self, viewer: &Replica, frame: u32) -> Vec<f64> {
        let rows = viewer.surfels().ids().iter().zip(viewer.surfels().rows());
        rows.map(|(&id, row)| {
            1e3 * distance_m(self.surfel(id, frame).position_in_world_m, row.position_in_world_m)
        })
        .collect()
    }

    fn transform(&self, held: NodePosition, id: u32, frame: u32) -> NodeTransform {
        let (before_s, now_s) = (f64::from(frame - 1) / RATE_HZ, f64::from(frame) / RATE_HZ);
        let (u, v) = grid(id, self.node_side, NODE_SPACING_M);
        let now = self.node(id, now_s);
        let turned = product(frame_of(u, v, now_s), inverse(frame_of(u, v, before_s)));
        let mut codes = [0; 12];
        for axis in 0..3 {
            codes[axis] = ((now[axis] / NODE_STEP_M).round() - f64::from(held.0[axis])) as i16;
            for column in 0..3 {
                let identity = f64::from(u8::from(axis == column));
                codes[3 + 3 * axis + column] =
                    ((turned[axis][column] - identity) / AFFINE_STEP).round() as i16;
            }
        }
        NodeTransform(codes)
    }

    fn node(&self, id: u32, time_s: f64) -> Vector {
        let (u, v) = grid(id, self.node_side, NODE_SPACING_M);
        point(u, v, time_s)
    }

    fn surfel(&self, id: u32, frame: u32) -> WireSurfel {
        let (u, v) = grid(id, self.side, SURFEL_SPACING_M);
        let time_s = f64::from(frame) / RATE_HZ;
        let place = point(u, v, time_s);
        let trembling = |axis: u32| {
            let hash = protocol::surfel_digest(id + 1, 3 * frame + axis + 1);
            NOISE_M * (f64::from(hash) / f64::from(u32::MAX) * 2.0 - 1.0)
        };
        WireSurfel {
            id,
            position_in_world_m: [0, 1, 2].map(|axis| (place[axis] + trembling(axis as u32)) as f32),
            normal_in_world: frame_of(u, v, time_s).map(|row| -row[2] as f32),
            radius_m: 3e-4,
            color: [200, (90.0 + 40.0 * (300.0 * u).sin()) as u8, (70.0 + 30.0 * (500.0 * v).cos()) as u8],
            confidence: 0.75,
        }
    }
}

fn grid(id: u32, side: u32, spacing_m: f64) -> (f64, f64) {
    let along = |place: u32| (f64::from(place) - f64::from(side - 1) / 2.0) * spacing_m;
    (along(id % side), along(id / side))
}

/// It beats, breathes, is sheared, and a wave runs through it.
fn point(u: f64, v: f64, time_s: f64) -> Vector {
    let beat = (TAU * 1.2 * time_s).sin().max(0.0).powi(2) * (-(u * u + v * v) / 9e-4).exp();
    let breath = (TAU * 0.25 * time_s).sin();
    let wave = (TAU * (u / 0.03 - time_s)).sin();
    let shear = (TAU * (v / 0.05 + 0.7 * time_s)).sin();
    let z = 0.1 + 4.0 * (u * u + v * v) - 0.004 * beat + 0.003 * breath + 0.001 * wave;
    [u + 0.0015 * shear, v + 0.006 * breath, z]
}

/// Columns: the two tangents and the normal.
fn frame_of(u: f64, v: f64, time_s: f64) -> [Vector; 3] {
    let step = 1e-5;
    let here = point(u, v, time_s);
    let along = |there: Vector| [0, 1, 2].map(|axis| (there[axis] - here[axis]) / step);
    let (a, b) = (along(point(u + step, v, time_s)), along(point(u, v + step, time_s)));
    let n = cross(a, b);
    let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
    [0, 1, 2].map(|axis| [a[axis], b[axis], n[axis] / length])
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn inverse(m: [Vector; 3]) -> [Vector; 3] {
    let cofactors = [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])];
    let determinant: f64 = (0..3).map(|i| m[0][i] * cofactors[0][i]).sum();
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| cofactors[column][row] / determinant))
}

fn product(a: [Vector; 3], b: [Vector; 3]) -> [Vector; 3] {
    a.map(|row| [0, 1, 2].map(|column| (0..3).map(|i| row[i] * b[i][column]).sum()))
}

fn distance_m(a: [f32; 3], b: [f32; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>().sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values
        .get(((share * values.len() as f64) as usize).min(values.len().saturating_sub(1)))
        .copied()
        .unwrap_or(0.0)
}
