//! The mapping thread: one piece of work at a time.
//!
//! Tracking hands over a copy of a part of the map and gets a list of edits back, so neither ever waits for a lock. What a replay
//! gives must not depend on the speed of threads: in lockstep the edits are carried out a fixed number of frames after the
//! work was handed over, and tracking waits for them then. Live, they are carried out when they are there.

use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::JoinHandle;

use super::work::{Finished, MappingContext, Work};
use crate::TrackingError;

/// When the results of mapping are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MappingPace {
    /// A fixed number of frames after the keyframe: the same each time.
    Lockstep,
    /// As soon as they are there: tracking never waits.
    Asynchronous,
}

/// Runs mapping beside the tracker.
#[derive(Debug)]
pub struct Mapper {
    pace: MappingPace,
    delay_frames: u64,
    /// `None` once the thread is to end.
    work: Option<SyncSender<Work>>,
    finished: Receiver<Option<Finished>>,
    thread: Option<JoinHandle<()>>,
    /// Number of the frame at which the work under way was handed over.
    started_at: Option<u64>,
}

impl Mapper {
    /// Starts the thread.
    ///
    /// # Errors
    /// [`TrackingError::MappingThread`] where the system refuses one.
    pub fn start(context: MappingContext, pace: MappingPace) -> Result<Self, TrackingError> {
        let delay_frames = u64::from(context.config.mapping.delay_frames);
        let (work, work_in) = sync_channel::<Work>(1);
        let (finished_out, finished) = sync_channel(1);
        let body = move || {
            while let Ok(work) = work_in.recv() {
                let finished = tracing::trace_span!("map").in_scope(|| work.carry_out(&context));
                if finished_out.send(finished).is_err() {
                    break;
                }
            }
        };
        let thread = std::thread::Builder::new()
            .name("mapping".into())
            .spawn(body)
            .map_err(|error| TrackingError::MappingThread(error.to_string()))?;
        let (work, thread) = (Some(work), Some(thread));
        Ok(Self { pace, delay_frames, work, finished, thread, started_at: None })
    }

    /// Whether it has nothing to do.
    pub fn is_idle(&self) -> bool {
        self.started_at.is_none()
    }

    /// Hands work over; the mapper must be idle.
    ///
    /// # Errors
    /// [`TrackingError::MappingThread`] where the thread has died.
    pub fn begin(&mut self, work: Work, frame: u64) -> Result<(), TrackingError> {
        debug_assert!(self.is_idle());
        self.work.as_ref().and_then(|sender| sender.send(work).ok()).ok_or_else(died)?;
        self.started_at = Some(frame);
        Ok(())
    }

    /// The results that are due at a frame.
    ///
    /// # Errors
    /// [`TrackingError::MappingThread`] where the thread has died.
    pub fn due(&mut self, frame: u64) -> Result<Option<Finished>, TrackingError> {
        let Some(started_at) = self.started_at else { return Ok(None) };
        let finished = match self.pace {
            MappingPace::Lockstep if frame < started_at + self.delay_frames => return Ok(None),
            MappingPace::Lockstep => tracing::trace_span!("wait for mapping")
                .in_scope(|| self.finished.recv().map_err(|_| died()))?,
            MappingPace::Asynchronous => match self.finished.try_recv() {
                Ok(finished) => finished,
                Err(TryRecvError::Empty) => return Ok(None),
                Err(TryRecvError::Disconnected) => return Err(died()),
            },
        };
        self.started_at = None;
        Ok(finished)
    }
}

fn died() -> TrackingError {
    TrackingError::MappingThread("it has ended".into())
}

impl Drop for Mapper {
    fn drop(&mut self) {
        self.work = None;
        if let Some(thread) = self.thread.take() {
            // results that nobody takes any more fit into the channel, so the thread ends; a panic there was reported by `due`
            let _ = thread.join();
        }
    }
}
