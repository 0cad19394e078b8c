//! Grows branching vessels over a body by a persistent random walk that avoids vessels already there.

use std::collections::HashMap;
use std::f64::consts::TAU;

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;

use super::Lattice;
use super::vessels::{Segment, VesselTone};
use crate::shape::Body;

const STEP_MM: f64 = 0.8;
/// Share of its curvature that a vessel keeps from step to step: more makes it curl into rings.
const PERSISTENCE: f64 = 0.72;
/// Vessels end where no view of a run comes.
const FARTHEST_FROM_AXIS_MM: f64 = 130.0;
/// Bounds the work whatever the species.
const SEGMENTS_MAX: usize = 120_000;
/// Vessels of one species keep this far apart ...
const SPACING_MM: f64 = 2.2;
/// ... except a branch from its parent on this first stretch.
const PARTING_MM: f64 = 4.0;
/// A trunk rises from the depth over this length.
const RISING_MM: f64 = 9.0;

/// One kind of vessel of a body.
#[derive(Clone)]
pub(crate) struct VesselSpecies {
    /// Trees grown.
    pub trees: usize,
    /// Where trees start: drawn from these points, else anywhere on the body.
    pub roots_mm: Vec<Point3<f64>>,
    /// Radius of the trunk.
    pub radius_mm: f64,
    /// Branches end here.
    pub radius_min_mm: f64,
    /// Loss of radius per millimetre.
    pub taper: f64,
    /// Curvature noise, radians per millimetre.
    pub wander: f64,
    /// Mean distance between branchings of a vessel of 1 mm radius; thin ones branch sooner.
    pub branching_mm: f64,
    pub tone: VesselTone,
}

struct Tip {
    at_mm: Point3<f64>,
    heading: Vector3<f64>,
    radius_mm: f64,
    curvature: f64,
    to_branching_mm: f64,
    /// Names the vessel from its root or branching on.
    vessel: u32,
    since_parting_mm: f64,
    /// Share of the full opacity: a trunk's root lies deep.
    risen: f64,
}

/// Which vessel runs through each cell of space.
#[derive(Default)]
struct Territory {
    owners: HashMap<[i32; 3], u32>,
    vessels: u32,
}

impl Territory {
    fn new_vessel(&mut self) -> u32 {
        self.vessels += 1;
        self.vessels
    }

    /// Takes the cell for the tip's vessel; false where another one runs.
    fn claim(&mut self, tip: &Tip) -> bool {
        let cell = [0, 1, 2].map(|axis| (tip.at_mm[axis] / SPACING_MM).floor() as i32);
        let owner = *self.owners.entry(cell).or_insert(tip.vessel);
        owner == tip.vessel || tip.since_parting_mm < PARTING_MM
    }
}

/// Vessels of one species over the visible part of a body.
pub(crate) fn grow(
    species: &VesselSpecies,
    body: &Body,
    seeds_mm: &[Point3<f64>],
    lattice: &Lattice,
    random: &mut Pcg64,
) -> Vec<Segment> {
    let ground = Ground { body, lattice };
    let mut segments = Vec::new();
    let mut territory = Territory::default();
    for _ in 0..species.trees {
        let roots = if species.roots_mm.is_empty() { seeds_mm } else { &species.roots_mm };
        let at_mm = body.project(lattice, &roots[random.random_range(0..roots.len())]);
        let radius_mm = species.radius_mm * random.random_range(0.6..1.0);
        let heading = any_tangent(&body.normal(lattice, &at_mm), random);
        let mut trunk = species.tip(at_mm, heading, radius_mm, territory.new_vessel(), random);
        (trunk.risen, trunk.since_parting_mm) = (0.0, PARTING_MM);
        let mut tips = vec![trunk];
        while let Some(mut tip) = tips.pop() {
            while segments.len() < SEGMENTS_MAX && tip.radius_mm > species.radius_min_mm {
                if !territory.claim(&tip) {
                    break;
                }
                let normal = body.normal(lattice, &tip.at_mm);
                let Some(segment) = species.advance(&mut tip, &normal, &ground, random) else { break };
                segments.push(segment);
                if tip.to_branching_mm <= 0.0 {
                    tips.push(species.branch(&mut tip, &normal, territory.new_vessel(), random));
                }
            }
        }
    }
    segments
}

