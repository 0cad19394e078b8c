//! The GPU device, kernels, buffers, readback and timing.
