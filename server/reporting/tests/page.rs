//! Pages of runs made here: whole, sparse and damaged.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

use std::fs;
use std::path::{Path, PathBuf};

use geometry::trajectory::StampedPose;
use geometry::{DepthMap, Pinhole, Pose, Raster, StereoRig};
use recording::export::{PlySurfel, write_pfm, write_ply, write_tum};
use recording::{Calibration, RecordingConfig, RecordingWriter, encode_png_rgb};
use reporting::{RenderedReport, ReportingError, RunSource, report};
use serde::Deserialize;

const SIZE: (u32, u32) = (64, 48);
const DEPTH_M: f32 = 0.05;
const PAIRS: u64 = 12;

/// Section `[recording]` of the documented defaults.
fn config() -> RecordingConfig {
    #[derive(Deserialize)]
    struct File {
        recording: RecordingConfig,
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/server.toml");
    toml::from_str::<File>(&fs::read_to_string(path).unwrap()).unwrap().recording
}

fn rig() -> StereoRig {
    let left = Pinhole { width_px: 64, height_px: 48, fx_px: 50.0, fy_px: 50.0, cx_px: 31.5, cy_px: 23.5 };
    StereoRig { left, baseline_m: 0.005, right_cx_px: 31.5 }
}

fn stamp_ns(pair: u64) -> u64 {
    1_000_000_000 + pair * 100_000_000
}

fn pose(pair: u64) -> Pose {
    Pose::translation(0.0005 * pair as f64, 0.0, 0.0)
}

fn trajectory() -> Vec<StampedPose> {
    (0..PAIRS).map(|pair| StampedPose { stamp_ns: stamp_ns(pair), world_from_camera: pose(pair) }).collect()
}

const REPORT: &str = r#"{
    "adapter": "test adapter", "recording": null,
    "frames": {"received": 24, "paired": 12, "dropped": 0, "tracked": 12, "lost": 0, "fused": 12, "discarded": 0},
    "reasons": {},
    "stages": {"tracking": {"runs": 12, "median_ms": 4.5, "p95_ms": 6.0, "clock": "cpu"},
               "fusion": {"runs": 12, "median_ms": 9.0, "p95_ms": 11.0, "clock": "gpu"}},
    "frame_ms": {"median": 20.0, "p95": 25.0}, "wall_s": 1.5, "surfels": 3072, "nodes": 7,
    "back_projection_mm": {"mean": 0.123, "median": 0.1, "rmse": 0.2, "p95": 0.4, "coverage": 0.97},
    "stream": {"bytes": 120000, "epochs": 12, "bits_per_s_at_fps": 800000.0, "max_error_mm": 0.11},
    "peak_memory": {"cpu_mib": 100.0, "gpu_mib": 50.0}, "truncated": false
}"#;

struct Scratch {
    folder: tempfile::TempDir,
}

impl Scratch {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A run that wrote no more than a report.
    fn sparse_run(&self, name: &str) -> PathBuf {
        let directory = self.path(name);
        fs::create_dir_all(&directory).unwrap();
        fs::write(directory.join("report.json"), REPORT).unwrap();
        directory
    }

    /// A run that wrote everything: a flat wall, seen from a camera that goes to the right.
    fn whole_run(&self, name: &str) -> PathBuf {
        let directory = self.sparse_run(name);
        for folder in ["views", "depth"] {
            fs::create_dir_all(directory.join(folder)).unwrap();
        }
        let picture = Raster::from_fn(SIZE.0, SIZE.1, |x, y| [x as u8 * 4, y as u8 * 5, 90]);
        let png = encode_png_rgb(&picture).unwrap().bytes;
        fs::write(directory.join("model.png"), &png).unwrap();
        for pair in 0..PAIRS {
            let file =
                |folder: &str, extension: &str| directory.join(format!("{folder}/{pair:06}.{extension}"));
            fs::write(file("views", "png"), &png).unwrap();
            write_pfm(&file("views", "pfm"), &DepthMap::filled(SIZE.0, SIZE.1, DEPTH_M + 5e-4)).unwrap();
            write_pfm(&file("depth", "pfm"), &DepthMap::filled(SIZE.0, SIZE.1, DEPTH_M)).unwrap();
        }
        write_tum(&directory.join("trajectory.tum"), &trajectory()).unwrap();
        write_ply(&directory.join("model.ply"), &wall()).unwrap();
        fs::write(directory.join("frames.csv"), "frame,mean_mm,p95_mm\n0,,\n1,0.1,0.3\n2,0.2,0.4\n").unwrap();
        fs::write(directory.join("tracking.csv"), "frame,matches,inliers\n0,0,0\n1,200,180\n").unwrap();
        fs::write(directory.join("stream.csv"), "epoch,stamp_ns,bytes\n1,1,90000\n2,2,30000\n").unwrap();
        directory
    }