struct Ground<'a> {
    body: &'a Body,
    lattice: &'a Lattice,
}

impl Ground<'_> {
    /// The point of the surface right below or above a target: the body's rays are slanted, so what a projection moved
    /// sideways is taken back and projected again.
    fn foot(&self, target_mm: &Point3<f64>, normal: &Vector3<f64>) -> Point3<f64> {
        let mut aim = *target_mm;
        for _ in 0..2 {
            let off = self.body.project(self.lattice, &aim) - target_mm;
            aim -= off - normal * normal.dot(&off);
        }
        self.body.project(self.lattice, &aim)
    }
}

impl VesselSpecies {
    fn tip(
        &self,
        at_mm: Point3<f64>,
        heading: Vector3<f64>,
        radius_mm: f64,
        vessel: u32,
        random: &mut Pcg64,
    ) -> Tip {
        let to_branching_mm = self.to_branching_mm(radius_mm, random);
        let (curvature, since_parting_mm, risen) = (0.0, 0.0, 1.0);
        Tip { at_mm, heading, radius_mm, curvature, to_branching_mm, vessel, since_parting_mm, risen }
    }

    fn to_branching_mm(&self, radius_mm: f64, random: &mut Pcg64) -> f64 {
        self.branching_mm * radius_mm.sqrt() * random.random_range(0.4..1.6)
    }

    fn advance(
        &self,
        tip: &mut Tip,
        normal: &Vector3<f64>,
        ground: &Ground<'_>,
        random: &mut Pcg64,
    ) -> Option<Segment> {
        tip.curvature = PERSISTENCE * tip.curvature + self.wander * random.random_range(-1.0..1.0);
        let turned = turn(&tip.heading, normal, tip.curvature * STEP_MM);
        let to_mm = ground.foot(&(tip.at_mm + turned * STEP_MM), normal);
        let moved = to_mm - tip.at_mm;
        let radius_after = tip.radius_mm - self.taper * STEP_MM;
        let stuck = moved.norm() < 0.2 * STEP_MM || moved.norm() > 3.0 * STEP_MM;
        if stuck || to_mm.coords.xy().norm() > FARTHEST_FROM_AXIS_MM {
            return None;
        }
        tip.risen = (tip.risen + STEP_MM / RISING_MM).min(1.0);
        let segment = Segment {
            from_mm: tip.at_mm.coords.cast(),
            to_mm: to_mm.coords.cast(),
            from_radius_mm: tip.radius_mm as f32,
            to_radius_mm: radius_after.max(0.0) as f32,
            tone: self.tone.deep(tip.risen as f32),
        };
        tip.heading = moved.normalize();
        tip.to_branching_mm -= moved.norm();
        tip.since_parting_mm += moved.norm();
        (tip.at_mm, tip.radius_mm) = (to_mm, radius_after);
        Some(segment)
    }

    /// Splits a side branch off; the trunk thins a little and turns the other way.
    fn branch(&self, tip: &mut Tip, normal: &Vector3<f64>, vessel: u32, random: &mut Pcg64) -> Tip {
        let side = if random.random_bool(0.5) { 1.0 } else { -1.0 };
        let angle = random.random_range(0.5..1.15);
        let thinner = tip.radius_mm * random.random_range(0.5..0.82);
        let mut branch =
            self.tip(tip.at_mm, turn(&tip.heading, normal, side * angle), thinner, vessel, random);
        branch.risen = tip.risen;
        tip.heading = turn(&tip.heading, normal, -side * 0.25);
        tip.radius_mm *= 0.93;
        tip.to_branching_mm = self.to_branching_mm(tip.radius_mm, random);
        branch
    }
}

fn any_tangent(normal: &Vector3<f64>, random: &mut Pcg64) -> Vector3<f64> {
    let direction = Vector3::new(random.random_range(-1.0..1.0), random.random_range(-1.0..1.0), 0.1);
    let tangent = direction - normal * normal.dot(&direction);
    let start = tangent.try_normalize(1e-6).unwrap_or_else(Vector3::x);
    turn(&start, normal, random.random_range(0.0..TAU))
}

fn turn(heading: &Vector3<f64>, normal: &Vector3<f64>, angle_rad: f64) -> Vector3<f64> {
    UnitQuaternion::from_axis_angle(&Unit::new_normalize(*normal), angle_rad) * heading
}
