//! What tissue looks like: layered noise, lobules, fibres, capillaries, vessels and fat.

use nalgebra::{Matrix3, Point3, Vector3};
use rand_pcg::Pcg64;

use super::Colour;
use super::cells::lobule;
use super::noise::{Lattice, NoiseSample, Octave, mix, random_rotation, smooth_step};
use super::vessels::VesselMap;

/// Feature sizes of the shared octaves, coarse to fine.
const OCTAVE_MM: [f32; 6] = [17.0, 6.5, 2.7, 1.15, 0.55, 0.3];

/// What the light meets at a point.
#[derive(Clone, Copy)]
pub(crate) struct SurfacePoint {
    /// Diffuse reflectance.
    pub albedo: Colour,
    /// Gradient of the height over the mesh, dimensionless.
    pub height_gradient: Vector3<f32>,
    /// Strength of the mirrored light.
    pub wetness: f32,
    /// How much of the light comes back out after scattering inside, 0 to 1.
    pub softness: f32,
}

/// Polygonal domains, as of fat or liver.
#[derive(Clone, Copy)]
pub(crate) struct Lobules {
    pub size_mm: f32,
    /// Relative change of brightness from lobule to lobule.
    pub contrast: f32,
    /// Relative darkening of the borders.
    pub border: f32,
    /// Height of a lobule's middle over its border, as a share of its size.
    pub height: f32,
}

/// Streaks along a direction, as of muscle.
#[derive(Clone, Copy)]
pub(crate) struct Fibres {
    pub axis: Vector3<f32>,
    pub width_mm: f32,
    pub stretch: f32,
    /// Relative change of brightness.
    pub contrast: f32,
    pub height_mm: f32,
}

/// Parameters of one tissue.
#[derive(Clone)]
pub(crate) struct Material {
    /// Main colour, dark variant, pale variant.
    pub palette: [Colour; 3],
    /// Relative change of brightness by octave (17, 6.5, 2.7, 1.15, 0.55, 0.3 mm).
    pub mottling: [f32; 6],
    /// Height of the bumps by octave, millimetres.
    pub bump_mm: [f32; 6],
    pub lobules: Option<Lobules>,
    pub fibres: Option<Fibres>,
    /// Strength of the fine red network between the vessels, 0 to 1.
    pub capillaries: f32,
    /// Colours of the vessels' tones.
    pub vessel_colours: [Colour; 2],
    pub wetness: f32,
    pub softness: f32,
}

/// A material with its own noise.
struct Tissue {
    material: Material,
    octaves: [Octave; 6],
    fibre_octave: Option<Octave>,
    capillary_octaves: [Octave; 2],
    lobules_from_mm: Matrix3<f32>,
}

/// The whole texture of a body: tissue, in places another tissue over it, and vessels over both.
pub(crate) struct Texture {
    tissue: Tissue,
    overlay: Option<Tissue>,
    ragged_edge: [Octave; 2],
    vessels: VesselMap,
}

impl Texture {
    pub fn new(tissue: Material, overlay: Option<Material>, vessels: VesselMap, random: &mut Pcg64) -> Self {
        Self {
            tissue: Tissue::new(tissue, random),
            overlay: overlay.map(|material| Tissue::new(material, random)),
            ragged_edge: [Octave::new(5.0, random), Octave::new(1.6, random)],
            vessels,
        }
    }

    /// The texture at a point of the undeformed body, for a pixel covering `footprint_mm` of it.
    ///
    /// `overlay` (0 to 1) says how likely the overlying tissue is there: it shows above one half.
    pub fn at(
        &self,
        lattice: &Lattice,
        point_mm: &Point3<f64>,
        overlay: f32,
        footprint_mm: f32,
    ) -> SurfacePoint {
        let point = point_mm.coords.cast::<f32>();
        let mut surface = match &self.overlay {
            Some(tissue) if overlay > 0.15 => {
                let [coarse, fine] =
                    self.ragged_edge.each_ref().map(|octave| octave.at(lattice, point, footprint_mm).value);
                let cover = smooth_step(0.42, 0.58, overlay + 0.22 * coarse + 0.12 * fine);
                match cover {
                    0.0 => self.tissue.at(lattice, point, footprint_mm),
                    1.0 => tissue.at(lattice, point, footprint_mm),
                    _ => self
                        .tissue
                        .at(lattice, point, footprint_mm)
                        .blend(&tissue.at(lattice, point, footprint_mm), cover),
                }
            }
            _ => self.tissue.at(lattice, point, footprint_mm),
        };
        self.add_vessels(&mut surface, &point, footprint_mm);
        surface
    }

    fn add_vessels(&self, surface: &mut SurfacePoint, point: &Vector3<f32>, footprint_mm: f32) {
        if let Some(vessel) = self.vessels.at(point, footprint_mm) {
            let colour = self.tissue.material.vessel_colours[usize::from(vessel.colour)];
            surface.albedo = surface.albedo.lerp(&colour, vessel.coverage);
            surface.height_gradient += vessel.gradient;
            surface.softness = mix(surface.softness, 0.5, vessel.coverage);
        }
    }
}

