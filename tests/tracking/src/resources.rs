//! CPU time and memory.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use simulator::{SceneConfig, SceneKind};

use crate::Error;
use crate::footage::{Footage, progress, rigid};
use crate::row::{Measured, Row};
use crate::run::{Bench, Recording, track_all};
use crate::settings::Settings;

const MEMORY_FRAMES: usize = 2000;
const MEMORY_MAX_MIB: f64 = 150.0;
const THREAD_MAX_MS: f64 = 12.0;
const PROCESS_MAX_MS: f64 = 25.0;
const FEATURES_MIN: usize = 1000;

/// CPU time.
pub fn time_rows() -> Vec<Row> {
    vec![Row {
        name: "CPU time per frame",
        target: "640x480, 1000+ features: tracking thread <= 12 ms, all threads <= 25 ms (median)",
        anchor: "ORB-SLAM3 27-31 ms (all threads), libviso2 20-23 ms, MIS-SLAM 15 ms",
        measure: time,
    }]
}

/// Memory.
pub fn memory_rows() -> Vec<Row> {
    vec![Row {
        name: "memory after 2000 frames",
        target: "<= 150 MB in a bounded scene",
        anchor: "ORB-SLAM3 308 MB",
        measure: memory,
    }]
}

fn time(footage: &Footage, settings: &Settings) -> Result<Measured, Error> {
    let scene = SceneConfig { scene: SceneKind::Liver, ..settings.scene.clone() };
    let path = footage.simulated("deforming-liver", &scene)?;
    let frames = track_all("CPU time", &Recording::open(&path, &settings.recording)?, &settings.tracking)?;
    let thread_ms = median_ms(frames.iter().map(|frame| frame.thread).collect());
    let process_ms = median_ms(frames.iter().map(|frame| frame.process).collect());
    let features = frames.iter().map(|frame| frame.report.statistics.left_features).min().unwrap_or(0);
    let text = format!(
        "tracking thread {thread_ms:.1} ms, all threads {process_ms:.1} ms, at least {features} features"
    );
    let suffices = thread_ms <= THREAD_MAX_MS && process_ms <= PROCESS_MAX_MS && features >= FEATURES_MIN;
    Ok(Measured::new(text, suffices))
}

fn median_ms(mut times: Vec<Duration>) -> f64 {
    times.sort_unstable();
    times.get(times.len() / 2).map_or(f64::INFINITY, |time| time.as_secs_f64() * 1e3)
}

/// A process of its own, so that nothing but the tracker is measured.
fn memory(footage: &Footage, settings: &Settings) -> Result<Measured, Error> {
    let path = footage.simulated("rigid-liver", &rigid(settings, SceneKind::Liver))?;
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["--resident-after", &MEMORY_FRAMES.to_string()]).arg("--of").arg(path);
    let output = command.stderr(std::process::Stdio::inherit()).output()?;
    let resident_mib: f64 = String::from_utf8(output.stdout)?.trim().parse()?;
    Ok(Measured::new(format!("{resident_mib:.0} MiB"), resident_mib <= MEMORY_MAX_MIB))
}

/// Feeds a recording, which must end where it begins, again and again.
///
/// # Errors
/// What cannot be read or tracked.
pub fn resident_mib_after(frames: usize, path: &Path, settings: &Settings) -> Result<f64, Error> {
    let recording = Recording::open(path, &settings.recording)?;
    let mut bench = Bench::new(&recording.rig, &settings.tracking)?;
    let bar = progress("memory", frames as u64);
    let mut last_ns = 0;
    let mut done = 0;
    while done < frames {
        let offset_ns = last_ns;
        for pair in recording.pairs()?.take(frames - done) {
            let mut pair = pair?;
            pair.stamp_ns += offset_ns;
            last_ns = pair.stamp_ns;
            bench.track(&pair)?;
            done += 1;
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    resident_mib()
}

fn resident_mib() -> Result<f64, Error> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).ok_or("no VmRSS in the status")?;
    let kib: f64 = line.trim().trim_end_matches(" kB").parse()?;
    Ok(kib / 1024.0)
}
