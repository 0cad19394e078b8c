//! A viewer that joins a large model late, over a link of 50 Mbit/s, while the model goes on deforming.

use std::sync::Arc;
use std::time::{Duration, Instant};

use replica::Replica;

use crate::arguments::Arguments;
use crate::error::StreamError;
use crate::figures::Figures;
use crate::link::Link;
use crate::selection::Run;
use crate::server::BenchServer;
use crate::viewer::{Heard, Viewer};

const LINK: Link = Link { bits_per_s: 50e6, delay: Duration::ZERO, loss: 0.0 };
/// Frames before it joins.
const JOINS_AFTER: u32 = 12;

/// What the joiner saw.
pub struct Joined {
    pub surfels: usize,
    /// From the first byte that it sent.
    pub first_chunk: Duration,
    pub complete: Duration,
    pub bytes: usize,
    pub errors_mm: Vec<f64>,
    /// Whether it holds what one holds that was there from the start.
    pub digest_is_equal: bool,
}

/// Joins.
pub fn measure(arguments: &Arguments, run: &Arc<Run>, figures: &mut Figures) -> Result<(), StreamError> {
    let joined = tokio::runtime::Runtime::new()?.block_on(join(arguments, run))?;
    figures.late_join(&joined);
    Ok(())
}

async fn join(arguments: &Arguments, run: &Arc<Run>) -> Result<Joined, StreamError> {
    let server = BenchServer::start(run, arguments.rate_hz).await?;
    let mut early = Viewer::join(server.address, Some(Replica::default())).await?;
    tokio::time::sleep(Duration::from_millis(300)).await;
    server.play();
    while !matches!(early.hear().await?, Heard::Epoch(epoch) if epoch >= JOINS_AFTER) {}
    let following = tokio::spawn(async move {
        let mut digests = std::collections::BTreeMap::new();
        while let Ok(Ok(heard)) = tokio::time::timeout(Duration::from_secs(2), early.hear()).await {
            if let (Heard::Epoch(epoch), Some(replica)) = (heard, &early.replica) {
                digests.insert(epoch, replica.digest());
            }
        }
        digests
    });
    let begin = Instant::now();
    let address = LINK.open(server.address).await?;
    let mut late = Viewer::join(address, Some(Replica::default())).await?;
    let mut first_chunk = None;
    while late.replica.as_ref().is_some_and(|replica| !replica.is_current()) {
        late.hear().await?;
        if late.bytes > 0 {
            first_chunk.get_or_insert_with(|| begin.elapsed());
        }
    }
    let (complete, bytes) = (begin.elapsed(), late.bytes);
    let mut errors_mm = late.errors_mm(run);
    while errors_mm.is_none() {
        late.hear().await?;
        errors_mm = late.errors_mm(run);
    }
    let (epoch, digest, surfels) = late
        .replica
        .as_ref()
        .map_or_else(Default::default, |r| (r.epoch(), Some(r.digest()), r.surfels().len()));
    let digests = following.await?;
    server.stop().await?;
    Ok(Joined {
        surfels,
        first_chunk: first_chunk.unwrap_or(complete),
        complete,
        bytes,
        errors_mm: errors_mm.unwrap_or_default(),
        digest_is_equal: digest.is_some() && digests.get(&epoch).copied() == digest,
    })
}
