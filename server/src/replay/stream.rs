//! What streaming the model costs and how exact a viewer's copy is, measured through the real model lane.

use dense::{ChangeSet, Surfel};
use protocol::v1::from_server::Body;
use protocol::{PackedModel, SnapshotAssembly, decode_from_server};

use super::report::StreamSummary;
use crate::convert;
use crate::publish::model_lane::ModelLane;
use crate::session::worker::SinkError;

/// Publishes every change as a live session would and adds up the bytes.
pub struct StreamMeter {
    lane: ModelLane,
    weight_max: f32,
    summary: StreamSummary,
}

impl StreamMeter {
    /// Nothing published yet.
    pub fn new(budget_bytes: usize, weight_max: f32) -> Self {
        Self { lane: ModelLane::new(budget_bytes), weight_max, summary: StreamSummary::default() }
    }

    /// One epoch.
    pub fn publish(&mut self, stamp_ns: u64, changes: &ChangeSet) -> Result<(), SinkError> {
        let published = self.lane.publish(&convert::model_update(stamp_ns, changes, self.weight_max))?;
        self.summary.bytes += published.bytes as u64;
        self.summary.epochs += 1;
        Ok(())
    }

    /// Compares what a late joiner would get with the model itself.
    pub fn compare(&mut self, model: &[Surfel]) -> Result<(), SinkError> {
        let Some(viewer) = self.late_joiner()? else { return Ok(()) };
        for seen in viewer.surfels() {
            if let Ok(index) = model.binary_search_by_key(&seen.id, |surfel| surfel.id) {
                let error_mm = distance_mm(model[index].position, seen.position_in_world_m);
                self.summary.max_error_mm = self.summary.max_error_mm.max(error_mm);
            }
        }
        Ok(())
    }

    fn late_joiner(&self) -> Result<Option<PackedModel>, SinkError> {
        let mut assembly = SnapshotAssembly::default();
        for chunk in self.lane.snapshot() {
            if let Some(Body::Snapshot(chunk)) = decode_from_server(chunk)?.body
                && let Some(model) = assembly.push(&chunk)?
            {
                return Ok(Some(model));
            }
        }
        Ok(None)
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
