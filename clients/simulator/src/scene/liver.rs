//! A large dome with a fissure; gall bladder and omentum below its edge.

use nalgebra::{Point3, Vector3};

use super::tissue::{arteries, fat, gall_bladder, liver, peritoneum, veins};
use super::{Kitchen, Organ, Overlay, Recipe};
use crate::shape::{Blob, Body, Furrow, Relief, Sheet};

pub(super) fn recipe(kitchen: &mut Kitchen) -> Recipe {
    Recipe { organs: vec![dome(kitchen), bladder(kitchen), bed(kitchen)], pivot_mm: 150.0 }
}

fn dome(kitchen: &mut Kitchen) -> Organ {
    let fissure =
        Furrow { normal: Vector3::new(1.0, 0.35, 0.0), offset_mm: 24.0, depth_mm: 4.5, width_mm: 5.0 };
    let ligament = Furrow { depth_mm: 0.0, width_mm: 4.0, ..fissure };
    let body = Body::Blob(Blob {
        centre_mm: Point3::new(6.0, -14.0, 121.0),
        world_from_body: kitchen.turned([-8.0, 5.0, 12.0], 5.0),
        semi_axes_mm: Vector3::new(kitchen.about(98.0, 0.05), kitchen.about(64.0, 0.05), 62.0),
        bend_mm: 8.0,
        swellings: kitchen.lobes(14, 0.055),
        furrows: vec![fissure],
        relief: Relief::new(&[(26.0, 2.2), (9.0, 0.7), (4.0, 0.2)], &mut kitchen.random),
    });
    Organ {
        body,
        material: liver(),
        overlay: Some(Overlay {
            material: peritoneum(),
            furrows: vec![ligament],
            patch_mm: 14.0,
            bias: -0.72,
        }),
        vessels: vec![veins(26, 0.9), arteries(90, 0.5)],
        breathing: 1.0,
        edge_mm: 0.95,
    }
}

fn bladder(kitchen: &mut Kitchen) -> Organ {
    let body = Body::Blob(Blob {
        centre_mm: Point3::new(-22.0, 52.0, 102.0),
        world_from_body: kitchen.turned([0.0, 10.0, 65.0], 6.0),
        semi_axes_mm: Vector3::new(34.0, 16.0, 17.0),
        bend_mm: 5.0,
        swellings: kitchen.lobes(6, 0.07),
        furrows: Vec::new(),
        relief: Relief::new(&[(12.0, 0.7), (4.0, 0.15)], &mut kitchen.random),
    });
    let vessels = vec![arteries(26, 0.4), veins(5, 0.5)];
    Organ { body, material: gall_bladder(), overlay: None, vessels, breathing: 0.95, edge_mm: 0.95 }
}

fn bed(kitchen: &mut Kitchen) -> Organ {
    let body = Body::Sheet(Sheet {
        depth_mm: 128.0,
        half_size_mm: 230.0,
        slope: [0.03, -0.12],
        cupping_mm: 30.0,
        relief: Relief::new(&[(45.0, 7.0), (17.0, 4.0), (7.0, 1.2)], &mut kitchen.random),
    });
    let overlay = Overlay { material: fat(), furrows: Vec::new(), patch_mm: 30.0, bias: 0.05 };
    let vessels = vec![veins(30, 1.1), arteries(70, 0.6)];
    Organ { body, material: peritoneum(), overlay: Some(overlay), vessels, breathing: 0.7, edge_mm: 1.6 }
}
