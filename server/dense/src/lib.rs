//! Dense surfel SLAM on the GPU.
