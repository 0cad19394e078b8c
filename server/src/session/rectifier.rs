//! Brings pairs into the rectified rig.

use geometry::{Eye, GeometryError, Mask, Rectification, StereoRig};
use recording::Calibration;

use super::worker::StereoPair;

/// Brings pairs into the rectified rig.
pub(super) enum Rectifier {
    AlreadyRectified(StereoRig),
    Remap(Box<Remap>),
}

pub(super) struct Remap {
    rectification: Rectification,
    /// Rectified pixels that the left camera does not see; `None` where it sees all.
    blind: Option<Mask>,
}

impl Remap {
    fn new(rectification: Rectification) -> Self {
        let blind = rectification.blind_mask(Eye::Left);
        let blind = blind.pixels().iter().any(|&covered| covered != 0).then_some(blind);
        Self { rectification, blind }
    }

    fn apply(&self, pair: &StereoPair) -> Result<StereoPair, GeometryError> {
        let (left, right) = self.rectification.rectify_rgb(&pair.left, &pair.right)?;
        let instruments = pair.mask.as_ref();
        let instruments =
            instruments.map(|mask| self.rectification.rectify_mask(Eye::Left, mask)).transpose()?;
        let mask = instruments.or_else(|| self.blind.clone());
        let StereoPair { stamp_ns, sequence, policy, .. } = *pair;
        Ok(StereoPair { stamp_ns, sequence, left, right, mask, policy })
    }
}

impl Rectifier {
    pub fn new(calibration: &Calibration) -> Result<Self, GeometryError> {
        Ok(match calibration {
            Calibration::Rectified(rig) => Self::AlreadyRectified(*rig),
            Calibration::Raw(raw) => Self::Remap(Box::new(Remap::new(Rectification::from_calibration(raw)?))),
        })
    }

    pub fn rig(&self) -> &StereoRig {
        match self {
            Self::AlreadyRectified(rig) => rig,
            Self::Remap(remap) => remap.rectification.rig(),
        }
    }

    pub fn apply(&self, pair: StereoPair) -> Result<StereoPair, GeometryError> {
        match self {
            Self::AlreadyRectified(_) => Ok(pair),
            Self::Remap(remap) => remap.apply(&pair),
        }
    }
}
