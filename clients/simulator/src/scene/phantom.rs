//! A silicone heart on a drape.

use super::heart::{groove_roots, heart_shape};
use super::tissue::{arteries, drape, silicone, veins};
use super::{Kitchen, Organ, Recipe};
use crate::shape::{Body, Relief, Sheet};

pub(super) fn recipe(kitchen: &mut Kitchen) -> Recipe {
    let mut shape = heart_shape(kitchen);
    shape.relief = Relief::new(&[(22.0, 1.2), (8.0, 0.3)], &mut kitchen.random);
    let roots_mm = groove_roots(&shape, kitchen);
    let mut painted = arteries(22, 1.1);
    painted.tone.relief = 0.1;
    painted.roots_mm.clone_from(&roots_mm);
    let mut painted_vein = veins(12, 1.2);
    painted_vein.tone.blur = 0.3;
    painted_vein.roots_mm = roots_mm;
    let heart = Organ {
        body: Body::Blob(shape),
        material: silicone(),
        overlay: None,
        vessels: vec![painted_vein, painted],
        breathing: 1.0,
        edge_mm: 0.85,
    };
    let cloth = Organ {
        body: Body::Sheet(Sheet {
            depth_mm: 140.0,
            half_size_mm: 220.0,
            slope: [0.02, -0.04],
            cupping_mm: 10.0,
            relief: Relief::new(&[(40.0, 5.0), (14.0, 1.5)], &mut kitchen.random),
        }),
        material: drape(),
        overlay: None,
        vessels: Vec::new(),
        breathing: 0.0,
        edge_mm: 1.8,
    };
    Recipe { organs: vec![heart, cloth], pivot_mm: 125.0 }
}
