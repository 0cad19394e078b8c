//! `mis-slam bench`: what this machine can be expected to do.

use std::path::{Path, PathBuf};

use clap::Args;
use comfy_table::{CellAlignment, Table, presets};

use super::progress::Progress;
use super::{Failure, Outcome, parse_size};
use crate::bench::{self, BenchCase, BenchError, BenchOptions, BenchReport};
use crate::config::{Config, Profile};

/// Sizes of scopes; the larger one only where there is a GPU.
const SIZES_PX: [(u32, u32); 2] = [(640, 480), (1280, 1024)];
const SOFTWARE_SIZES_PX: [(u32, u32); 2] = [(320, 240), (640, 480)];
const QUICK_SIZE_PX: (u32, u32) = (320, 240);
/// Pairs of a run, and how many of them are not counted.
const PAIRS: (u32, u32) = (40, 10);
const QUICK_PAIRS: (u32, u32) = (5, 2);
/// Stages below this share are summed up.
const SHARE_MIN: f64 = 0.02;

/// Measure this machine: time per stage, pairs a second, sessions that it holds, GPU memory.
///
/// A simulated liver goes through the real pipeline, once for each size and profile. Alone on an idle machine it tells
/// what can be expected there.
#[derive(Debug, Args)]
pub struct Bench {
    /// Columns and rows; may be repeated. Where left out, 640x480 and 1280x1024, or 320x240 and 640x480 without a GPU.
    #[arg(long = "size", value_name = "WxH", value_parser = parse_size)]
    sizes: Vec<(u32, u32)>,
    /// Options to measure; may be repeated. All where left out.
    #[arg(long = "profile", value_enum)]
    profiles: Vec<Profile>,
    /// A few small pairs: whether it works, not how fast.
    #[arg(long)]
    quick: bool,
    /// Also write all figures.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Bench {
    pub(super) fn run(self, config: &Config, layers: (Option<&Path>, &[String])) -> Outcome {
        let options = self.options(config, layers)?;
        let mut progress = Progress::new("bench");
        let measured = bench::bench(&options, &mut |done, total| progress.set(done, Some(total)));
        progress.finish();
        let report = measured.map_err(failure)?;
        print(&report);
        self.json.map_or(Ok(()), |path| write(&path, &report))
    }

    fn options(
        &self,
        config: &Config,
        (file, overrides): (Option<&Path>, &[String]),
    ) -> Result<BenchOptions, Failure> {
        let profiles = if self.profiles.is_empty() { &Profile::ALL[..] } else { &self.profiles };
        let profiles = profiles
            .iter()
            .map(|&profile| Ok((profile, Config::load_over(profile, file, overrides)?)))
            .collect::<Result<_, Failure>>()?;
        let sizes_px = match (self.sizes.is_empty(), self.quick) {
            (false, _) => self.sizes.clone(),
            (true, true) => vec![QUICK_SIZE_PX],
            (true, false) => standard_sizes(config)?.to_vec(),
        };
        let (pairs, warm_up) = if self.quick { QUICK_PAIRS } else { PAIRS };
        Ok(BenchOptions { sizes_px, profiles, pairs, warm_up })
    }
}

fn standard_sizes(config: &Config) -> Result<[(u32, u32); 2], Failure> {
    let gpu = gpu::Gpu::open(&config.gpu.clone().with_environment()).map_err(Failure::failed)?;
    Ok(if gpu.description().kind == "software" { SOFTWARE_SIZES_PX } else { SIZES_PX })
}

fn failure(error: BenchError) -> Failure {
    match error {
        BenchError::Scene(_) | BenchError::TooFewPairs { .. } => Failure::bad_input(error),
        _ => Failure::failed(error),
    }
}

fn print(report: &BenchReport) {
    if let Some(adapter) = &report.adapter {
        println!("adapter  {} ({}, {})", adapter.name, adapter.kind, adapter.driver);
        if adapter.kind == "software" {
            println!("         no GPU: kernels run on the cores, beside the tracker");
        }
    }
    println!("cores    {}, {} pairs counted in each run\n", report.cores, report.pairs);
    println!("{}\n", summary(&report.cases));
    for case in &report.cases {
        println!("{} at {}x{}\n{}\n", case.profile, case.width_px, case.height_px, stages(case));
    }
}

fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(header);
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn summary(cases: &[BenchCase]) -> Table {
    let header = [
        "profile",
        "size",
        "pairs/s",
        "tracker ms",
        "GPU turn ms",
        "cores ms",
        "surfels",
        "GPU MiB",
        "30 fps sessions",
        "limit",
    ];
    let mut table = table(&header);
    for case in cases {
        table.add_row([
            case.profile.to_string(),
            format!("{}x{}", case.width_px, case.height_px),
            format!("{:.1}", case.pairs_per_s),
            format!("{:.1}", case.tracker_ms),
            format!("{:.1}", case.gpu_turn_ms),
            format!("{:.1}", case.cpu_ms),
            case.surfels.to_string(),
            format!("{:.0}", case.gpu_mib),
            case.sessions.count.to_string(),
            case.sessions.limit.name().to_owned(),
        ]);
    }
    table
}

fn stages(case: &BenchCase) -> Table {
    let mut table = table(&["side", "stage", "ms", "share"]);
    let row = |side: &str, name: &str, ms: f64, share: f64| {
        [side.to_owned(), name.to_owned(), format!("{ms:.2}"), format!("{:.0} %", 100.0 * share)]
    };
    for side in ["tracker", "gpu"] {
        let of_side = case.stages.iter().filter(|stage| stage.side == side);
        let (shown, others): (Vec<_>, Vec<_>) = of_side.partition(|stage| stage.share >= SHARE_MIN);
        for stage in shown {
            table.add_row(row(side, stage.name, stage.median_ms, stage.share));
        }
        if !others.is_empty() {
            let ms = others.iter().map(|stage| stage.median_ms).sum();
            let share = others.iter().map(|stage| stage.share).sum();
            table.add_row(row(side, "all others", ms, share));
        }
    }
    table
}

fn write(path: &Path, report: &BenchReport) -> Outcome {
    let text = serde_json::to_string_pretty(report).expect("a report has string keys and finite numbers");
    std::fs::write(path, text + "\n").map_err(|error| Failure::failed(format!("{}: {error}", path.display())))
}
