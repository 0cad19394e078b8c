//! Robust costs for least squares: what a residual counts for once it may be an outlier.
//!
//! All take the *squared*, whitened residual `r^2` and give `rho(r^2)`, normalised so that `rho = r^2` for small
//! residuals, and the weight `d rho / d r^2` for iteratively re-weighted least squares.

/// 95 % quantile of chi-square with 2 degrees of freedom: a monocular reprojection (px, px).
pub const CHI2_95_2DOF: f64 = 5.991_464_547_107_979;
/// 95 % quantile of chi-square with 3 degrees of freedom: a stereo reprojection (px, px, px).
pub const CHI2_95_3DOF: f64 = 7.814_727_903_251_178;

/// A robust cost and the weight it gives to the squared residual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobustCost {
    /// The cost in place of `r^2`.
    pub cost: f64,
    /// Its derivative with respect to `r^2`: 1 for inliers, towards 0 for outliers.
    pub weight: f64,
}

/// Huber: quadratic up to `|r| = delta`, linear beyond.
pub fn huber(squared_residual: f64, delta: f64) -> RobustCost {
    if squared_residual <= delta * delta {
        return RobustCost { cost: squared_residual, weight: 1.0 };
    }
    let residual = squared_residual.sqrt();
    RobustCost { cost: 2.0 * delta * residual - delta * delta, weight: delta / residual }
}

/// Tukey's biweight: constant, weight zero, beyond `|r| = cutoff`.
pub fn tukey(squared_residual: f64, cutoff: f64) -> RobustCost {
    let cutoff2 = cutoff * cutoff;
    let ratio = squared_residual / cutoff2;
    if ratio >= 1.0 {
        return RobustCost { cost: cutoff2 / 3.0, weight: 0.0 };
    }
    let inside = 1.0 - ratio;
    RobustCost { cost: cutoff2 / 3.0 * (1.0 - inside.powi(3)), weight: inside * inside }
}

/// Whether a squared, whitened residual lies within the 95 % quantile `threshold`; false for NaN.
pub fn is_inlier(squared_residual: f64, threshold: f64) -> bool {
    squared_residual <= threshold
}

#[cfg(test)]
mod tests {
    use super::*;

    type Kernel = fn(f64, f64) -> RobustCost;
    const KERNELS: [(&str, Kernel); 2] = [("huber", huber), ("tukey", tukey)];

    #[test]
    fn small_residuals_count_in_full() {
        for (name, kernel) in KERNELS {
            let RobustCost { cost, weight } = kernel(1e-8, 2.0);
            assert!((cost / 1e-8 - 1.0).abs() < 1e-6 && (weight - 1.0).abs() < 1e-6, "{name}");
        }
    }

    #[test]
    fn the_weight_is_the_derivative_of_the_cost() {
        let step = 1e-5;
        for (name, kernel) in KERNELS {
            for squared in [0.1, 1.0, 3.9, 4.1, 9.0, 100.0] {
                let slope =
                    (kernel(squared + step, 2.0).cost - kernel(squared - step, 2.0).cost) / (2.0 * step);
                let weight = kernel(squared, 2.0).weight;
                assert!((slope - weight).abs() < 1e-6, "{name} at {squared}: {slope} and {weight}");
            }
        }
    }

    #[test]
    fn a_residual_that_is_not_a_number_is_no_inlier() {
        assert!(is_inlier(7.8, CHI2_95_3DOF) && !is_inlier(6.0, CHI2_95_2DOF));
        assert!(!is_inlier(f64::NAN, CHI2_95_3DOF));
    }
}
