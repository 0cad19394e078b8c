//! A heart with fat and coronary vessels in its grooves, in the opened pericardium.

use nalgebra::{Point3, Vector3};
use rand::RngExt;

use super::tissue::{arteries, fat, muscle, peritoneum, veins};
use super::{Kitchen, Organ, Overlay, Recipe};
use crate::shape::{Blob, Body, Furrow, Relief, Sheet, Swelling};

pub(super) fn recipe(kitchen: &mut Kitchen) -> Recipe {
    Recipe { organs: vec![ventricles(kitchen), pericardium(kitchen)], pivot_mm: 125.0 }
}

/// Between the ventricles, and between them and the atria.
pub(super) fn grooves() -> [Furrow; 2] {
    [
        Furrow { normal: Vector3::new(0.35, 1.0, 0.15), offset_mm: 6.0, depth_mm: 2.0, width_mm: 6.0 },
        Furrow { normal: Vector3::new(1.0, -0.25, 0.1), offset_mm: -34.0, depth_mm: 3.0, width_mm: 8.0 },
    ]
}

/// The shape shared with the phantom.
pub(super) fn heart_shape(kitchen: &mut Kitchen) -> Blob {
    let mut swellings = kitchen.lobes(10, 0.05);
    let apex = Swelling { direction: Vector3::new(1.0, 0.25, -0.1), height: 0.12, width_rad: 0.5 };
    let atrium = Swelling { direction: Vector3::new(-1.0, -0.4, -0.4), height: 0.16, width_rad: 0.45 };
    swellings.extend([apex, atrium]);
    Blob {
        centre_mm: Point3::new(2.0, 2.0, 116.0),
        world_from_body: kitchen.turned([0.0, 6.0, 32.0], 7.0),
        semi_axes_mm: Vector3::new(kitchen.about(72.0, 0.05), kitchen.about(56.0, 0.05), 57.0),
        bend_mm: 4.0,
        swellings,
        furrows: grooves().to_vec(),
        relief: Relief::new(&[(22.0, 1.8), (8.0, 0.6), (3.5, 0.18)], &mut kitchen.random),
    }
}

/// Points along the grooves that the coronary vessels start from.
pub(super) fn groove_roots(shape: &Blob, kitchen: &mut Kitchen) -> Vec<Point3<f64>> {
    let half = shape.semi_axes_mm;
    let mut roots = Vec::new();
    for _ in 0..20_000 {
        let in_body = Vector3::from_fn(|axis, _| kitchen.random.random_range(-1.0..1.0) * half[axis]);
        let in_groove = shape.furrows.iter().any(|furrow| furrow.closeness(&in_body) > 0.6);
        let world = shape.centre_mm + shape.world_from_body * in_body;
        if in_groove && world.z < shape.centre_mm.z - 0.3 * half.z {
            roots.push(world);
        }
    }
    roots
}

fn ventricles(kitchen: &mut Kitchen) -> Organ {
    let shape = heart_shape(kitchen);
    let roots_mm = groove_roots(&shape, kitchen);
    let mut coronary = arteries(26, 1.25);
    coronary.taper = 0.009;
    coronary.roots_mm.clone_from(&roots_mm);
    let mut cardiac_vein = veins(12, 1.5);
    cardiac_vein.roots_mm = roots_mm;
    let fat_bands = shape.furrows.iter().map(|f| Furrow { width_mm: 1.15 * f.width_mm, ..*f }).collect();
    Organ {
        body: Body::Blob(shape),
        material: muscle(Vector3::new(0.6, 0.75, 0.2)),
        overlay: Some(Overlay { material: fat(), furrows: fat_bands, patch_mm: 16.0, bias: -0.42 }),
        vessels: vec![cardiac_vein, coronary, arteries(110, 0.42)],
        breathing: 1.0,
        edge_mm: 0.85,
    }
}

fn pericardium(kitchen: &mut Kitchen) -> Organ {
    let body = Body::Sheet(Sheet {
        depth_mm: 132.0,
        half_size_mm: 230.0,
        slope: [0.05, -0.05],
        cupping_mm: 40.0,
        relief: Relief::new(&[(40.0, 6.0), (15.0, 3.0), (6.0, 1.0)], &mut kitchen.random),
    });
    let overlay = Overlay { material: fat(), furrows: Vec::new(), patch_mm: 26.0, bias: 0.0 };
    let vessels = vec![veins(25, 1.0), arteries(70, 0.6)];
    Organ { body, material: peritoneum(), overlay: Some(overlay), vessels, breathing: 0.6, edge_mm: 1.6 }
}
