//! Deforming-organ stereo scenes with ground truth.