impl SurfacePoint {
    fn blend(&self, other: &Self, share: f32) -> Self {
        Self {
            albedo: self.albedo.lerp(&other.albedo, share),
            height_gradient: self.height_gradient.lerp(&other.height_gradient, share),
            wetness: mix(self.wetness, other.wetness, share),
            softness: mix(self.softness, other.softness, share),
        }
    }
}

impl Tissue {
    fn new(material: Material, random: &mut Pcg64) -> Self {
        let octaves = OCTAVE_MM.map(|cell_mm| Octave::new(cell_mm, random));
        let fibre_octave = material.fibres.map(|f| Octave::stretched(f.width_mm, f.axis, f.stretch, random));
        let capillary_octaves = [Octave::new(2.6, random), Octave::new(1.3, random)];
        let size_mm = material.lobules.map_or(1.0, |l| l.size_mm);
        let lobules_from_mm = random_rotation(random).matrix() / size_mm;
        Self { material, octaves, fibre_octave, capillary_octaves, lobules_from_mm }
    }

    fn at(&self, lattice: &Lattice, point: Vector3<f32>, footprint_mm: f32) -> SurfacePoint {
        let samples = self.octaves.each_ref().map(|octave| octave.at(lattice, point, footprint_mm));
        let mut surface = self.ground(&samples);
        self.add_fibres(&mut surface, lattice, point, footprint_mm);
        self.add_lobules(&mut surface, lattice, point, footprint_mm);
        self.add_capillaries(&mut surface, lattice, point, footprint_mm);
        surface
    }

    fn ground(&self, samples: &[NoiseSample; 6]) -> SurfacePoint {
        let material = &self.material;
        let tone = samples[0].value + 0.7 * samples[1].value;
        let dark = smooth_step(0.05, 0.75, -tone + 0.25 * samples[2].value);
        let pale = smooth_step(0.10, 0.80, tone + 0.25 * samples[2].value);
        let [main, darker, paler] = material.palette;
        let mut albedo = main.lerp(&darker, dark).lerp(&paler, pale);
        let mut brightness = 1.0;
        let mut height_gradient = Vector3::zeros();
        for (octave, sample) in samples.iter().enumerate() {
            brightness += material.mottling[octave] * sample.value;
            height_gradient += sample.gradient_per_mm * material.bump_mm[octave];
        }
        // blood varies: red light is absorbed least, so dark spots are redder, not just darker
        let brightness = brightness.max(0.25);
        albedo.component_mul_assign(&Colour::new(brightness.sqrt(), brightness, brightness));
        SurfacePoint { albedo, height_gradient, wetness: material.wetness, softness: material.softness }
    }

    fn add_fibres(
        &self,
        surface: &mut SurfacePoint,
        lattice: &Lattice,
        point: Vector3<f32>,
        footprint_mm: f32,
    ) {
        if let (Some(fibres), Some(octave)) = (self.material.fibres, &self.fibre_octave) {
            let sample = octave.at(lattice, point, footprint_mm);
            surface.albedo *= 1.0 + fibres.contrast * sample.value;
            surface.height_gradient += sample.gradient_per_mm * fibres.height_mm;
        }
    }

    fn add_lobules(
        &self,
        surface: &mut SurfacePoint,
        lattice: &Lattice,
        point: Vector3<f32>,
        footprint_mm: f32,
    ) {
        let Some(lobules) = self.material.lobules else { return };
        let shown = (lobules.size_mm / footprint_mm / 4.0 - 0.5).clamp(0.0, 1.0);
        if shown <= 0.0 {
            return;
        }
        let here = lobule(lattice, self.lobules_from_mm * point);
        let soft_border = (0.09_f32).max(footprint_mm / lobules.size_mm);
        let at_border = 1.0 - smooth_step(0.0, 1.6 * soft_border, here.border);
        let change = lobules.contrast * here.value - lobules.border * at_border;
        surface.albedo *= 1.0 + shown * change;
        let slope =
            self.lobules_from_mm.tr_mul(&here.from_middle) * (-2.0 * lobules.height * lobules.size_mm);
        surface.height_gradient += slope * (shown * smooth_step(0.0, soft_border, here.border));
    }

    /// Thin winding lines: where noise crosses zero.
    fn add_capillaries(
        &self,
        surface: &mut SurfacePoint,
        lattice: &Lattice,
        point: Vector3<f32>,
        footprint_mm: f32,
    ) {
        if self.material.capillaries <= 0.0 {
            return;
        }
        for octave in &self.capillary_octaves {
            let sample = octave.at(lattice, point, footprint_mm);
            let slope = sample.gradient_per_mm.norm().max(0.15);
            let distance_mm = sample.value.abs() / slope;
            let half_width_mm = 0.07_f32.max(0.6 * footprint_mm);
            let line = 1.0 - smooth_step(0.0, 2.0 * half_width_mm, distance_mm);
            let shown = octave.shown(footprint_mm) * (0.07 / half_width_mm);
            let coverage = self.material.capillaries * line * shown;
            surface.albedo = surface.albedo.lerp(&self.material.vessel_colours[0], coverage);
        }
    }
}
