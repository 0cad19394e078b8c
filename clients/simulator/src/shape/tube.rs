//! Gut: a tube of varying radius along a smooth centre line.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::{Patch, Relief, least_aligned_axis};
use crate::texture::Lattice;

/// A rounded tube with rings of pouches.
pub(crate) struct Tube {
    line: Vec<Station>,
    radius_mm: f64,
    pouch_height: f64,
    pouch_length_mm: f64,
    relief: Relief,
}

/// A place on the centre line with its cross-section's axes.
struct Station {
    centre_mm: Point3<f64>,
    along: Vector3<f64>,
    across: Vector3<f64>,
    arc_mm: f64,
}

impl Tube {
    /// A tube through the given points (a Catmull-Rom spline).
    ///
    /// `pouch_height` is the share of the radius by which rings every `pouch_length_mm` swell.
    pub fn new(through_mm: &[[f64; 3]], radius_mm: f64, pouches: (f64, f64), relief: Relief) -> Self {
        let through: Vec<_> = through_mm.iter().map(|&p| Point3::from(p)).collect();
        let line = centre_line(&through);
        Self { line, radius_mm, pouch_height: pouches.0, pouch_length_mm: pouches.1, relief }
    }

    fn length_mm(&self) -> f64 {
        self.line.last().map_or(0.0, |station| station.arc_mm)
    }

    /// The surface on the ray from a station in a direction across the line.
    fn surface(&self, lattice: &Lattice, station: &Station, outward: &Vector3<f64>) -> Point3<f64> {
        let ring = (TAU * station.arc_mm / self.pouch_length_mm).sin();
        let to_end_mm = station.arc_mm.min(self.length_mm() - station.arc_mm);
        let from_cap = 1.0 - (to_end_mm / self.radius_mm).clamp(0.0, 1.0);
        let cap = (1.0 - from_cap * from_cap).max(0.0).sqrt();
        let smooth = station.centre_mm + outward * (self.radius_mm * cap * (1.0 + self.pouch_height * ring));
        smooth + outward * (self.relief.height_mm(lattice, &smooth) * cap)
    }

    fn nearest(&self, point_mm: &Point3<f64>) -> &Station {
        let distance = |s: &&Station| (s.centre_mm - point_mm).norm_squared();
        self.line
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .expect("a centre line has at least two stations")
    }

    pub(super) fn project(&self, lattice: &Lattice, point_mm: &Point3<f64>) -> Point3<f64> {
        let station = self.nearest(point_mm);
        self.surface(lattice, station, &station.across_towards(point_mm))
    }

    pub(super) fn outward(&self, point_mm: &Point3<f64>) -> Vector3<f64> {
        self.nearest(point_mm).across_towards(point_mm)
    }

    pub(super) fn patch(&self, lattice: &Lattice, edge_mm: f64) -> Patch {
        let around = (TAU * self.radius_mm / edge_mm).ceil() as usize;
        let stride = (edge_mm / STATION_MM).round().max(1.0) as usize;
        let stations: Vec<&Station> = self.line.iter().step_by(stride).collect();
        let mut patch = Patch::default();
        for station in &stations {
            let third = station.along.cross(&station.across);
            for k in 0..around {
                let (sin, cos) = (TAU * k as f64 / around as f64).sin_cos();
                let outward = station.across * cos + third * sin;
                patch.vertices_mm.push(self.surface(lattice, station, &outward));
            }
        }
        patch.add_grid(stations.len() - 1, around, |i, j| (i * around + j % around) as u32);
        // columns run along the line and rows around it: that pair looks inward
        patch.faces.iter_mut().for_each(|face| face.swap(1, 2));
        patch
    }
}

impl Station {
    fn across_towards(&self, point_mm: &Point3<f64>) -> Vector3<f64> {
        let offset = point_mm - self.centre_mm;
        let across = offset - self.along * self.along.dot(&offset);
        across.try_normalize(1e-9).unwrap_or(self.across)
    }
}

/// Distance of neighbouring stations.
const STATION_MM: f64 = 0.45;

/// Stations along the spline, their cross-section axes carried along without twist.
fn centre_line(through: &[Point3<f64>]) -> Vec<Station> {
    let mut points = Vec::new();
    for i in 0..through.len() - 1 {
        let [before, after] = [through[i.saturating_sub(1)], through[(i + 2).min(through.len() - 1)]];
        let steps = ((through[i + 1] - through[i]).norm() / STATION_MM).ceil().max(1.0) as usize;
        let share = |k| k as f64 / steps as f64;
        points.extend((0..steps).map(|k| spline([before, through[i], through[i + 1], after], share(k))));
    }
    points.extend(through.last());
    let mut line: Vec<Station> = Vec::with_capacity(points.len());
    for (i, &centre_mm) in points.iter().enumerate() {
        let [from, to] = [points[i.saturating_sub(1)], points[(i + 1).min(points.len() - 1)]];
        let along = (to - from).normalize();
        let carried = line.last().map_or_else(|| least_aligned_axis(&along), |s| s.across);
        let across = (carried - along * along.dot(&carried)).normalize();
        let arc_mm = line.last().map_or(0.0, |s| s.arc_mm + (centre_mm - s.centre_mm).norm());
        line.push(Station { centre_mm, along, across, arc_mm });
    }
    line
}

/// Catmull-Rom between the two middle points.
fn spline([a, b, c, d]: [Point3<f64>; 4], t: f64) -> Point3<f64> {
    let (a, b, c, d) = (a.coords, b.coords, c.coords, d.coords);
    let cubic = (b * 3.0 - a - c * 3.0 + d) * t + (a * 2.0 - b * 5.0 + c * 4.0 - d);
    Point3::from((cubic * t + (c - a)) * (0.5 * t) + b)
}
