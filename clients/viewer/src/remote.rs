//! The model of a session that is followed over the network.

use std::sync::Arc;
use std::time::{Duration, Instant};

use geometry::viewpoint::Bounds;
use gpu::{Gpu, GpuError};
use protocol::v1::SessionStatus;
use render::{SurfelArrays, SurfelUpload};

use crate::age;
use crate::banner::{Situation, message_for};
use crate::scene::Scene;
use crate::shown::{Shown, Status};
use crate::{Feed, ViewerError};

/// Uploads what the feed brings.
#[derive(Debug)]
pub struct RemoteModel {
    feed: Feed,
    hide_after: Option<Duration>,
    scene: Scene,
    upload: SurfelUpload,
    uploaded_version: u64,
    /// Of the surfels of a version.
    bounds: (u64, Option<Bounds>),
}

impl RemoteModel {
    /// Shows what `feed` brings; a model older than `hide_after` is hidden.
    ///
    /// # Errors
    /// [`ViewerError::Gpu`].
    pub fn new(gpu: &Gpu, feed: Feed, hide_after: Option<Duration>) -> Result<Self, ViewerError> {
        let upload = SurfelUpload::new(gpu)?;
        let scene = feed.scene();
        Ok(Self { feed, hide_after, scene, upload, uploaded_version: 0, bounds: (0, None) })
    }

    fn find_bounds(&mut self) -> Option<Bounds> {
        let Scene { surfels, version, .. } = &self.scene;
        if self.bounds.0 != *version {
            let places = surfels.iter().map(|surfel| (&surfel.position_in_world_m, &surfel.normal_in_world));
            self.bounds = (*version, (!surfels.is_empty()).then(|| Bounds::of(places)));
        }
        self.bounds.1
    }
}

impl Shown for RemoteModel {
    fn weight_max(&self) -> f32 {
        1.0
    }

    fn status(&mut self, now: Instant) -> Status {
        self.scene = self.feed.scene();
        let bounds = self.find_bounds();
        let scene = &self.scene;
        let (silence, age) = (scene.model_age.silence(now), scene.model_age.age(now));
        let status = scene.state.status();
        let expected = status != SessionStatus::Closed;
        let is_hidden = expected && self.hide_after.is_some_and(|limit| age > Some(limit));
        let message = message_for(&Situation {
            connected: scene.connected,
            unknown_session: scene.unknown_session,
            notice: &scene.notice,
            status,
            status_text: &scene.state.text,
            tracking: scene.tracking,
            silence,
            age,
            surfels: scene.surfels.len(),
            hidden: is_hidden,
        });
        Status {
            bounds,
            scope: scene.camera.zip(scene.world_from_scope),
            is_stale: age::is_stale(status, silence),
            is_hidden,
            message,
            is_complete: scene.is_current && !scene.surfels.is_empty(),
        }
    }

    fn arrays(&mut self, gpu: &Gpu) -> Result<SurfelArrays, GpuError> {
        if self.uploaded_version != self.scene.version {
            self.upload.replace(gpu, &Arc::clone(&self.scene.surfels))?;
            self.uploaded_version = self.scene.version;
        }
        Ok(self.upload.arrays().clone())
    }
}
