//! One face.

use nalgebra::Point3;

/// Three corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub a: Point3<f64>,
    pub b: Point3<f64>,
    pub c: Point3<f64>,
}

impl Triangle {
    pub(crate) fn centroid(&self) -> Point3<f64> {
        ((self.a.coords + self.b.coords + self.c.coords) / 3.0).into()
    }

    /// Distance from the centroid to the farthest corner.
    pub(crate) fn reach(&self) -> f64 {
        let centre = self.centroid();
        [self.a, self.b, self.c].iter().map(|corner| (corner - centre).norm()).fold(0.0, f64::max)
    }

    pub(crate) fn area(&self) -> f64 {
        0.5 * (self.b - self.a).cross(&(self.c - self.a)).norm()
    }

    /// The point with these barycentric coordinates.
    pub(crate) fn at(&self, [a, b, c]: [f64; 3]) -> Point3<f64> {
        (self.a.coords * a + self.b.coords * b + self.c.coords * c).into()
    }

    /// The point of the triangle nearest to `point` (Ericson, *Real-Time Collision Detection*, 5.1.5).
    pub(crate) fn closest(&self, point: &Point3<f64>) -> Point3<f64> {
        let (ab, ac) = (self.b - self.a, self.c - self.a);
        let from_a = point - self.a;
        let (d1, d2) = (ab.dot(&from_a), ac.dot(&from_a));
        if d1 <= 0.0 && d2 <= 0.0 {
            return self.a;
        }
        let from_b = point - self.b;
        let (d3, d4) = (ab.dot(&from_b), ac.dot(&from_b));
        if d3 >= 0.0 && d4 <= d3 {
            return self.b;
        }
        let from_c = point - self.c;
        let (d5, d6) = (ab.dot(&from_c), ac.dot(&from_c));
        if d6 >= 0.0 && d5 <= d6 {
            return self.c;
        }
        let over_c = d1 * d4 - d3 * d2;
        if over_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return self.a + ab * (d1 / (d1 - d3));
        }
        let over_b = d5 * d2 - d1 * d6;
        if over_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return self.a + ac * (d2 / (d2 - d6));
        }
        let over_a = d3 * d6 - d5 * d4;
        let (to_b, to_c) = (d4 - d3, d5 - d6);
        if over_a <= 0.0 && to_b >= 0.0 && to_c >= 0.0 {
            return self.b + (self.c - self.b) * (to_b / (to_b + to_c));
        }
        let total = over_a + over_b + over_c;
        self.a + ab * (over_b / total) + ac * (over_c / total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_point_is_no_farther_than_any_of_a_dense_sample() {
        let triangle = Triangle {
            a: Point3::new(0.1, -0.2, 0.3),
            b: Point3::new(1.2, 0.1, -0.1),
            c: Point3::new(0.3, 0.9, 0.2),
        };
        let steps = 60;
        for i in 0..200 {
            let i = f64::from(i);
            let point = Point3::new(1.5 * (i * 1.3).sin(), 1.5 * (i * 2.1).cos(), (i * 0.7).sin());
            let found = (triangle.closest(&point) - point).norm();
            let sampled = (0..=steps)
                .flat_map(|a| (0..=steps - a).map(move |b| (a, b)))
                .map(|(a, b)| {
                    let (a, b) = (f64::from(a) / f64::from(steps), f64::from(b) / f64::from(steps));
                    (triangle.at([a, b, 1.0 - a - b]) - point).norm()
                })
                .fold(f64::INFINITY, f64::min);
            assert!(found <= sampled + 1e-12 && found > sampled - 0.02, "{point}: {found} and {sampled}");
        }
    }

    #[test]
    fn a_face_without_area_still_has_a_closest_point() {
        let a = Point3::new(1.0, 0.0, 0.0);
        let needle = Triangle { a, b: a, c: a };
        assert_eq!(needle.closest(&Point3::origin()), a);
    }
}
