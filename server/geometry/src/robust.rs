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
