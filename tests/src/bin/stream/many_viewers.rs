//! Many viewers of one model, without and with a slow one among them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use replica::Replica;

use crate::arguments::Arguments;
use crate::engine::Sent;
use crate::error::StreamError;
use crate::figures::Figures;
use crate::link::Link;
use crate::selection::Run;
use crate::server::BenchServer;
use crate::viewer::Viewer;

/// Frames at the start that are not counted: everything is new then.
const WARM_UP: usize = 15;
/// The slow viewer's link.
const SLOW: Link = Link { bits_per_s: 1e6, delay: Duration::from_millis(200), loss: 0.02 };

/// What a run of many viewers was like.
pub struct Outcome {
    pub sent: Vec<Sent>,
    /// Of all viewers but the slow one.
    pub epoch_latency_ms: Vec<f64>,
    pub pose_latency_ms: Vec<f64>,
    /// Of the viewer with a replica, all surfels of all frames whose truth was kept.
    pub errors_mm: Vec<f64>,
    pub slow: Option<Slow>,
}

/// What became of the slow viewer.
pub struct Slow {
    pub seeds: usize,
    pub bytes: usize,
    /// Right after each seed or epoch.
    pub errors_mm: Vec<f64>,
    /// How long after an epoch was published the viewer stood at it.
    pub ages_s: Vec<f64>,
    pub backlog_bytes: usize,
    pub surfels: usize,
}

/// Both runs.
pub fn measure(arguments: &Arguments, run: &Arc<Run>, figures: &mut Figures) -> Result<(), StreamError> {
    let runtime = tokio::runtime::Runtime::new()?;
    let alone = runtime.block_on(play(arguments, run, false))?;
    figures.viewers(run, &alone);
    let beside_slow = runtime.block_on(play(arguments, run, true))?;
    figures.slow(&alone, &beside_slow);
    Ok(())
}

async fn play(arguments: &Arguments, run: &Arc<Run>, with_slow: bool) -> Result<Outcome, StreamError> {
    let server = BenchServer::start(run, arguments.rate_hz).await?;
    let ends = Instant::now() + server.duration() + Duration::from_secs(2);
    let mut following = Vec::new();
    for number in 0..arguments.viewers - usize::from(with_slow) {
        let replica = (number == 0 && !with_slow).then(Replica::default);
        let viewer = Viewer::join(server.address, replica).await?;
        following.push(tokio::spawn(follow(viewer, Arc::clone(run), ends)));
    }
    let slow = if with_slow {
        let address = SLOW.open(server.address).await?;
        let viewer = Viewer::join(address, Some(Replica::default())).await?;
        Some(tokio::spawn(follow(viewer, Arc::clone(run), ends)))
    } else {
        None
    };
    tokio::time::sleep(Duration::from_millis(300)).await;
    server.play();
    let mut viewers = Vec::new();
    for viewer in following {
        viewers.push(viewer.await??);
    }
    let slow = match slow {
        Some(slow) => Some(slow.await??),
        None => None,
    };
    let sent = server.sent();
    server.stop().await?;
    Ok(outcome(sent, viewers, slow))
}

/// What one viewer saw.
struct Seen {
    viewer: Viewer,
    errors_mm: Vec<f64>,
    stood_at: Vec<(u32, Instant)>,
}

async fn follow(mut viewer: Viewer, run: Arc<Run>, ends: Instant) -> Result<Seen, StreamError> {
    let (mut errors_mm, mut stood_at) = (Vec::new(), Vec::new());
    while let Ok(heard) = tokio::time::timeout_at(ends.into(), viewer.hear()).await {
        if let crate::viewer::Heard::Epoch(epoch) = heard? {
            stood_at.push((epoch, Instant::now()));
            errors_mm.extend(viewer.errors_mm(&run).unwrap_or_default());
        }
    }
    Ok(Seen { viewer, errors_mm, stood_at })
}

fn outcome(sent: Vec<Sent>, viewers: Vec<Seen>, slow: Option<Seen>) -> Outcome {
    let since = |number: usize, at: Instant| {
        let frame = sent.get(number).filter(|_| number >= WARM_UP)?;
        Some(at.duration_since(frame.at).as_secs_f64() * 1e3)
    };
    let mut outcome = Outcome {
        sent: Vec::new(),
        epoch_latency_ms: Vec::new(),
        pose_latency_ms: Vec::new(),
        errors_mm: Vec::new(),
        slow: None,
    };
    for Seen { viewer, errors_mm, .. } in viewers {
        let epochs = viewer.epochs.iter().filter_map(|&(epoch, at)| since(epoch as usize - 1, at));
        outcome.epoch_latency_ms.extend(epochs);
        let poses = viewer.poses.iter().filter_map(|&(sequence, at)| since(sequence as usize, at));
        outcome.pose_latency_ms.extend(poses);
        outcome.errors_mm.extend(errors_mm);
    }
    outcome.slow = slow.map(|Seen { viewer, errors_mm, stood_at }| {
        let ages = stood_at.iter().filter_map(|&(epoch, at)| since((epoch as usize).checked_sub(1)?, at));
        Slow {
            seeds: viewer.seeds,
            bytes: viewer.bytes,
            errors_mm,
            ages_s: ages.map(|ms| ms / 1e3).collect(),
            backlog_bytes: sent.iter().map(|sent| sent.backlog_bytes).max().unwrap_or(0),
            surfels: viewer.replica.map_or(0, |replica| replica.surfels().len()),
        }
    });
    outcome.sent = sent.into_iter().skip(WARM_UP).collect();
    outcome
}
