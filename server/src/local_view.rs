//! A window on the model of a session of this process, drawn straight from the buffers that it lives in (the paper's
//! sharing of buffers between computation and drawing).

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use dense::DenseSlam;
use geometry::viewpoint::Bounds;
use geometry::{Pinhole, Pose};
use gpu::{Gpu, GpuError};
use mis_slam_view::{STALE_AFTER, Shown, Status};
use protocol::SessionId;
use render::{SurfelArrays, SurfelUpload};

use crate::publish::Throttle;
use crate::session::gpu_turns::{GpuTurns, Seat};
use crate::session::worker::{FusedPair, Sink, SinkError, TrackedPair, WorkerError};

/// How often it is looked where the model is; that reads it back.
const BOUNDS_HZ: f64 = 0.5;

/// What a window is told of the sessions: it shows the one that was opened last.
#[derive(Clone)]
pub struct LocalView {
    newest: Arc<Mutex<Newest>>,
    changed: Arc<dyn Fn() + Send + Sync>,
}

#[derive(Default)]
struct Newest {
    session: Option<SessionId>,
    arrays: Option<SurfelArrays>,
    bounds: Option<Bounds>,
    scope: Option<(Pinhole, Pose)>,
    /// When it was last brought up to date, as long as it should be.
    fused_at: Option<Instant>,
    /// The device is gone that the window draws with.
    is_lost: bool,
}

impl LocalView {
    /// No session yet; `changed` is called when there is something new to draw.
    pub fn new(changed: impl Fn() + Send + Sync + 'static) -> Self {
        Self { newest: Arc::default(), changed: Arc::new(changed) }
    }

    fn newest(&self) -> MutexGuard<'_, Newest> {
        self.newest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What a session that opens now tells the window.
    pub fn observer(&self, session: &SessionId) -> Arc<dyn Sink> {
        *self.newest() = Newest { session: Some(session.clone()), ..Newest::default() };
        let bounds_due = Mutex::new(Throttle::new(BOUNDS_HZ));
        Arc::new(Observer { session: session.clone(), view: self.clone(), bounds_due })
    }

    /// What the window shows, in its turn on the GPU.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`].
    pub fn shown(&self, gpu: &Gpu, turns: &Arc<GpuTurns>, weight_max: f32) -> Result<LocalModel, GpuError> {
        let nothing = SurfelUpload::new(gpu)?.arrays().clone();
        Ok(LocalModel { view: self.clone(), seat: turns.seat(), nothing, weight_max })
    }
}

/// Tells the window where the arrays of one session are.
struct Observer {
    session: SessionId,
    view: LocalView,
    bounds_due: Mutex<Throttle>,
}

impl Observer {
    fn tell(&self, change: impl FnOnce(&mut Newest)) {
        let mut newest = self.view.newest();
        if newest.session.as_ref() == Some(&self.session) && !newest.is_lost {
            change(&mut newest);
            drop(newest);
            (self.view.changed)();
        }
    }

    fn bring_up_to_date(&self, world_from_scope: Option<Pose>, model: &DenseSlam) -> Result<(), SinkError> {
        let due = self.bounds_due.lock().unwrap_or_else(PoisonError::into_inner).admits(Instant::now());
        let bounds = if due { bounds(model)? } else { None };
        let arrays = arrays(model);
        let scope = world_from_scope.map(|pose| (model.rig().left, pose));
        self.tell(|newest| {
            newest.bounds = bounds.or(newest.bounds);
            newest.scope = scope.or(newest.scope);
            newest.arrays = Some(arrays);
            newest.fused_at = Some(Instant::now());
        });
        Ok(())
    }
}

fn bounds(model: &DenseSlam) -> Result<Option<Bounds>, SinkError> {
    let surfels = model.surfels()?;
    let places = surfels.iter().map(|surfel| (&surfel.position, &surfel.normal));
    Ok((!surfels.is_empty()).then(|| Bounds::of(places)))
}

/// The model's own buffers: no surfel is copied.
fn arrays(model: &DenseSlam) -> SurfelArrays {
    let dense::ModelArrays { geometry, orientation, appearance, history, slots } = model.arrays();
    SurfelArrays { geometry, orientation, appearance, history, slots }
}

impl Sink for Observer {
    fn tracked(&self, _pair: &TrackedPair) {}

    fn fused(&self, pair: &FusedPair, model: &mut DenseSlam) -> Result<(), SinkError> {
        self.bring_up_to_date(pair.world_from_camera, model)
    }

    fn idle(&self, _last_stamp_ns: u64, _model: &mut DenseSlam) -> Result<(), SinkError> {
        Ok(())
    }

    fn finished(&self, _last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError> {
        self.bring_up_to_date(None, model)?;
        self.tell(|newest| newest.fused_at = None);
        Ok(())
    }

    /// The buffers are gone with their device, and the window's with them.
    fn model_lost(&self, _why: &str) {
        self.tell(|newest| {
            newest.arrays = None;
            newest.is_lost = true;
        });
    }

    /// On another device than the window's.
    fn model_rebuilt(&self, _last_stamp_ns: u64, _model: &mut DenseSlam) -> Result<(), SinkError> {
        Ok(())
    }

    /// The next fused pair brings the new arrays.
    fn model_restarted(&self, _last_stamp_ns: u64, _model: &mut DenseSlam) -> Result<(), SinkError> {
        Ok(())
    }

    fn failed(&self, _error: Arc<WorkerError>) {
        self.tell(|newest| newest.is_lost = true);
    }
}

/// A model of this process, as a window shows it.
pub struct LocalModel {
    view: LocalView,
    seat: Seat,
    nothing: SurfelArrays,
    weight_max: f32,
}

impl Shown for LocalModel {
    fn weight_max(&self) -> f32 {
        self.weight_max
    }

    fn status(&mut self, now: Instant) -> Status {
        let newest = self.view.newest();
        let silent = newest.fused_at.is_some_and(|fused_at| now.duration_since(fused_at) > STALE_AFTER);
        Status {
            bounds: newest.bounds,
            scope: newest.scope,
            is_stale: newest.is_lost || silent,
            is_complete: newest.arrays.is_some(),
            ..Status::default()
        }
    }

    fn arrays(&mut self, _gpu: &Gpu) -> Result<SurfelArrays, GpuError> {
        Ok(self.view.newest().arrays.clone().unwrap_or_else(|| self.nothing.clone()))
    }

    /// Between two frames of the reconstruction, so that none is seen half done.
    fn in_turn(&self, draw: &mut dyn FnMut()) {
        let _turn = self.seat.take();
        draw();
    }
}
