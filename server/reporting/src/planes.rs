//! Axial, coronal and sagittal views of the model against the truth after the last frame, and slices through both: the
//! paper's figure of the simulated organs.

use evaluation::ComparedSurfaces;
use geometry::Rgb;
use nalgebra::Point3;

use crate::ReportingError;
use crate::axes;
use crate::colors;
use crate::picture::Picture;

const SIDE_PX: u32 = 420;
const DOT_PX: i64 = 2;
/// Half the thickness of a slice.
const SLICE_HALF_M: f64 = 5e-4;
/// Distance from the truth with the brightest colour.
const DISTANCE_MAX_M: f64 = 1e-3;
const TRUTH: [u8; 3] = [0x5b, 0x64, 0x6e];
const TRUTH_LINE: [u8; 3] = [0x53, 0xb0, 0xff];
const MODEL_LINE: [u8; 3] = [0xff, 0x8c, 0x2e];

/// A plane of the recording's world: which coordinates go right and down, and which is looked along.
struct Plane {
    name: &'static str,
    right: usize,
    down: usize,
    along: usize,
}

const PLANES: [Plane; 3] = [
    Plane { name: "axial (x, y)", right: 0, down: 1, along: 2 },
    Plane { name: "coronal (x, z)", right: 0, down: 2, along: 1 },
    Plane { name: "sagittal (y, z)", right: 1, down: 2, along: 0 },
];

/// The three views, then the three slices.
pub(crate) fn pictures(surfaces: &ComparedSurfaces) -> Result<Vec<Picture>, ReportingError> {
    let frame = Frame::of(surfaces);
    let views = PLANES.iter().map(|plane| {
        let caption = format!("{} view, {:.0} mm wide", plane.name, frame.side_m * 1e3);
        Picture::new(caption, &view(plane, surfaces, &frame))
    });
    let slices = PLANES.iter().map(|plane| {
        let caption = format!("{} slice, {:.0} mm thick", plane.name, 2e3 * SLICE_HALF_M);
        Picture::new(caption, &slice(plane, surfaces, &frame))
    });
    views.chain(slices).collect()
}

/// What all pictures show: a cube around the model.
struct Frame {
    middle: Point3<f64>,
    side_m: f64,
}

impl Frame {
    fn of(surfaces: &ComparedSurfaces) -> Self {
        let along = |axis: usize| {
            let values = surfaces.model.iter().map(|point| point.place[axis]);
            axes::most_of(values.collect())
        };
        let ranges = [0, 1, 2].map(along);
        let sides_m = ranges.map(|[low, high]| high - low);
        let middle = ranges.map(|[low, high]| (low + high) / 2.0);
        let side_m = sides_m.into_iter().fold(1e-3, f64::max) * 1.15;
        Self { middle: middle.into(), side_m }
    }

    fn pixel(&self, plane: &Plane, point: &Point3<f64>) -> (i64, i64) {
        let place = |axis: usize| {
            let share = (point[axis] - self.middle[axis]) / self.side_m + 0.5;
            (share * f64::from(SIDE_PX)).floor() as i64
        };
        (place(plane.right), place(plane.down))
    }
}

/// The truth in grey below the model, whose colours tell its distance from the truth.
fn view(plane: &Plane, surfaces: &ComparedSurfaces, frame: &Frame) -> Rgb {
    let mut picture = colors::background(SIDE_PX, SIDE_PX);
    for point in &surfaces.truth {
        dot(&mut picture, frame.pixel(plane, point), TRUTH);
    }
    for point in &surfaces.model {
        let color = colors::of_distance(point.distance_m, DISTANCE_MAX_M);
        dot(&mut picture, frame.pixel(plane, &point.place), color);
    }
    picture
}

/// What of both lies in the plane through the middle.
fn slice(plane: &Plane, surfaces: &ComparedSurfaces, frame: &Frame) -> Rgb {
    let mut picture = colors::background(SIDE_PX, SIDE_PX);
    let is_in = |point: &Point3<f64>| (point[plane.along] - frame.middle[plane.along]).abs() < SLICE_HALF_M;
    for point in surfaces.truth.iter().filter(|point| is_in(point)) {
        dot(&mut picture, frame.pixel(plane, point), TRUTH_LINE);
    }
    for point in surfaces.model.iter().filter(|point| is_in(&point.place)) {
        dot(&mut picture, frame.pixel(plane, &point.place), MODEL_LINE);
    }
    picture
}

fn dot(picture: &mut Rgb, (x, y): (i64, i64), color: [u8; 3]) {
    let (width, height) = picture.size();
    for (x, y) in (y..y + DOT_PX).flat_map(|y| (x..x + DOT_PX).map(move |x| (x, y))) {
        let inside = (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y);
        if inside {
            picture.pixels_mut()[y as usize * width as usize + x as usize] = color;
        }
    }
}

#[cfg(test)]
mod tests {
    use evaluation::ComparedPoint;

    use super::*;

    #[test]
    fn a_slice_shows_what_lies_in_the_middle_alone() {
        let place = |i: i32, z: f64| Point3::new(f64::from(i) * 1e-3, 0.0, z);
        let model: Vec<_> =
            (-20..20).map(|i| ComparedPoint { place: place(i, 0.0), distance_m: 0.0 }).collect();
        let truth = vec![place(0, 0.004), place(1, 0.0)];
        let surfaces = ComparedSurfaces { source: "test", model, truth, hung_on_true_camera: true };
        let picture = slice(&PLANES[0], &surfaces, &Frame::of(&surfaces));
        let count = |color| picture.pixels().iter().filter(|&&pixel| pixel == color).count();
        assert!(count(MODEL_LINE) > 100 && count(TRUTH_LINE) < 8, "{}", count(MODEL_LINE));
        assert_eq!(pictures(&surfaces).unwrap().len(), 6);
    }
}
