//! Lens distortion on the normalised image plane (`z = 1`), in OpenCV's models and coefficient order.
//!
//! With `r^2 = x^2 + y^2` and the radial factor `s(r^2)`,
//! `x' = x s + 2 p1 x y + p2 (r^2 + 2 x^2)` and `y' = y s + p1 (r^2 + 2 y^2) + 2 p2 x y`.

use nalgebra::{Matrix2, Point2};
use serde::{Deserialize, Serialize};

use crate::GeometryError;

/// Newton steps after which [`Distortion::undistort`] gives up; it needs 3 to 6 inside a real lens's image.
const UNDISTORT_STEPS_MAX: usize = 30;
/// Residual on the normalised plane that counts as solved: 1e-9 px at a focal length of 1000 px.
const UNDISTORT_TOLERANCE: f64 = 1e-12;

/// A lens model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distortion {
    /// An ideal lens.
    None,
    /// `s = 1 + k1 r^2 + k2 r^4 + k3 r^6`; coefficients `k1 k2 p1 p2 k3`.
    RadialTangential([f64; 5]),
    /// `s = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)`; coefficients `k1 k2 p1 p2 k3 k4 k5 k6`.
    Rational([f64; 8]),
}

impl Distortion {
    /// The coefficients in OpenCV's order; empty without distortion.
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Self::None => &[],
            Self::RadialTangential(k) => k,
            Self::Rational(k) => k,
        }
    }

    /// Where an ideal point of the normalised plane appears through the lens.
    pub fn distort(&self, ideal: &Point2<f64>) -> Point2<f64> {
        self.distort_with_jacobian(ideal).0
    }

    /// The ideal point that the lens shows at `distorted`, by Newton's method.
    ///
    /// # Errors
    /// [`GeometryError::NotUndistortable`] where the iteration does not converge, or ends where the lens model
    /// folds the image over itself: outside the field of view that the coefficients describe.
    pub fn undistort(&self, distorted: &Point2<f64>) -> Result<Point2<f64>, GeometryError> {
        let mut ideal = *distorted;
        for _ in 0..UNDISTORT_STEPS_MAX {
            let (shown, jacobian) = self.distort_with_jacobian(&ideal);
            let residual = distorted - shown;
            let determinant = jacobian.determinant();
            if residual.norm() <= UNDISTORT_TOLERANCE * (1.0 + distorted.coords.norm()) && determinant > 0.0 {
                return Ok(ideal);
            }
            let Some(inverse) = jacobian.try_inverse() else { break };
            ideal += inverse * residual;
        }
        Err(GeometryError::NotUndistortable { x: distorted.x, y: distorted.y })
    }

    fn distort_with_jacobian(&self, ideal: &Point2<f64>) -> (Point2<f64>, Matrix2<f64>) {
        let (x, y) = (ideal.x, ideal.y);
        let r2 = x * x + y * y;
        let (scale, scale_by_r2) = self.radial(r2);
        let (p1, p2) = match self.coefficients() {
            [_, _, p1, p2, ..] => (*p1, *p2),
            _ => (0.0, 0.0),
        };
        let shown = Point2::new(
            x * scale + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * scale + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let cross = 2.0 * x * y * scale_by_r2 + 2.0 * p1 * x + 2.0 * p2 * y;
        let jacobian = Matrix2::new(
            scale + 2.0 * x * x * scale_by_r2 + 2.0 * p1 * y + 6.0 * p2 * x,
            cross,
            cross,
            scale + 2.0 * y * y * scale_by_r2 + 6.0 * p1 * y + 2.0 * p2 * x,
        );
        (shown, jacobian)
    }

    /// The radial factor and its derivative with respect to `r^2`.
    fn radial(&self, r2: f64) -> (f64, f64) {
        match *self {
            Self::None => (1.0, 0.0),
            Self::RadialTangential([k1, k2, _, _, k3]) => cubic(r2, [k1, k2, k3]),
            Self::Rational([k1, k2, _, _, k3, k4, k5, k6]) => {
                let (numerator, numerator_slope) = cubic(r2, [k1, k2, k3]);
                let (denominator, denominator_slope) = cubic(r2, [k4, k5, k6]);
                let scale = numerator / denominator;
                (scale, (numerator_slope - scale * denominator_slope) / denominator)
            }
        }
    }
}

/// `1 + a t + b t^2 + c t^3` and its derivative.
fn cubic(t: f64, [a, b, c]: [f64; 3]) -> (f64, f64) {
    (1.0 + t * (a + t * (b + t * c)), a + t * (2.0 * b + 3.0 * t * c))
}
