//! Both eyes at all levels.

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuError};

use super::halve::{self, halved};
use super::refinement::Views;
use crate::preprocess::{EyeBuffers, Eyes, Preprocess};

/// Level 0 is the prepared pair; each further one is half as large.
#[derive(Debug)]
pub(super) struct Pyramid {
    sizes: Vec<(u32, u32)>,
    halves: Vec<[EyeBuffers; 2]>,
    kernels: Vec<[BoundKernel; 2]>,
}

impl Pyramid {
    pub fn new(gpu: &Gpu, input: &Preprocess, coarsest: u32) -> Result<Self, GpuError> {
        let mut pyramid = Self { sizes: vec![input.size()], halves: Vec::new(), kernels: Vec::new() };
        for level in 0..coarsest {
            let fine_size = pyramid.size(level);
            let size = halved(fine_size);
            let fine = pyramid.eyes(input, level);
            let [left, right] = [fine.left.resized(gpu, size)?, fine.right.resized(gpu, size)?];
            let kernels = [
                halve::bind(gpu, fine_size, fine.left, &left)?,
                halve::bind(gpu, fine_size, fine.right, &right)?,
            ];
            pyramid.sizes.push(size);
            pyramid.halves.push([left, right]);
            pyramid.kernels.push(kernels);
        }
        Ok(pyramid)
    }

    /// Columns, rows.
    pub fn size(&self, level: u32) -> (u32, u32) {
        self.sizes[level as usize]
    }

    pub fn eyes<'a>(&'a self, input: &'a Preprocess, level: u32) -> Eyes<'a> {
        match level.checked_sub(1).map(|index| &self.halves[index as usize]) {
            Some([left, right]) => Eyes { left, right },
            None => input.eyes(),
        }
    }

    /// The images that the planes of `level` are refined in: the next finer ones, where there are any.
    pub fn views<'a>(&'a self, input: &'a Preprocess, level: u32) -> Views<'a> {
        let finer = level.saturating_sub(1);
        Views { eyes: self.eyes(input, finer), size: self.size(finer), cell: 1 + level - finer }
    }

    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), GpuError> {
        frame.stage("pyramid", |stage| {
            self.kernels.iter().zip(&self.sizes[1..]).try_for_each(|(eyes, &(width, height))| {
                eyes.iter().try_for_each(|kernel| stage.run(kernel, [width.div_ceil(4), height, 1]))
            })
        })
    }
}
