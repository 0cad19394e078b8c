//! What epochs cost, on the CPU alone: a sheet that never rests, published by the rule of SPEC.md with a replica in the
//! place of the server's copy.
//!
//! `cargo run -p tests --example closed_loop [SURFELS] [FRAMES]`. The same loop runs on the GPU in `dense`;
//! `cargo run -p tests --bin stream` measures that one, over the same sheet, through a server.

#![expect(clippy::print_stdout, reason = "what an example prints is its result")]

use std::time::Instant;

use dense::Surfel;
use dense::synthetic::MovedNode;
use protocol::v1::{ModelEpoch, from_server};
use protocol::{
    AFFINE_STEP, NODE_STEP_M, NodePosition, NodeTransform, PackedModel, ProtocolError, WireSurfel,
    pack_nodes, pack_surfels, pack_transforms,
};
use replica::{Replica, ReplicaError};
use sheet::Sheet;

#[path = "../src/bin/stream/sheet.rs"]
mod sheet;

const REACH_M: f32 = 8e-3;
/// As the shipped configuration has it.
const WEIGHT_MAX: f32 = 20.0;
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
        let changes = epoch(&sheet, &account, &viewer, frame)?;
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
            errors_mm.extend(errors_mm_of(&sheet, &viewer, frame));
        }
    }
    println!("{surfels} surfels, {} nodes, {frames} frames at {RATE_HZ} Hz", sheet.nodes());
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

/// The warp, and the surfels that it leaves too far off.
fn epoch(
    sheet: &Sheet,
    account: &PackedModel,
    viewer: &Replica,
    frame: u32,
) -> Result<ModelEpoch, ReplicaError> {
    let base = ModelEpoch {
        epoch: account.epoch() + 1,
        base_epoch: account.epoch(),
        node_reach_m: REACH_M,
        ..ModelEpoch::default()
    };
    let nodes = sheet.nodes_at(time_s(frame.saturating_sub(1)), time_s(frame));
    if frame == 0 {
        let all: Vec<WireSurfel> = sheet.surfels_at(0.0, frame).iter().map(on_wire).collect();
        let ids: Vec<u32> = (0..nodes.len() as u32).collect();
        let places: Vec<_> = nodes.iter().map(|node| NodePosition::pack(node.position)).collect();
        let added_nodes = Some(pack_nodes(&ids, &places)?);
        return Ok(ModelEpoch { added: Some(pack_surfels(&all)?), added_nodes, ..base });
    }
    let held = viewer.nodes().positions();
    let transforms: Vec<_> = held.iter().zip(&nodes).map(|(held, node)| transform(*held, node)).collect();
    let warped = ModelEpoch { node_transforms: pack_transforms(&transforms), ..base };
    let mut copy = viewer.clone();
    let mut account = account.clone();
    copy.take_epoch(&account.advance(warped.clone())?)?;
    let held = copy.surfels().ids().iter().zip(copy.surfels().rows());
    let anew: Vec<_> = held
        .map(|(&id, row)| (on_wire(&sheet.surfel(id, time_s(frame), frame)), row.position_in_world_m))
        .filter(|(surfel, held)| distance_m(surfel.position_in_world_m, *held) > SENT_BEYOND_M)
        .map(|(surfel, _)| surfel)
        .collect();
    Ok(ModelEpoch { updated: Some(pack_surfels(&anew)?), ..warped })
}

fn errors_mm_of(sheet: &Sheet, viewer: &Replica, frame: u32) -> Vec<f64> {
    let rows = viewer.surfels().ids().iter().zip(viewer.surfels().rows());
    rows.map(|(&id, row)| {
        1e3 * distance_m(sheet.surfel(id, time_s(frame), frame).position, row.position_in_world_m)
    })
    .collect()
}

/// What a node did, as the wire rounds it, from where the viewer holds it.
fn transform(held: NodePosition, node: &MovedNode) -> NodeTransform {
    let mut codes = [0; 12];
    for axis in 0..3 {
        let place = (f64::from(node.position[axis]) / NODE_STEP_M).round();
        codes[axis] = (place - f64::from(held.0[axis])) as i16;
        for column in 0..3 {
            let identity = f32::from(u8::from(axis == column));
            let turned = f64::from(node.affine[axis][column] - identity);
            codes[3 + 3 * axis + column] = (turned / AFFINE_STEP).round() as i16;
        }
    }
    NodeTransform(codes)
}

fn on_wire(surfel: &Surfel) -> WireSurfel {
    WireSurfel {
        id: surfel.id,
        position_in_world_m: surfel.position,
        normal_in_world: surfel.normal,
        radius_m: surfel.radius_m,
        color: surfel.color,
        confidence: surfel.weight / WEIGHT_MAX,
    }
}

fn time_s(frame: u32) -> f64 {
    f64::from(frame) / RATE_HZ
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
