//! ELAS as one frame records it.

use gpu::{BoundKernel, FrameRecorder, Gpu, KernelDeclaration, Readback};

use super::buffers::Buffers;
use super::config::ElasConfig;
use super::drop_redundant::{self, Lines};
use super::filters::{self, Filters};
use super::search::Search;
use super::triangulation::{self, Lattice, Room};
use super::{
    adaptive_mean, check_views, close_gaps, describe, drop_implausible, fill_triangles, mark_candidates,
    match_candidates, match_prior, match_support, sobel,
};
use crate::DenseError;
use crate::disparity::band::Band;
use crate::disparity::buffers::Images;
use crate::disparity::config::DisparityConfig;
use crate::preprocess::Preprocess;

/// The kernels of ELAS, bound to the images of a stage.
#[derive(Debug)]
pub(in crate::disparity) struct Elas {
    whole: Band,
    search: Search,
    add_corners: bool,
    buffers: Buffers,
    support_readback: Readback<i32>,
    describe: [BoundKernel; 2],
    support: SupportKernels,
    candidates: [BoundKernel; 2],
    prior: PriorKernels,
    filters: Filters,
}

/// From descriptors to the support points that are triangulated.
#[derive(Debug)]
struct SupportKernels {
    matching: BoundKernel,
    implausible: BoundKernel,
    redundant: [(BoundKernel, u32); 2],
}

/// From triangles to the checked disparities of the left view.
#[derive(Debug)]
struct PriorKernels {
    fill: BoundKernel,
    matching: BoundKernel,
    check: BoundKernel,
}

impl Elas {
    pub fn new(
        gpu: &Gpu,
        input: &Preprocess,
        whole: Band,
        images: &Images,
        config: &DisparityConfig,
    ) -> Result<Self, DenseError> {
        let search = Search::new(&whole, &config.elas);
        let buffers = Buffers::new(gpu, &whole, &search)?;
        Ok(Self {
            describe: [
                sobel::bind(gpu, images, input, &buffers)?,
                describe::bind(gpu, images, input, &buffers)?,
            ],
            support: SupportKernels::new(gpu, images, &search, &buffers)?,
            candidates: [
                mark_candidates::bind(gpu, images, &buffers)?,
                match_candidates::bind(gpu, images, &buffers)?,
            ],
            prior: PriorKernels::new(gpu, images, &config.elas, &buffers)?,
            filters: Filters::new(gpu, whole, images, input.left(), config)?,
            support_readback: Readback::new(gpu, "support points", search.candidates())?,
            add_corners: config.elas.add_corners,
            whole,
            search,
            buffers,
        })
    }

    /// Records the matching of the prepared pair. What was recorded before is handed to the GPU on the way: the
    /// triangulation waits for the support points.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        let Band { width, height, words, .. } = self.whole;
        frame.stage("descriptors", |stage| {
            self.describe.iter().try_for_each(|kernel| stage.run(kernel, [words, height, 2]))
        })?;
        self.support.record(frame, &self.search)?;
        self.support_readback.fetch(frame, &self.buffers.plausible, 0);
        let supported = frame.flush();
        frame.stage("candidate matching", |stage| {
            let cells = self.search.cell_columns * self.search.cell_rows;
            stage.run(&self.candidates[0], [cells * self.search.mask_words, 2, 1])?;
            stage.run(&self.candidates[1], [width, height, 2])
        })?;
        frame.flush();
        let strips =
            self.triangulate(frame.gpu(), &self.support_readback.read_after(frame.gpu(), supported)?)?;
        frame.clear(&self.buffers.triangle_of);
        frame.stage("prior matching", |stage| {
            stage.run(&self.prior.fill, [strips, 1, 1])?;
            stage.run(&self.prior.matching, [width, height, 2])?;
            stage.run(&self.prior.check, [words, height, 1])
        })?;
        self.filters.record(frame)
    }

    /// Writes the triangles of the support points, returns the number of strips.
    fn triangulate(&self, gpu: &Gpu, support: &[i32]) -> Result<u32, DenseError> {
        let size = (self.whole.width, self.whole.height);
        let lattice = Lattice { step: self.search.step as i32, columns: self.search.columns as usize };
        let mut points = triangulation::points(support, &lattice);
        if self.add_corners {
            triangulation::add_corners(&mut points, size);
        }
        let triangles = triangulation::triangles(&points, size.1, Room::new(support.len()));
        gpu.write(&self.buffers.corners, 0, &triangles.corners)?;
        gpu.write(&self.buffers.planes, 0, &triangles.planes)?;
        gpu.write(&self.buffers.strips, 0, &triangles.strips)?;
        let count = triangles.strips.len() as u32;
        gpu.write(&self.buffers.strip_count, 0, &[[count, 0, 0, 0]])?;
        Ok(count)
    }
}

impl SupportKernels {
    fn new(gpu: &Gpu, images: &Images, search: &Search, buffers: &Buffers) -> Result<Self, DenseError> {
        let [columns, rows] = Lines::both(search);
        Ok(Self {
            matching: match_support::bind(gpu, images, buffers)?,
            implausible: drop_implausible::bind(gpu, buffers)?,
            redundant: [
                (drop_redundant::bind(gpu, &columns, buffers)?, columns.count),
                (drop_redundant::bind(gpu, &rows, buffers)?, rows.count),
            ],
        })
    }

    fn record(&self, frame: &mut FrameRecorder, search: &Search) -> Result<(), DenseError> {
        let candidates = [search.columns, search.rows, 1];
        frame.stage("support points", |stage| {
            stage.run(&self.matching, candidates)?;
            stage.run(&self.implausible, candidates)?;
            self.redundant.iter().try_for_each(|(kernel, lines)| stage.run(kernel, [*lines, 1, 1]))
        })?;
        Ok(())
    }
}

impl PriorKernels {
    fn new(gpu: &Gpu, images: &Images, elas: &ElasConfig, buffers: &Buffers) -> Result<Self, DenseError> {
        let checked = filters::checked(images, elas);
        Ok(Self {
            fill: fill_triangles::bind(gpu, images, buffers)?,
            matching: match_prior::bind(gpu, images, buffers)?,
            check: check_views::bind(gpu, images, buffers, checked)?,
        })
    }
}

/// The declarations of all kernels of ELAS.
pub(in crate::disparity) fn kernels() -> Vec<KernelDeclaration> {
    vec![
        sobel::DECLARATION,
        describe::DECLARATION,
        match_support::DECLARATION,
        drop_implausible::DECLARATION,
        drop_redundant::DECLARATION,
        mark_candidates::DECLARATION,
        match_candidates::DECLARATION,
        fill_triangles::DECLARATION,
        match_prior::DECLARATION,
        check_views::DECLARATION,
        close_gaps::DECLARATION,
        adaptive_mean::DECLARATION,
    ]
}
