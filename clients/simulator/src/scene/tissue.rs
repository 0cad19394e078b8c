//! Tissues and vessels that the recipes share. Colours are those of white-balanced endoscope pictures.

use nalgebra::Vector3;

use crate::texture::{Fibres, Lobules, Material, VesselSpecies, VesselTone, from_srgb};

/// Liver capsule over fine lobules.
pub(super) fn liver() -> Material {
    Material {
        palette: [from_srgb(0x8d493c), from_srgb(0x733931), from_srgb(0xa4654f)],
        mottling: [0.05, 0.08, 0.14, 0.18, 0.20, 0.20],
        bump_mm: [0.25, 0.25, 0.16, 0.06, 0.020, 0.006],
        lobules: Some(Lobules { size_mm: 1.5, contrast: 0.11, border: 0.14, height: 0.018 }),
        fibres: None,
        capillaries: 0.14,
        vessel_colours: [from_srgb(0x8e1c22), from_srgb(0x5c2a3c)],
        wetness: 1.0,
        softness: 0.55,
    }
}

/// Heart muscle under a thin epicardium.
pub(super) fn muscle(fibre_axis: Vector3<f32>) -> Material {
    Material {
        palette: [from_srgb(0x9d453f), from_srgb(0x792f2f), from_srgb(0xbb7264)],
        mottling: [0.06, 0.10, 0.14, 0.16, 0.18, 0.18],
        bump_mm: [0.3, 0.28, 0.15, 0.05, 0.016, 0.005],
        lobules: None,
        fibres: Some(Fibres {
            axis: fibre_axis,
            width_mm: 0.9,
            stretch: 7.0,
            contrast: 0.22,
            height_mm: 0.05,
        }),
        capillaries: 0.22,
        vessel_colours: [from_srgb(0x9c1b22), from_srgb(0x5e2b45)],
        wetness: 1.1,
        softness: 0.5,
    }
}

/// Lobulated yellow fat.
pub(super) fn fat() -> Material {
    Material {
        palette: [from_srgb(0xd3ab67), from_srgb(0xbb8555), from_srgb(0xe2c68c)],
        mottling: [0.05, 0.07, 0.10, 0.12, 0.13, 0.12],
        bump_mm: [0.3, 0.25, 0.14, 0.05, 0.014, 0.005],
        lobules: Some(Lobules { size_mm: 3.6, contrast: 0.12, border: 0.24, height: 0.10 }),
        fibres: None,
        capillaries: 0.16,
        vessel_colours: [from_srgb(0xa02a24), from_srgb(0x6d3648)],
        wetness: 0.9,
        softness: 0.7,
    }
}

/// Smooth dark red kidney under its capsule.
pub(super) fn kidney() -> Material {
    Material {
        palette: [from_srgb(0x9a4a42), from_srgb(0x712f2f), from_srgb(0xb77462)],
        mottling: [0.06, 0.10, 0.15, 0.18, 0.19, 0.18],
        bump_mm: [0.25, 0.25, 0.15, 0.055, 0.018, 0.005],
        lobules: Some(Lobules { size_mm: 0.9, contrast: 0.10, border: 0.10, height: 0.012 }),
        fibres: None,
        capillaries: 0.20,
        vessel_colours: [from_srgb(0x861a24), from_srgb(0x542138)],
        wetness: 1.0,
        softness: 0.55,
    }
}

/// Pink serosa of stomach and gut.
pub(super) fn serosa(palette: [u32; 3]) -> Material {
    Material {
        palette: palette.map(from_srgb),
        mottling: [0.05, 0.08, 0.12, 0.14, 0.15, 0.15],
        bump_mm: [0.3, 0.28, 0.12, 0.05, 0.015, 0.005],
        lobules: None,
        fibres: Some(Fibres {
            axis: Vector3::new(0.8, 0.5, 0.1),
            width_mm: 0.8,
            stretch: 6.0,
            contrast: 0.13,
            height_mm: 0.03,
        }),
        capillaries: 0.28,
        vessel_colours: [from_srgb(0xa3222b), from_srgb(0x66324d)],
        wetness: 1.1,
        softness: 0.65,
    }
}

/// The glistening lining of the cavity.
pub(super) fn peritoneum() -> Material {
    Material {
        palette: [from_srgb(0xb98d76), from_srgb(0x99604f), from_srgb(0xd3b696)],
        fibres: Some(Fibres {
            axis: Vector3::new(0.4, 1.0, 0.2),
            width_mm: 1.2,
            stretch: 9.0,
            contrast: 0.14,
            height_mm: 0.06,
        }),
        ..serosa([0xb98d76, 0x99604f, 0xd3b696])
    }
}

/// Gall bladder: green through a thin pale wall.
pub(super) fn gall_bladder() -> Material {
    serosa([0x7d8d68, 0x566b55, 0xa3a583])
}

/// Cast silicone with pigment speckles.
pub(super) fn silicone() -> Material {
    Material {
        palette: [from_srgb(0xc48674), from_srgb(0xab6557), from_srgb(0xd9a793)],
        mottling: [0.05, 0.08, 0.16, 0.30, 0.34, 0.28],
        bump_mm: [0.2, 0.15, 0.06, 0.025, 0.012, 0.006],
        lobules: None,
        fibres: None,
        capillaries: 0.0,
        vessel_colours: [from_srgb(0xb03a36), from_srgb(0x5b4a78)],
        wetness: 0.7,
        softness: 0.8,
    }
}

/// Woven drape under the phantom.
pub(super) fn drape() -> Material {
    Material {
        palette: [from_srgb(0x4d7486), from_srgb(0x3a5c6e), from_srgb(0x6a909c)],
        mottling: [0.04, 0.06, 0.10, 0.14, 0.2, 0.2],
        bump_mm: [0.4, 0.3, 0.1, 0.05, 0.03, 0.015],
        lobules: None,
        fibres: Some(Fibres {
            axis: Vector3::x(),
            width_mm: 0.6,
            stretch: 12.0,
            contrast: 0.25,
            height_mm: 0.05,
        }),
        capillaries: 0.0,
        vessel_colours: [from_srgb(0x4d7486), from_srgb(0x4d7486)],
        wetness: 0.1,
        softness: 0.2,
    }
}

/// Bright red, winding, on the surface.
pub(super) fn arteries(trees: usize, radius_mm: f64) -> VesselSpecies {
    VesselSpecies {
        trees,
        roots_mm: Vec::new(),
        radius_mm,
        radius_min_mm: 0.07,
        taper: 0.006,
        wander: 0.15,
        branching_mm: 8.0,
        tone: VesselTone { colour: 0, opacity: 0.82, blur: 0.35, relief: 0.25 },
    }
}

/// Wider, straighter, deeper and bluish.
pub(super) fn veins(trees: usize, radius_mm: f64) -> VesselSpecies {
    VesselSpecies {
        trees,
        roots_mm: Vec::new(),
        radius_mm,
        radius_min_mm: 0.16,
        taper: 0.008,
        wander: 0.08,
        branching_mm: 12.0,
        tone: VesselTone { colour: 1, opacity: 0.62, blur: 0.6, relief: 0.15 },
    }
}
