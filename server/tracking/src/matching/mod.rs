//! Finding the same thing twice: left and right, map and image, image and image.

pub mod brute_force;
pub mod projection;
pub mod stereo_rows;
pub mod subpixel;
