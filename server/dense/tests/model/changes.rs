//! Change sets: a viewer that applies them holds the model.

use std::collections::BTreeMap;

use dense::{ChangeSet, DenseConfig, EncodingSteps, PublishConfig, Surfel};

use crate::scene::{Bench, Scene, at, config};

const STEPS: EncodingSteps =
    EncodingSteps { position_m: 2e-5, position_max_m: 20.0, node_m: 4e-6, affine: 1.0 / 4096.0 };
const SCENE: Scene = Scene { ball: true, noise_m: 0.3e-3 };

type Viewer = BTreeMap<u32, Surfel>;

fn apply(viewer: &mut Viewer, changes: &ChangeSet) {
    for surfel in &changes.added {
        assert!(viewer.insert(surfel.id, *surfel).is_none(), "{} added twice", surfel.id);
    }
    for surfel in &changes.updated {
        assert!(viewer.insert(surfel.id, *surfel).is_some(), "{} updated before it was added", surfel.id);
    }
    for id in &changes.removed {
        assert!(viewer.remove(id).is_some(), "{id} removed before it was added");
    }
    let ids: Vec<u32> = changes.added.iter().map(|surfel| surfel.id).collect();
    assert!(ids.is_sorted() && changes.removed.is_sorted());
}

/// Frames in which the camera moves on, the ball goes and comes back, and dead slots pile up.
fn replay(config: &DenseConfig, mut check: impl FnMut(&Viewer, &[Surfel])) -> Vec<ChangeSet> {
    let mut bench = Bench::new(config).unwrap();
    let mut viewer = Viewer::new();
    let mut sets = Vec::new();
    for frame in 0..24 {
        let pose = at(1e-3 * f64::from(frame));
        let scene = Scene { ball: !(6..18).contains(&frame), ..SCENE };
        bench.fuse(frame, &pose, &scene.shoot(&pose, u64::from(frame)));
        if frame % 3 != 1 {
            let changes = bench.model.take_changes(&STEPS).unwrap();
            apply(&mut viewer, &changes);
            check(&viewer, &bench.model.surfels().unwrap());
            sets.push(changes);
        }
    }
    sets
}

#[test]
fn a_viewer_without_tolerances_holds_the_model_as_exactly_as_it_is_sent() {
    let publish = PublishConfig {
        position_mm: 0.0,
        normal_deg: 0.0,
        color_levels: 0.0,
        weight_step: 0.0,
        batch: 1000,
        ..config().publish
    };
    let exact = DenseConfig { publish, compaction_dead_share: 0.02, ..config() };
    let sets = replay(&exact, |viewer, model| {
        assert_eq!(viewer.len(), model.len());
        for (held, surfel) in viewer.values().zip(model) {
            let unplaced = |surfel: &Surfel| Surfel { stamp: 0, position: [0.0; 3], ..*surfel };
            assert_eq!(unplaced(held), unplaced(surfel));
            let mut off = held.position.iter().zip(surfel.position).map(|(held, place)| (held - place).abs());
            assert!(off.all(|off| off <= 1.001e-5), "half a step of the grid: {held:?} {surfel:?}");
        }
    });
    assert!(sets.iter().any(|set| !set.removed.is_empty()), "the test must remove something");
}

#[test]
fn a_viewer_with_tolerances_holds_the_model_within_them() {
    let publish = config().publish;
    let mut largest_m = 0.0f64;
    let sets = replay(&config(), |viewer, model| {
        assert!(viewer.keys().copied().eq(model.iter().map(|surfel| surfel.id)));
        for (held, surfel) in viewer.values().zip(model) {
            let off =
                (0..3).map(|i| f64::from(held.position[i] - surfel.position[i]).powi(2)).sum::<f64>().sqrt();
            largest_m = largest_m.max(off);
        }
    });
    assert!(largest_m <= publish.position_mm * 1.001e-3, "{largest_m}");
    let sent: usize = sets.iter().map(|set| set.added.len() + set.updated.len()).sum();
    eprintln!("{sent} surfels sent");
}

#[test]
fn nothing_changes_between_frames() {
    let mut bench = Bench::new(&config()).unwrap();
    for frame in 0..4 {
        bench.fuse(frame, &at(0.0), &SCENE.shoot(&at(0.0), u64::from(frame)));
    }
    assert!(!bench.model.take_changes(&STEPS).unwrap().is_empty());
    assert!(bench.model.take_changes(&STEPS).unwrap().is_empty());
}
