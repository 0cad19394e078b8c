//! Loops of gut, the stomach, the liver's edge and omental fat before the abdominal wall.

use nalgebra::{Point3, Vector3};

use super::tissue::{arteries, fat, liver, peritoneum, serosa, veins};
use super::{Kitchen, Organ, Overlay, Recipe};
use crate::shape::{Blob, Body, Relief, Sheet, Tube};

/// Centre lines of the gut, nearest first.
const LOOPS: [(&[[f64; 3]], f64); 4] = [
    (
        &[
            [-78.0, 34.0, 98.0],
            [-44.0, 12.0, 84.0],
            [-8.0, 14.0, 77.0],
            [26.0, 26.0, 80.0],
            [52.0, 58.0, 96.0],
        ],
        15.0,
    ),
    (
        &[
            [-96.0, 2.0, 108.0],
            [-58.0, -18.0, 95.0],
            [-20.0, -18.0, 88.0],
            [18.0, -9.0, 85.0],
            [62.0, 6.0, 92.0],
        ],
        14.0,
    ),
    (
        &[
            [104.0, 22.0, 110.0],
            [70.0, 34.0, 94.0],
            [42.0, 18.0, 90.0],
            [38.0, -14.0, 92.0],
            [72.0, -30.0, 104.0],
        ],
        14.0,
    ),
    (
        &[
            [-90.0, 74.0, 106.0],
            [-50.0, 50.0, 92.0],
            [-14.0, 50.0, 88.0],
            [22.0, 66.0, 94.0],
            [60.0, 92.0, 112.0],
        ],
        16.0,
    ),
];

pub(super) fn recipe(kitchen: &mut Kitchen) -> Recipe {
    let mut organs: Vec<Organ> =
        LOOPS.iter().map(|(through, radius)| gut(kitchen, through, *radius)).collect();
    organs.extend([stomach(kitchen), liver_edge(kitchen), wall(kitchen)]);
    Recipe { organs, pivot_mm: 135.0 }
}

fn gut(kitchen: &mut Kitchen, through: &[[f64; 3]], radius_mm: f64) -> Organ {
    let relief = Relief::new(&[(18.0, 1.6), (7.0, 0.6), (3.0, 0.2)], &mut kitchen.random);
    let radius_mm = kitchen.about(radius_mm, 0.06);
    let pouch_mm = kitchen.about(24.0, 0.2);
    Organ {
        body: Body::Tube(Tube::new(through, radius_mm, (0.05, pouch_mm), relief)),
        material: serosa([0xc07a70, 0x9d5350, 0xd9a593]),
        overlay: Some(Overlay { material: fat(), furrows: Vec::new(), patch_mm: 15.0, bias: -0.42 }),
        vessels: vec![veins(10, 0.5), arteries(44, 0.5)],
        breathing: 0.8,
        edge_mm: 0.85,
    }
}

fn stomach(kitchen: &mut Kitchen) -> Organ {
    let body = Body::Blob(Blob {
        centre_mm: Point3::new(52.0, -58.0, 122.0),
        world_from_body: kitchen.turned([0.0, 0.0, 20.0], 6.0),
        semi_axes_mm: Vector3::new(66.0, 36.0, 38.0),
        bend_mm: 14.0,
        swellings: kitchen.lobes(8, 0.06),
        furrows: Vec::new(),
        relief: Relief::new(&[(20.0, 1.8), (8.0, 0.6), (3.0, 0.15)], &mut kitchen.random),
    });
    Organ {
        body,
        material: serosa([0xcf9080, 0xb06a62, 0xe0b8a4]),
        overlay: None,
        vessels: vec![veins(9, 0.8), arteries(40, 0.6)],
        breathing: 0.95,
        edge_mm: 1.0,
    }
}

fn liver_edge(kitchen: &mut Kitchen) -> Organ {
    let body = Body::Blob(Blob {
        centre_mm: Point3::new(-62.0, -74.0, 114.0),
        world_from_body: kitchen.turned([10.0, 0.0, -14.0], 5.0),
        semi_axes_mm: Vector3::new(84.0, 44.0, 42.0),
        bend_mm: -6.0,
        swellings: kitchen.lobes(8, 0.05),
        furrows: Vec::new(),
        relief: Relief::new(&[(24.0, 1.8), (9.0, 0.6), (4.0, 0.15)], &mut kitchen.random),
    });
    let vessels = vec![veins(10, 0.8), arteries(40, 0.45)];
    Organ { body, material: liver(), overlay: None, vessels, breathing: 1.0, edge_mm: 1.0 }
}

fn wall(kitchen: &mut Kitchen) -> Organ {
    let body = Body::Sheet(Sheet {
        depth_mm: 116.0,
        half_size_mm: 230.0,
        slope: [0.0, -0.10],
        cupping_mm: 30.0,
        relief: Relief::new(&[(38.0, 8.0), (15.0, 4.5), (6.0, 1.5)], &mut kitchen.random),
    });
    let overlay = Overlay { material: fat(), furrows: Vec::new(), patch_mm: 36.0, bias: 0.15 };
    let vessels = vec![veins(36, 1.0), arteries(80, 0.6)];
    Organ { body, material: peritoneum(), overlay: Some(overlay), vessels, breathing: 0.6, edge_mm: 1.5 }
}
