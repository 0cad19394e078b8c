//! What streaming the model costs and how exact a viewer's copy is, measured through the real model lane.

use dense::{ChangeSet, Surfel};
use protocol::decode_from_server;
use protocol::v1::from_server::Body;
use replica::Replica;

use serde::Serialize;

use super::report::StreamSummary;
use crate::convert;
use crate::publish::model_lane::{LagLimits, ModelLane};
use crate::session::worker::SinkError;

/// Publishes every change as a live session would, follows as a viewer does, and adds up the bytes.
pub struct StreamMeter {
    lane: ModelLane,
    weight_max: f32,
    viewer: Replica,
    summary: StreamSummary,
    rows: Vec<StreamRow>,
}

/// One epoch, as in `stream.csv`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct StreamRow {
    /// Number of the epoch.
    pub epoch: u64,
    /// Stamp of the model that it leads to, nanoseconds.
    pub stamp_ns: u64,
    /// Encoded.
    pub bytes: u64,
}

impl StreamMeter {
    /// Nothing published yet.
    pub fn new(limits: LagLimits, weight_max: f32) -> Self {
        let viewer = Replica::from_the_start();
        let (lane, summary) = (ModelLane::new(limits), StreamSummary::default());
        Self { lane, weight_max, viewer, summary, rows: Vec::new() }
    }

    /// One epoch.
    ///
    /// # Errors
    /// What the lane or the viewer refuses.
    pub fn publish(&mut self, stamp_ns: u64, changes: &ChangeSet) -> Result<(), SinkError> {
        let published = self.lane.publish(&convert::model_update(stamp_ns, changes, self.weight_max))?;
        let bytes = published.message.len() as u64;
        self.summary.bytes += bytes;
        self.summary.epochs += 1;
        self.rows.push(StreamRow { epoch: self.summary.epochs, stamp_ns, bytes });
        if let Some(Body::Epoch(epoch)) = decode_from_server(published.message)?.body {
            self.viewer.take_epoch(&epoch)?;
        }
        Ok(())
    }

    /// Compares what the viewer holds with the model itself.
    pub fn compare(&mut self, model: &[Surfel]) {
        let table = self.viewer.surfels();
        for (&id, seen) in table.ids().iter().zip(table.rows()) {
            if let Ok(index) = model.binary_search_by_key(&id, |surfel| surfel.id) {
                let error_mm = distance_mm(model[index].position, seen.position_in_world_m);
                self.summary.max_error_mm = self.summary.max_error_mm.max(error_mm);
            }
        }
    }

    /// Every epoch so far.
    pub fn rows(&self) -> &[StreamRow] {
        &self.rows
    }

    /// The sums, over `duration_s` of the recording's own time.
    pub fn summary(&self, duration_s: f64) -> StreamSummary {
        let bits = self.summary.bytes as f64 * 8.0;
        let bits_per_s_at_fps = if duration_s > 0.0 { bits / duration_s } else { 0.0 };
        StreamSummary { bits_per_s_at_fps, ..self.summary.clone() }
    }
}

fn distance_mm(a: [f32; 3], b: [f32; 3]) -> f64 {
    let squared: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    squared.sqrt() * 1e3
}
