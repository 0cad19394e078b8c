//! Blood vessels as capsules on the surface, found by pixel through a grid of cells.

use nalgebra::Vector3;

use super::noise::smooth_step;

/// Edge of a grid cell.
const CELL_MM: f32 = 2.0;

/// How a vessel shines through the tissue over it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VesselTone {
    /// Index into the material's vessel colours.
    pub colour: u8,
    /// Share of the vessel's colour in the middle of it.
    pub opacity: f32,
    /// Width of its border as a share of its radius: deep vessels are blurred.
    pub blur: f32,
    /// Height of its ridge as a share of its radius.
    pub relief: f32,
}

impl VesselTone {
    /// The tone of a vessel that has risen from the depth only by a share: fainter, broader, flat.
    pub fn deep(self, risen: f32) -> Self {
        Self {
            opacity: self.opacity * risen,
            blur: self.blur + 0.5 * (1.0 - risen),
            relief: self.relief * risen,
            ..self
        }
    }
}

/// A straight piece of a vessel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub from_mm: Vector3<f32>,
    pub to_mm: Vector3<f32>,
    pub from_radius_mm: f32,
    pub to_radius_mm: f32,
    pub tone: VesselTone,
}

/// The vessel seen at a point.
#[derive(Clone, Copy)]
pub(crate) struct VesselSample {
    pub colour: u8,
    /// Share of the vessel's colour, 0 to 1.
    pub coverage: f32,
    /// Gradient of the ridge over the vessel.
    pub gradient: Vector3<f32>,
}

/// All vessels of a body with a grid over their bounding box (cells in compressed rows).
pub(crate) struct VesselMap {
    segments: Vec<Segment>,
    origin_mm: Vector3<f32>,
    size: [usize; 3],
    cell_start: Vec<u32>,
    cell_segments: Vec<u32>,
}

impl Segment {
    fn reach_mm(&self) -> f32 {
        let radius = self.from_radius_mm.max(self.to_radius_mm);
        radius * (1.0 + self.tone.blur) + 0.25
    }

    /// Offset from the nearest point of the axis, and the radius there.
    fn nearest(&self, point_mm: &Vector3<f32>) -> (Vector3<f32>, f32) {
        let axis = self.to_mm - self.from_mm;
        let offset = point_mm - self.from_mm;
        let share = (offset.dot(&axis) / axis.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        (offset - axis * share, self.from_radius_mm + (self.to_radius_mm - self.from_radius_mm) * share)
    }

    fn sample(&self, point_mm: &Vector3<f32>, footprint_mm: f32) -> Option<VesselSample> {
        let (offset, radius) = self.nearest(point_mm);
        let border = (radius * self.tone.blur).max(0.6 * footprint_mm);
        let distance_squared = offset.norm_squared();
        if distance_squared >= (radius + border).powi(2) {
            return None;
        }
        let inside = 1.0 - smooth_step(radius - border, radius + border, distance_squared.sqrt());
        let shown = self.tone.opacity * (2.0 * radius / footprint_mm).min(1.0);
        let ridge = -2.0 * self.tone.relief / (radius + border) * inside;
        Some(VesselSample { colour: self.tone.colour, coverage: inside * shown, gradient: offset * ridge })
    }
}

impl VesselMap {
    pub fn new(segments: Vec<Segment>) -> Self {
        let (mut low, mut high) = (Vector3::repeat(f32::INFINITY), Vector3::repeat(f32::NEG_INFINITY));
        for segment in &segments {
            let reach = Vector3::repeat(segment.reach_mm());
            low = low.inf(&(segment.from_mm.inf(&segment.to_mm) - reach));
            high = high.sup(&(segment.from_mm.sup(&segment.to_mm) + reach));
        }
        if segments.is_empty() {
            (low, high) = (Vector3::zeros(), Vector3::zeros());
        }
        let size = [0, 1, 2].map(|axis| ((high[axis] - low[axis]) / CELL_MM) as usize + 1);
        let mut map =
            Self { segments, origin_mm: low, size, cell_start: Vec::new(), cell_segments: Vec::new() };
        map.fill_cells();
        map
    }

    /// Counting sort of the segments into the cells that they reach.
    fn fill_cells(&mut self) {
        let mut start = vec![0_u32; self.size.iter().product::<usize>() + 1];
        for segment in &self.segments {
            self.for_each_cell(segment, |cell| start[cell + 1] += 1);
        }
        for cell in 1..start.len() {
            start[cell] += start[cell - 1];
        }
        let mut next = start.clone();
        let mut sorted = vec![0_u32; start[start.len() - 1] as usize];
        for (index, segment) in self.segments.iter().enumerate() {
            self.for_each_cell(segment, |cell| {
                sorted[next[cell] as usize] = index as u32;
                next[cell] += 1;
            });
        }
        (self.cell_start, self.cell_segments) = (start, sorted);
    }

    fn for_each_cell(&self, segment: &Segment, mut visit: impl FnMut(usize)) {
        let reach = Vector3::repeat(segment.reach_mm());
        let low = (segment.from_mm.inf(&segment.to_mm) - reach - self.origin_mm) / CELL_MM;
        let high = (segment.from_mm.sup(&segment.to_mm) + reach - self.origin_mm) / CELL_MM;
        let range =
            |axis: usize| low[axis].max(0.0) as usize..=(high[axis] as usize).min(self.size[axis] - 1);
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    visit((z * self.size[1] + y) * self.size[0] + x);
                }
            }
        }
    }

    /// The vessel that shows most at a point of the surface.
    pub fn at(&self, point_mm: &Vector3<f32>, footprint_mm: f32) -> Option<VesselSample> {
        let place = (point_mm - self.origin_mm) / CELL_MM;
        if place.min() < 0.0 {
            return None;
        }
        let [x, y, z] = [place.x as usize, place.y as usize, place.z as usize];
        if x >= self.size[0] || y >= self.size[1] || z >= self.size[2] {
            return None;
        }
        let cell = (z * self.size[1] + y) * self.size[0] + x;
        let range = self.cell_start[cell] as usize..self.cell_start[cell + 1] as usize;
        let seen = self.cell_segments[range]
            .iter()
            .filter_map(|&index| self.segments[index as usize].sample(point_mm, footprint_mm));
        seen.reduce(|best, other| if other.coverage > best.coverage { other } else { best })
    }
}
