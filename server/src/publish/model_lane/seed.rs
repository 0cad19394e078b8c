//! Snapshots for viewers, packed off the lock and off the session's own thread, each encoded once for all.

use std::sync::OnceLock;

use protocol::v1::from_server;
use protocol::{Bytes, PackedModel, PlacedChunk, ProtocolError, WireSurfel};

use super::detail::{Detail, ViewerWishes, distance_m};

/// The model at one epoch; nothing is packed before somebody wants it.
pub(super) struct SeedBase {
    account: PackedModel,
    shapes: Option<Vec<WireSurfel>>,
    model: OnceLock<Result<PackedModel, ProtocolError>>,
    full: OnceLock<Result<Vec<EncodedChunk>, ProtocolError>>,
}

#[derive(Clone)]
struct EncodedChunk {
    centre_in_world_m: Option<[f32; 3]>,
    bytes: Bytes,
}

/// What a viewer is sent first.
pub(super) struct Prepared {
    /// Encoded chunks, in the order in which they are to be sent.
    pub chunks: Vec<Bytes>,
    /// Its own model where it gets a part only.
    pub thin: Option<(PackedModel, Detail)>,
}

impl SeedBase {
    /// Of `account`, with the shapes that viewers hold where the account's are outdated.
    pub fn new(account: PackedModel, shapes: Option<Vec<WireSurfel>>) -> Self {
        Self { account, shapes, model: OnceLock::new(), full: OnceLock::new() }
    }

    /// Surfels of the whole model.
    pub fn surfels(&self) -> usize {
        self.account.surfels().len()
    }

    /// The snapshot for one viewer, with `surfels` of the model at most; takes a while.
    ///
    /// # Errors
    /// Shapes that are not of the surfels that viewers hold.
    pub fn prepare(
        &self,
        wishes: &ViewerWishes,
        surfels: usize,
        scope_in_world_m: Option<[f32; 3]>,
    ) -> Result<Prepared, ProtocolError> {
        let gaze = wishes.gaze_in_world_m.or(scope_in_world_m).unwrap_or_default();
        let model = self.model()?;
        if surfels >= model.surfels().len() {
            let full = self.full.get_or_init(|| encode(model.snapshot()?));
            return Ok(Prepared { chunks: outwards(full.clone()?, gaze), thin: None });
        }
        let detail = Detail::of(model, surfels, gaze);
        let thin = detail.thin(model)?;
        let chunks = outwards(encode(thin.snapshot()?)?, gaze);
        Ok(Prepared { chunks, thin: Some((thin, detail)) })
    }

    fn model(&self) -> Result<&PackedModel, ProtocolError> {
        let refreshed = || {
            let mut model = self.account.clone();
            if let Some(shapes) = &self.shapes {
                model.refresh(shapes)?;
            }
            Ok(model)
        };
        self.model.get_or_init(refreshed).as_ref().map_err(Clone::clone)
    }
}

fn encode(chunks: Vec<PlacedChunk>) -> Result<Vec<EncodedChunk>, ProtocolError> {
    let encode = |placed: PlacedChunk| EncodedChunk {
        centre_in_world_m: placed.centre_in_world_m,
        bytes: protocol::from_server_compressed(from_server::Body::Snapshot(placed.chunk)),
    };
    Ok(chunks.into_iter().map(encode).collect())
}

/// Nearest to the gaze first; the chunk with the nodes before all others.
fn outwards(mut chunks: Vec<EncodedChunk>, gaze_in_world_m: [f32; 3]) -> Vec<Bytes> {
    let distance =
        |chunk: &EncodedChunk| chunk.centre_in_world_m.map_or(-1.0, |c| distance_m(c, gaze_in_world_m));
    chunks.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    chunks.into_iter().map(|chunk| chunk.bytes).collect()
}
