//! Plays a run's updates into a session's lanes at the frame rate, in place of a reconstruction.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use mis_slam::convert;
use mis_slam::session::engine::{Engine, EngineError, EngineResults, EngineStart, RunningEngine};
use mis_slam::session::hub::{Hub, PoseUpdate};
use mis_slam::session::mailbox::MailboxReceiver;
use mis_slam::session::worker::StereoPair;
use protocol::v1::{RigidTransform, TrackingOutcome};

use crate::clock::thread_cpu;
use crate::selection::Run;

/// What was published and when.
#[derive(Clone, Copy, Debug)]
pub struct Sent {
    /// Before the frame's update was handed to the lane; epoch n is frame n - 1.
    pub at: Instant,
    /// CPU time of handing it over: reconciling, packing, compressing, queueing.
    pub cpu: Duration,
    /// Bytes to each viewer.
    pub bytes: usize,
    /// Most that waits for any viewer after it.
    pub backlog_bytes: usize,
}

/// The player.
pub struct Player {
    pub run: Arc<Run>,
    pub rate_hz: f64,
    pub weight_max: f32,
    /// Frames are played once this is set.
    pub go: Arc<AtomicBool>,
    pub sent: Arc<Mutex<Vec<Sent>>>,
}

struct Playing(JoinHandle<()>);

impl RunningEngine for Playing {
    fn join(self: Box<Self>) -> Option<EngineResults> {
        // A player that failed has nothing to say that the missing figures do not.
        let _ = self.0.join();
        None
    }
}

impl Engine for Player {
    fn start(
        &self,
        _: &EngineStart,
        pairs: MailboxReceiver<StereoPair>,
        hub: Arc<Hub>,
    ) -> Result<Box<dyn RunningEngine>, EngineError> {
        let (run, go, sent) = (Arc::clone(&self.run), Arc::clone(&self.go), Arc::clone(&self.sent));
        let (period, weight_max) = (Duration::from_secs_f64(1.0 / self.rate_hz), self.weight_max);
        let play = move || {
            while !go.load(Ordering::Acquire) {
                std::thread::park_timeout(Duration::from_millis(5));
            }
            let begin = Instant::now();
            for (number, frame) in run.frames.iter().enumerate() {
                let due = begin + period * number as u32;
                while Instant::now() < due {
                    std::thread::park_timeout(due - Instant::now());
                }
                let told = play_frame(&hub, &run, number, weight_max);
                sent.lock().unwrap_or_else(PoisonError::into_inner).push(told);
                debug_assert_eq!(frame.update.stamp_ns, number as u64 + 1);
            }
            // The session lives on until its input ends.
            while pairs.take().is_some() {}
        };
        Ok(Box::new(Playing(std::thread::spawn(play))))
    }
}

fn play_frame(hub: &Hub, run: &Run, number: usize, weight_max: f32) -> Sent {
    let frame = &run.frames[number];
    let (at, cpu) = (Instant::now(), thread_cpu());
    let published = hub.model.publish(&frame.update);
    let cpu = thread_cpu() - cpu;
    hub.publish_pose(&PoseUpdate {
        stamp_ns: frame.update.stamp_ns,
        sequence: number as u64,
        outcome: TrackingOutcome::Tracked,
        world_from_camera: Some(RigidTransform { qw: 1.0, ..RigidTransform::default() }),
        matched_features: 100,
        lost_for_ns: 0,
        picture: "good",
    });
    if let Some(kept) = frame.kept.as_ref().filter(|_| hub.model.wants_shapes()) {
        let shapes = kept.held.iter().map(|surfel| convert::surfel_to_wire(surfel, weight_max));
        hub.model.bring_shapes(shapes.collect());
    }
    let bytes = published.map_or(0, |published| published.message.len());
    Sent { at, cpu, bytes, backlog_bytes: hub.model.backlog_bytes() }
}
