//! Data sets of images and calibration files to recordings.
