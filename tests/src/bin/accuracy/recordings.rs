//! The recordings that rows replay: simulated or imported once, then kept.

use std::path::{Path, PathBuf};

use mis_slam::cli::progress::Progress;
use mis_slam::config::Config;
use mis_slam::simulated::{self, Encoding};
use recording::import::{self, ImportKind, ImportRequest};
use simulator::{SceneConfig, SceneKind};
use tests::data;

use crate::arguments::Arguments;
use crate::error::AccuracyError;

const ENCODING: Encoding = Encoding { jpeg_quality: 95, depth_every: 10 };

/// Where a row's recording comes from.
#[derive(Clone, Copy)]
pub enum Recorded {
    /// A scene, as `adapt` changes the configured one.
    Scene { kind: SceneKind, adapt: fn(&mut SceneConfig) },
    /// A folder of the shared data.
    Import { kind: ImportKind, folder: &'static str },
    /// A recording among the shared data.
    Shared(&'static str),
}

/// The recording's file; `None`, said aloud, where its data are not on this machine.
pub fn provide(recorded: &Recorded, arguments: &Arguments) -> Result<Option<PathBuf>, AccuracyError> {
    let kept = arguments.work.join("recordings");
    std::fs::create_dir_all(&kept).map_err(AccuracyError::io(&kept))?;
    match *recorded {
        Recorded::Shared(name) => Ok(data::shared_data(name)),
        Recorded::Scene { kind, adapt } => simulate(kind, adapt, &kept, arguments).map(Some),
        Recorded::Import { kind, folder } => {
            let Some(source) = data::shared_data(folder) else { return Ok(None) };
            let path = kept.join(format!("{}.mcap", folder.replace('/', "-")));
            import(kind, &source, &path)?;
            Ok(Some(path))
        }
    }
}

fn simulate(
    kind: SceneKind,
    adapt: fn(&mut SceneConfig),
    kept: &Path,
    arguments: &Arguments,
) -> Result<PathBuf, AccuracyError> {
    let config = Config::load(None, &arguments.overrides)?;
    let (width_px, height_px) = arguments.size_px();
    let mut scene =
        SceneConfig { scene: kind, frames: arguments.frames, width_px, height_px, ..config.simulate.clone() };
    adapt(&mut scene);
    let path = kept.join(format!("{kind}-{:08x}.mcap", fingerprint(&scene)));
    if !path.exists() {
        let mut progress = Progress::new("simulate");
        let unfinished = path.with_extension("unfinished");
        simulated::record(&scene, &ENCODING, &unfinished, &config.recording, &mut |done, total| {
            progress.set(done, Some(total));
        })?;
        progress.finish();
        std::fs::rename(&unfinished, &path).map_err(AccuracyError::io(&path))?;
    }
    Ok(path)
}

fn import(kind: ImportKind, source: &Path, recording: &Path) -> Result<(), AccuracyError> {
    if recording.exists() {
        return Ok(());
    }
    let config = Config::load(None, &[])?;
    let request = ImportRequest::new(kind, source, recording);
    let mut progress = Progress::new("import");
    import::import(&request, &config.recording, &mut |done, total| {
        progress.set(done as u64, Some(total as u64));
    })?;
    progress.finish();
    Ok(())
}

/// A number that differs between scenes (FNV-1a over their text).
fn fingerprint(scene: &SceneConfig) -> u32 {
    format!("{scene:?}")
        .bytes()
        .fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}
