//! A triangle mesh that knows its distance to points.

mod triangle;

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::Point3;

use crate::EvaluationError;
use crate::numpy_random::NumpyRandom;
use triangle::Triangle;

/// Faces looked at first, and then, where a farther one could be nearer.
const NEAREST_FACES: [usize; 2] = [12, 48];
/// Below this distance (m) the answer is exact; beyond, the best of the nearest 48 faces.
const EXACT_BELOW_M: f64 = 3e-3;
/// Most faces looked at for an exact answer.
const FACES_MAX: usize = 3072;

/// A surface of triangles.
pub(crate) struct Mesh {
    triangles: Vec<Triangle>,
    /// Over the centroids.
    tree: ImmutableKdTree<f64, 3>,
    /// Largest distance of a corner from its face's centroid.
    reach_m: f64,
}

impl Mesh {
    /// Builds the search structure. Faces index `vertices`.
    ///
    /// # Errors
    /// [`EvaluationError::TruthMesh`] for no face, an index out of range or a corner that is not finite.
    pub(crate) fn new(vertices: &[Point3<f64>], faces: &[[u32; 3]]) -> Result<Self, EvaluationError> {
        let corner = |&index: &u32| vertices.get(index as usize).copied();
        let triangles: Vec<Triangle> = faces
            .iter()
            .map(|[a, b, c]| Some(Triangle { a: corner(a)?, b: corner(b)?, c: corner(c)? }))
            .collect::<Option<_>>()
            .ok_or_else(|| {
                EvaluationError::mesh("faces", format!("an index is beyond the {} vertices", vertices.len()))
            })?;
        let centroids: Vec<[f64; 3]> = triangles.iter().map(|face| face.centroid().into()).collect();
        if centroids.is_empty() {
            return Err(EvaluationError::mesh("faces", "no face"));
        }
        if !centroids.iter().flatten().all(|coordinate| coordinate.is_finite()) {
            return Err(EvaluationError::mesh("v0", "a vertex is not finite"));
        }
        let reach_m = triangles.iter().map(Triangle::reach).fold(0.0, f64::max);
        let tree = ImmutableKdTree::new_from_slice(&centroids)
            .map_err(|error| EvaluationError::mesh("faces", error))?;
        Ok(Self { triangles, tree, reach_m })
    }

    /// Distance from a finite point to the surface.
    pub(crate) fn distance_m(&self, point: &Point3<f64>) -> f64 {
        let mut best_m = f64::INFINITY;
        for faces in NEAREST_FACES {
            let (nearest_m, farthest_centroid_m) = self.nearest_of(point, faces);
            best_m = nearest_m;
            // A face not looked at has its centroid at least that far, so it is no nearer than that less its reach.
            if faces >= self.triangles.len() || farthest_centroid_m - self.reach_m >= best_m {
                return best_m;
            }
        }
        if best_m >= EXACT_BELOW_M {
            return best_m;
        }
        let radius_m = best_m + self.reach_m;
        let candidates = self
            .tree
            .query(&(*point).into())
            .nearest_n::<SquaredEuclidean<f64>>(NonZero::new(FACES_MAX).expect("a constant above zero"))
            .within(radius_m * radius_m)
            .execute();
        candidates.iter().map(|face| self.face_distance_m(face.item, point)).fold(best_m, f64::min)
    }

    /// Distance to the nearest of the `count` faces with the nearest centroids, and to the farthest centroid.
    fn nearest_of(&self, point: &Point3<f64>, count: usize) -> (f64, f64) {
        let faces = self
            .tree
            .query(&(*point).into())
            .nearest_n::<SquaredEuclidean<f64>>(NonZero::new(count).expect("a constant above zero"))
            .execute();
        let nearest_m =
            faces.iter().map(|face| self.face_distance_m(face.item, point)).fold(f64::INFINITY, f64::min);
        (nearest_m, faces.last().map_or(0.0, |face| face.distance.sqrt()))
    }