    /// The recording of that run, with everything true about it.
    fn recording(&self) -> PathBuf {
        let path = self.path("truth.mcap");
        let mut writer = RecordingWriter::create(&path, &config()).unwrap();
        writer.write_metadata("simulation", [("scene".to_owned(), "liver".to_owned())].into()).unwrap();
        writer.write_calibration(stamp_ns(0), &Calibration::Rectified(rig())).unwrap();
        for pose in trajectory() {
            let image = recording::encode_jpeg(&Raster::filled(SIZE.0, SIZE.1, [120, 40, 40]), 90).unwrap();
            writer.write_pair(pose.stamp_ns, &image, &image).unwrap();
            writer.write_truth_pose(&pose).unwrap();
            let depth = DepthMap::filled(SIZE.0, SIZE.1, DEPTH_M);
            writer.write_truth_depth(pose.stamp_ns, &depth).unwrap();
        }
        writer.finish().unwrap();
        path
    }
}

/// The wall as a model, half a millimetre behind the truth.
fn wall() -> Vec<PlySurfel> {
    let place = |x: i32, y: i32| [x as f32 * 1e-3, y as f32 * 1e-3, DEPTH_M + 5e-4];
    let surfel = |position| PlySurfel { position, normal: [0.0, 0.0, -1.0], ..PlySurfel::default() };
    (-20..20).flat_map(|y| (-20..20).map(move |x| surfel(place(x, y)))).collect()
}

fn render(directories: &[&Path], truth: Option<&Path>) -> Result<RenderedReport, ReportingError> {
    let source = |directory: &&Path| RunSource {
        directory: directory.to_path_buf(),
        recording: truth.map(Path::to_path_buf),
    };
    let sources: Vec<_> = directories.iter().map(source).collect();
    report(&sources, &config(), &mut |_| {})
}

fn refusal(directory: &Path) -> String {
    match render(&[directory], None) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("{} was not refused", directory.display()),
    }
}

#[test]
fn a_whole_run_has_every_section_and_its_pictures_inside() {
    let scratch = Scratch::new();
    let page = render(&[&scratch.whole_run("wall")], Some(&scratch.recording())).unwrap().html;
    for heading in [
        "Over the run",
        "Trajectory",
        "Frame by frame",
        "Model against truth",
        "Against the paper",
        "Time of each stage",
        "Stream to viewers",
    ] {
        assert!(page.contains(&format!("<h3>{heading}</h3>")), "{heading}");
    }
    assert!(!page.contains("class=\"absent\""), "nothing is absent");
    // Per frame: scope, model, depth, model against depth, depth against truth; the whole model; three views and slices.
    assert_eq!(page.matches("src=\"data:image/jpeg;base64,").count(), 5 * 5 + 1 + 6);
    assert_eq!(page.matches("<svg").count(), 5, "two paths, two series by frame, one by epoch");
    assert!(page.contains("model less measured depth: mean 0.50 mm"));
    assert!(page.contains("measured less true depth: mean 0.00 mm"));
    assert!(
        !page.contains("src=\"http") && !page.contains("<link") && !page.contains("url("),
        "nothing is fetched"
    );
}

