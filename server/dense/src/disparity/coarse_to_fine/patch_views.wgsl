// The high-passed eyes, as high_pass.wgsl writes and aim_patch.wgsl reads them: a pixel and the one to its right in one
// word, so that four neighbours cost two reads.

// Grey levels of the largest value; half a step is 0.004 levels, a picture's noise a hundred times that.
const LEVELS = 256.0;
// A masked pixel: no unmasked one comes so low.
const COVERED = -1.0;