    fn face_distance_m(&self, face: u32, point: &Point3<f64>) -> f64 {
        (self.triangles[face as usize].closest(point) - point).norm()
    }

    /// Points spread evenly over those faces for which `wanted`; empty where they have no area.
    pub(crate) fn sample(
        &self,
        wanted: impl Fn(usize) -> bool,
        count: usize,
        random: &mut NumpyRandom,
    ) -> Vec<Point3<f64>> {
        let area = |(face, triangle): (usize, &Triangle)| if wanted(face) { triangle.area() } else { 0.0 };
        let weights: Vec<f64> = self.triangles.iter().enumerate().map(area).collect();
        let faces = random.choose_weighted(&weights, count);
        faces
            .into_iter()
            .map(|face| {
                let (u, v) = (random.uniform(), random.uniform());
                let (low, high) = (u.min(v), u.max(v));
                self.triangles[face].at([low, high - low, 1.0 - high])
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(side: u32) -> Mesh {
        let vertex = |i: u32| Point3::new(f64::from(i % side), f64::from(i / side), 0.0) * 1e-3;
        let vertices: Vec<_> = (0..side * side).map(vertex).collect();
        let faces: Vec<_> = (0..side - 1)
            .flat_map(|y| (0..side - 1).map(move |x| y * side + x))
            .flat_map(|i| [[i, i + 1, i + side], [i + 1, i + side + 1, i + side]])
            .collect();
        Mesh::new(&vertices, &faces).expect("a grid")
    }

    #[test]
    fn the_distance_to_a_plane_of_many_faces_is_the_height() {
        let plane = grid(80);
        for height_m in [0.0, 1e-4, -2e-3, 0.05] {
            let found = plane.distance_m(&Point3::new(0.0312, 0.0457, height_m));
            assert!((found - height_m.abs()).abs() < 1e-12, "{found} for {height_m}");
        }
    }

    #[test]
    fn a_point_beside_the_surface_is_measured_to_the_edge() {
        let found = grid(80).distance_m(&Point3::new(-3e-3, 0.02, 4e-3));
        assert!((found - 5e-3).abs() < 1e-12, "{found}");
    }

    #[test]
    fn a_long_face_is_found_behind_many_nearer_centroids() {
        let mut vertices =
            vec![Point3::new(-1.0, 0.0, 0.0), Point3::new(1.0, -0.5, 0.0), Point3::new(1.0, 0.5, 0.0)];
        let mut faces = vec![[0, 1, 2]];
        for i in 0..60 {
            let x = -0.7 + 1e-4 * f64::from(i);
            let first = vertices.len() as u32;
            vertices
                .extend([(0.0, 0.0), (1e-4, 0.0), (0.0, 1e-4)].map(|(dx, dy)| Point3::new(x + dx, dy, 4e-3)));
            faces.push([first, first + 1, first + 2]);
        }
        let mesh = Mesh::new(&vertices, &faces).expect("finite");
        let found = mesh.distance_m(&Point3::new(-0.7, 0.0, 1.5e-3));
        assert!((found - 1.5e-3).abs() < 1e-12, "{found}");
        let beyond = mesh.distance_m(&Point3::new(-0.7, 0.0, -2e-3));
        assert!(
            (beyond - 6e-3).abs() < 1e-12,
            "past 3 mm the best of the nearest centroids counts: {beyond}"
        );
    }

    #[test]
    fn broken_meshes_are_refused() {
        let vertices = [Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, f64::NAN, 0.0)];
        for (faces, expected) in
            [(vec![], "no face"), (vec![[0, 1, 7]], "beyond the 3"), (vec![[0, 1, 2]], "finite")]
        {
            let refusal = Mesh::new(&vertices, &faces).err().expect("broken").to_string();
            assert!(refusal.contains(expected), "{refusal}");
        }
    }
}
