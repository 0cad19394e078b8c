//! A kidney freed from its bed of fat, renal vessels at the hilum.

use nalgebra::{Point3, Vector3};

use super::tissue::{arteries, fat, kidney, peritoneum, serosa, veins};
use super::{Kitchen, Organ, Overlay, Recipe};
use crate::shape::{Blob, Body, Relief, Sheet, Tube};

pub(super) fn recipe(kitchen: &mut Kitchen) -> Recipe {
    let organs = vec![bean(kitchen), vein(kitchen), bed(kitchen)];
    Recipe { organs, pivot_mm: 120.0 }
}

fn bean(kitchen: &mut Kitchen) -> Organ {
    let body = Body::Blob(Blob {
        centre_mm: Point3::new(0.0, -4.0, 99.0),
        world_from_body: kitchen.turned([0.0, 0.0, -24.0], 8.0),
        semi_axes_mm: Vector3::new(kitchen.about(66.0, 0.05), kitchen.about(41.0, 0.05), 40.0),
        bend_mm: 17.0,
        swellings: kitchen.lobes(12, 0.05),
        furrows: Vec::new(),
        relief: Relief::new(&[(18.0, 1.5), (7.0, 0.5), (3.0, 0.15)], &mut kitchen.random),
    });
    let overlay = Overlay { material: fat(), furrows: Vec::new(), patch_mm: 20.0, bias: -0.45 };
    let vessels = vec![veins(26, 0.6), arteries(110, 0.42)];
    Organ { body, material: kidney(), overlay: Some(overlay), vessels, breathing: 1.0, edge_mm: 0.75 }
}

fn vein(kitchen: &mut Kitchen) -> Organ {
    let through = [[-46.0, 78.0, 112.0], [-14.0, 50.0, 98.0], [4.0, 30.0, 92.0], [10.0, 8.0, 96.0]];
    let relief = Relief::new(&[(10.0, 0.6), (4.0, 0.15)], &mut kitchen.random);
    let body = Body::Tube(Tube::new(&through, 7.0, (0.04, 18.0), relief));
    let material = serosa([0x80586f, 0x5f3f58, 0xa27f8a]);
    let overlay = Overlay { material: fat(), furrows: Vec::new(), patch_mm: 12.0, bias: -0.15 };
    Organ {
        body,
        material,
        overlay: Some(overlay),
        vessels: vec![arteries(14, 0.35)],
        breathing: 0.95,
        edge_mm: 0.8,
    }
}

fn bed(kitchen: &mut Kitchen) -> Organ {
    let body = Body::Sheet(Sheet {
        depth_mm: 96.0,
        half_size_mm: 200.0,
        slope: [0.0, -0.06],
        cupping_mm: 40.0,
        relief: Relief::new(&[(34.0, 7.0), (14.0, 4.5), (6.0, 1.6)], &mut kitchen.random),
    });
    let overlay = Overlay { material: peritoneum(), furrows: Vec::new(), patch_mm: 34.0, bias: -0.25 };
    let vessels = vec![veins(40, 0.9), arteries(90, 0.6)];
    Organ { body, material: fat(), overlay: Some(overlay), vessels, breathing: 0.85, edge_mm: 1.4 }
}