#[test]
fn the_figures_hold_the_report_the_scores_and_the_papers_rows() {
    let scratch = Scratch::new();
    let json = render(&[&scratch.whole_run("wall")], Some(&scratch.recording())).unwrap().json;
    let figures: serde_json::Value = serde_json::from_str(&json).unwrap();
    let run = &figures["runs"][0];
    assert_eq!((run["name"].as_str(), run["recording"].as_str()), (Some("wall"), Some("truth.mcap")));
    assert_eq!(run["report"]["surfels"], 3072);
    let surface_mm = run["scores"]["surface_error_camera_mm"]["mean"].as_f64().unwrap();
    assert!((surface_mm - 0.5).abs() < 0.01, "{surface_mm}");
    let applies = |row: &&serde_json::Value| row["applies"] == true;
    let rows: Vec<_> = run["paper"].as_array().unwrap().iter().filter(applies).collect();
    assert_eq!(rows[0]["what"], "simulated liver, distance of points");
    assert_eq!(rows[0]["ours"], serde_json::Value::Null, "no point was followed, so none is invented");
}

#[test]
fn what_a_run_did_not_write_is_said_to_be_missing() {
    let scratch = Scratch::new();
    let rendered = render(&[&scratch.sparse_run("bare")], None).unwrap();
    for (named, absent) in [
        ("--views-every", "No pictures were written."),
        ("--save-depth", "No true surface is known."),
        ("trajectory.tum", "The run has no trajectory."),
        ("frames.csv", "The run tells nothing of single frames."),
        ("--truth", "No score: nothing true is known."),
    ] {
        assert!(rendered.html.contains(named) && rendered.html.contains(absent), "{named}: {absent}");
    }
    assert!(!rendered.html.contains("<img") && !rendered.html.contains("<svg"));
    let figures: serde_json::Value = serde_json::from_str(&rendered.json).unwrap();
    assert!(figures["runs"][0]["missing"].as_array().unwrap().len() >= 8);
}

#[test]
fn several_runs_begin_with_a_comparison_that_leads_to_each() {
    let scratch = Scratch::new();
    let runs = [scratch.whole_run("first"), scratch.sparse_run("<second>")];
    let page = render(&[&runs[0], &runs[1]], None).unwrap().html;
    let comparison = page.find("<h2 id=\"comparison\">").unwrap();
    assert!(comparison < page.find("<article").unwrap());
    for link in ["<a href=\"#run-1\">first</a>", "<a href=\"#run-2\">&#60;second&#62;</a>"] {
        assert!(page.contains(link), "{link}");
    }
    let alone = render(&[&runs[0]], None).unwrap().html;
    assert!(!alone.contains("id=\"comparison\""));
}

#[test]
fn the_same_runs_give_the_same_page() {
    let scratch = Scratch::new();
    let (run, truth) = (scratch.whole_run("wall"), scratch.recording());
    let [first, second] = [(); 2].map(|()| render(&[&run], Some(&truth)).unwrap());
    assert!(first.html == second.html && first.json == second.json);
}

#[test]
fn a_damaged_run_is_refused_by_the_name_of_the_file() {
    let scratch = Scratch::new();
    assert!(refusal(&scratch.path("nothing")).contains("nothing/report.json: no such file"));
    let damages: [(&str, &[u8]); 8] = [
        ("report.json", b"{ \"adapter\": "),
        ("report.json", b"{ \"adapter\": 1 }"),
        ("trajectory.tum", b"1.0 2.0\n"),
        ("frames.csv", b"frame,mean_mm,p95_mm\n0,x,1\n"),
        ("tracking.csv", b"frame,matches\n0,1\n"),
        ("depth/000011.pfm", b"Pf\n64 48\n-1.0\nshort"),
        ("views/000011.png", b"no picture"),
        ("model.png", b"no picture"),
    ];
    for (number, (file, bytes)) in damages.into_iter().enumerate() {
        let run = scratch.whole_run(&format!("run{number}"));
        fs::write(run.join(file), bytes).unwrap();
        let told = refusal(&run);
        assert!(told.contains(&format!("run{number}/{file}")), "{file}: {told}");
    }
}
