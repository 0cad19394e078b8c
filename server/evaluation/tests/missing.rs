//! Results and truths that are incomplete or damaged.

mod scene;

use evaluation::{Evaluation, EvaluationError, Truth, evaluate};

fn without(change: impl FnOnce(&std::path::Path)) -> Result<Evaluation, EvaluationError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let recording = folder.path().join("truth.mcap");
    scene::write_recording(&recording, true);
    scene::write_results(folder.path());
    change(folder.path());
    evaluate(folder.path(), &Truth::read(&scene::open(&recording))?)
}

fn remove(folder: &std::path::Path, file: &str) {
    std::fs::remove_file(folder.join(file)).expect("it was written");
}

#[test]
fn absent_results_score_null_and_are_listed() {
    let scores = without(|folder| {
        for file in ["trajectory.tum", "model.ply", "points.csv"] {
            remove(folder, file);
        }
        std::fs::remove_dir_all(folder.join("depth")).expect("it was written");
    })
    .expect("nothing is damaged");
    assert_eq!(scores.missing, ["trajectory.tum", "depth/*.pfm", "model.ply", "points.csv"]);
    assert_eq!(scores.trajectory.ate_rmse_mm, None);
    assert_eq!(scores.depth.depth_mae_mm, None);
    assert_eq!(scores.surface.completeness, None);
    assert_eq!(scores.points.point_error_mm, None);
}

#[test]
fn without_a_trajectory_the_world_is_scored_but_not_the_camera() {
    let scores = without(|folder| remove(folder, "trajectory.tum")).expect("nothing is damaged");
    assert!(scores.surface.surface_error_mm.is_some() && scores.surface.surface_error_camera_mm.is_none());
    assert!(scores.points.point_error_mm.is_some() && scores.points.point_error_camera_mm.is_none());
}

#[test]
fn depth_maps_that_fit_upside_down_are_warned_of() {
    let scores = without(|folder| {
        for number in [1, 6, 12] {
            let file = folder.join(format!("depth/{number:06}.pfm"));
            let map = recording::export::read_pfm(&file).expect("it was written");
            let height = map.height();
            let flipped = geometry::DepthMap::from_fn(map.width(), height, |x, y| map[(x, height - 1 - y)]);
            recording::export::write_pfm(&file, &flipped).expect("a writable folder");
        }
    })
    .expect("nothing is damaged");
    assert!(scores.warnings.iter().any(|warning| warning.contains("upside down")), "{:?}", scores.warnings);
}

#[test]
fn a_damaged_model_is_an_error_that_names_the_file() {
    let error =
        without(|folder| std::fs::write(folder.join("model.ply"), "ply\n").expect("a writable folder"));
    let message = error.expect_err("no surfels").to_string();
    assert!(message.contains("model.ply"), "{message}");
}

#[test]
fn a_folder_that_is_not_there_is_an_error() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let recording = folder.path().join("truth.mcap");
    scene::write_recording(&recording, false);
    let absent = folder.path().join("absent");
    let reader = scene::open(&recording);
    let truth = Truth::read(&reader).expect("it was written");
    let error = evaluate(&absent, &truth).expect_err("not there");
    assert!(matches!(error, EvaluationError::NoResults(_)), "{error}");
}
