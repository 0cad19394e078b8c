//! The pairs of a simulated scene, held in memory.

use geometry::StereoRig;
use simulator::{SceneConfig, Simulation, SimulatorError};

use crate::session::mailbox::Policy;
use crate::session::worker::StereoPair;

/// A rig and what it saw.
pub(super) struct Scene {
    pub rig: StereoRig,
    pub pairs: Vec<StereoPair>,
}

impl Scene {
    /// Renders all pairs; `step` is called after each.
    pub fn render(config: &SceneConfig, step: &mut dyn FnMut()) -> Result<Self, SimulatorError> {
        let simulation = Simulation::new(config)?;
        let mut pairs = Vec::with_capacity(simulation.frames() as usize);
        for number in 0..simulation.frames() {
            let frame = simulation.frame(number)?;
            pairs.push(StereoPair {
                stamp_ns: frame.stamp_ns,
                sequence: u64::from(number),
                left: frame.left,
                right: frame.right,
                mask: None,
                // None is passed over: each is to be measured.
                policy: Policy::Lossless,
            });
            step();
        }
        Ok(Self { rig: *simulation.rig(), pairs })
    }
}
