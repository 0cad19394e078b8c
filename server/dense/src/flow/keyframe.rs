//! The picture that patches are followed from.

use gpu::{FrameRecorder, Gpu, GpuBuffer, GpuError};

use super::take_templates::samples;
use crate::followed::CarriedPoints;
use crate::node_graph::GraphSettings;
use crate::store::Row;
use crate::{DenseConfig, Observation};

/// An earlier picture, and the tissue that each of its patches shows.
#[derive(Debug)]
pub(crate) struct Keyframe {
    /// Depth then, m.
    pub depth: GpuBuffer<f32>,
    /// What its patches looked like: see `take_templates.wgsl`.
    pub templates: GpuBuffer<Row>,
    /// Where the tissue of each patch is now; the fourth value is 1 where there is some.
    pub tissue: CarriedPoints,
    /// How many patches there are.
    pub patches: u32,
    renew_frames: u32,
    /// Frames since it was taken.
    age: Option<u32>,
}

impl Keyframe {
    /// For pictures like `observation`; none is held yet.
    pub fn new(gpu: &Gpu, observation: &Observation, config: &DenseConfig) -> Result<Self, GpuError> {
        let (_, [columns, rows]) = config.flow.grid((observation.width, observation.height));
        let patches = columns * rows;
        let settings = GraphSettings { surfels: patches, ..GraphSettings::new(&config.nodes) };
        Ok(Self {
            depth: gpu.storage("keyframe depth", observation.depth.len())?,
            templates: gpu
                .storage("patch templates", (patches.max(1) as usize) * samples(config.flow.radius))?,
            tissue: CarriedPoints::new(gpu, patches.max(1) as usize, &settings)?,
            patches,
            renew_frames: config.flow.keyframe_frames,
            age: None,
        })
    }

    /// Goes on to the next frame; `fused` says whether the last one was, as else the picture taken there is not what the
    /// model shows. Whether patches can be followed from the keyframe.
    pub fn advance(&mut self, fused: bool) -> bool {
        let held = self.age.filter(|&age| fused || age > 0);
        self.age = Some(held.map_or(0, |age| (age + 1) % self.renew_frames));
        held.is_some()
    }

    /// Whether this frame's picture becomes the keyframe.
    pub fn is_due(&self) -> bool {
        self.age == Some(0)
    }

    /// Takes this frame's depth.
    pub fn record_depth(&self, frame: &mut FrameRecorder, observation: &Observation) -> Result<(), GpuError> {
        frame.copy(&observation.depth, &self.depth, self.depth.len())
    }
}

#[cfg(test)]
mod tests {
    use super::Keyframe;
    use crate::Observation;
    use crate::testing::{config, gpu};

    fn keyframe(keyframe_frames: u32) -> Keyframe {
        let gpu = gpu();
        let mut config = config();
        config.flow.keyframe_frames = keyframe_frames;
        Keyframe::new(&gpu, &Observation::new(&gpu, 40, 30).unwrap(), &config).unwrap()
    }

    #[test]
    fn a_keyframe_is_taken_at_once_and_renewed_after_its_time() {
        let mut keyframe = keyframe(3);
        let steps: Vec<(bool, bool)> = (0..8).map(|_| (keyframe.advance(true), keyframe.is_due())).collect();
        assert_eq!(
            steps,
            [
                (false, true),
                (true, false),
                (true, false),
                (true, true),
                (true, false),
                (true, false),
                (true, true),
                (true, false)
            ]
        );
    }

    #[test]
    fn a_keyframe_taken_of_a_frame_that_was_not_fused_is_taken_anew() {
        let mut keyframe = keyframe(3);
        assert!(!keyframe.advance(true));
        assert!(!keyframe.advance(false) && keyframe.is_due());
        assert!(keyframe.advance(true) && !keyframe.is_due());
        assert!(keyframe.advance(false), "an older one stays");
    }
}
