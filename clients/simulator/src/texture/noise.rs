//! Value noise with an analytic gradient.
//!
//! Texture is evaluated at every pixel of every picture, so an octave must cost nanoseconds, give its
//! gradient (for bumps) and fade with the pixel's footprint (for anti-aliasing). It interpolates a periodic lattice
//! of random values by quintic weights; each octave has its own rotation, so the period does not show.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3, Vector4};
use rand::RngExt;
use rand_pcg::Pcg64;

const LATTICE_BITS: u32 = 6;
const LATTICE: usize = 1 << LATTICE_BITS;
const LATTICE_MASK: i32 = LATTICE as i32 - 1;
const NODES: usize = LATTICE.pow(3);

/// An octave is shown in full where its cell spans this many pixels, and is gone at half of that.
const RESOLVED_PX_PER_CELL: f32 = 3.0;

/// Random values in -1..1 on a periodic lattice of 64^3.
pub(crate) struct Lattice {
    values: Box<[f32; NODES]>,
}

/// Noise and its gradient, per millimetre.
#[derive(Clone, Copy)]
pub(crate) struct NoiseSample {
    pub value: f32,
    pub gradient_per_mm: Vector3<f32>,
}

impl Lattice {
    pub fn new(random: &mut Pcg64) -> Self {
        let values: Vec<f32> = (0..NODES).map(|_| random.random_range(-1.0..1.0)).collect();
        Self { values: values.try_into().expect("one value for each node") }
    }

    /// The value at a lattice node.
    pub fn node(&self, x: i32, y: i32, z: i32) -> f32 {
        // bits, not sums: the compiler sees that the index is in range
        let wrap = |i: i32| (i & LATTICE_MASK) as usize;
        self.values[wrap(z) << (2 * LATTICE_BITS) | wrap(y) << LATTICE_BITS | wrap(x)]
    }

    /// Noise and gradient at a point in cells.
    fn sample(&self, point: Vector3<f32>) -> (f32, Vector3<f32>) {
        let (x, tx) = floor_fraction(point.x);
        let (y, ty) = floor_fraction(point.y);
        let (z, tz) = floor_fraction(point.z);
        let (wx, wy, wz) = (quintic(tx), quintic(ty), quintic(tz));
        // along x first: the four edges of the cell
        let edge = |dy: i32, dz: i32| {
            let (near, far) = (self.node(x, y + dy, z + dz), self.node(x + 1, y + dy, z + dz));
            (near + (far - near) * wx, far - near)
        };
        let ((e00, s00), (e10, s10)) = (edge(0, 0), edge(1, 0));
        let ((e01, s01), (e11, s11)) = (edge(0, 1), edge(1, 1));
        let (low, high) = (e00 + (e10 - e00) * wy, e01 + (e11 - e01) * wy);
        let slope_x = mix(mix(s00, s10, wy), mix(s01, s11, wy), wz);
        let slope_y = mix(e10 - e00, e11 - e01, wz);
        let gradient = Vector3::new(
            slope_x * quintic_slope(tx),
            slope_y * quintic_slope(ty),
            (high - low) * quintic_slope(tz),
        );
        (mix(low, high, wz), gradient)
    }
}

/// One scale of noise.
pub(crate) struct Octave {
    cell_mm: f32,
    cells_from_mm: Matrix3<f32>,
    offset: Vector3<f32>,
}

impl Octave {
    /// Noise with features of about `cell_mm`.
    pub fn new(cell_mm: f32, random: &mut Pcg64) -> Self {
        Self::stretched(cell_mm, Vector3::x(), 1.0, random)
    }

    /// Noise drawn out `stretch` times along `axis`: fibres.
    pub fn stretched(cell_mm: f32, axis: Vector3<f32>, stretch: f32, random: &mut Pcg64) -> Self {
        let axis = axis.normalize();
        let squeeze = Matrix3::identity() + axis * axis.transpose() * (1.0 / stretch - 1.0);
        let rotation = random_rotation(random);
        let offset = Vector3::from_fn(|_, _| random.random_range(0.0..LATTICE as f32));
        Self { cell_mm, cells_from_mm: rotation.matrix() * squeeze / cell_mm, offset }
    }

    /// Noise at a point of the material for a pixel of that footprint: zero once the pixel cannot show it.
    pub fn at(&self, lattice: &Lattice, point_mm: Vector3<f32>, footprint_mm: f32) -> NoiseSample {
        let shown = self.shown(footprint_mm);
        if shown <= 0.0 {
            return NoiseSample { value: 0.0, gradient_per_mm: Vector3::zeros() };
        }
        let (value, gradient) = lattice.sample(self.cells_from_mm * point_mm + self.offset);
        let gradient_per_mm = self.cells_from_mm.tr_mul(&gradient) * shown;
        NoiseSample { value: value * shown, gradient_per_mm }
    }

    /// 1 where a pixel resolves the octave, 0 where it cannot.
    pub fn shown(&self, footprint_mm: f32) -> f32 {
        let px_per_cell = self.cell_mm / footprint_mm;
        (2.0 * px_per_cell / RESOLVED_PX_PER_CELL - 1.0).clamp(0.0, 1.0)
    }
}

/// A rotation drawn uniformly.
pub(crate) fn random_rotation(random: &mut Pcg64) -> Rotation3<f32> {
    let mut component = || random.random_range(-1.0_f32..1.0);
    loop {
        let q = Vector4::from_fn(|_, _| component());
        if (0.01..=1.0).contains(&q.norm_squared()) {
            return UnitQuaternion::from_quaternion(q.into()).to_rotation_matrix();
        }
    }
}

/// Cubic step from 0 at `from` to 1 at `to`.
pub(crate) fn smooth_step(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Linear interpolation.
pub(crate) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Integer part towards minus infinity, and the rest. (`f32::floor` is a library call on the base instruction set.)
pub(crate) fn floor_fraction(x: f32) -> (i32, f32) {
    let truncated = x as i32;
    let floor = if x < truncated as f32 { truncated - 1 } else { truncated };
    (floor, x - floor as f32)
}

fn quintic(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

fn quintic_slope(t: f32) -> f32 {
    30.0 * t * t * (t * (t - 2.0) + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn the_gradient_is_the_slope_of_the_noise() {
        let mut random = Pcg64::seed_from_u64(3);
        let lattice = Lattice::new(&mut random);
        let octave = Octave::stretched(1.7, Vector3::new(1.0, 0.4, -0.2), 4.0, &mut random);
        for i in 0..50 {
            let p = Vector3::new(0.37 * i as f32 - 9.0, 1.1 - 0.21 * i as f32, 0.05 * i as f32);
            let at = |p| octave.at(&lattice, p, 1e-3).value;
            let analytic = octave.at(&lattice, p, 1e-3).gradient_per_mm;
            for axis in 0..3 {
                let mut step = Vector3::zeros();
                step[axis] = 0.01;
                let numeric = (at(p + step) - at(p - step)) / 0.02;
                assert!((numeric - analytic[axis]).abs() < 0.01, "{numeric} against {}", analytic[axis]);
            }
        }
    }

    #[test]
    fn an_octave_finer_than_the_pixel_is_gone() {
        let mut random = Pcg64::seed_from_u64(4);
        let lattice = Lattice::new(&mut random);
        let octave = Octave::new(0.3, &mut random);
        assert_eq!(octave.at(&lattice, Vector3::new(1.0, 2.0, 3.0), 0.25).value, 0.0);
        assert_eq!(octave.shown(0.05), 1.0);
    }
}
