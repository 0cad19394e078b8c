//! What a machine can be expected to do, from what was measured.

use std::collections::BTreeMap;

use gpu::AdapterDescription;
use serde::Serialize;

use super::BenchError;
use super::measure::Measured;
use crate::config::Profile;
use crate::replay::quantiles;

/// Live video of scopes: pairs a second.
const LIVE_HZ: f64 = 30.0;
/// Fewer pairs than this share fused would not be the benchmark.
const FUSED_SHARE_MIN: f64 = 0.8;

/// All that `--json` writes.
#[derive(Clone, Debug, Serialize)]
pub struct BenchReport {
    /// Version of this program.
    pub version: &'static str,
    /// The device.
    pub adapter: Option<AdapterDescription>,
    /// Cores that the tracker, the mapping and the network share.
    pub cores: usize,
    /// Pairs counted in each case.
    pub pairs: u32,
    /// One for each size and profile.
    pub cases: Vec<BenchCase>,
}

/// One session alone, of one size and profile.
#[derive(Clone, Debug, Serialize)]
pub struct BenchCase {
    /// Name of the options.
    pub profile: Profile,
    /// Columns of an image.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// Pairs that came through in a second, tracker and GPU side by side.
    pub pairs_per_s: f64,
    /// Time from a pair to its pose, median.
    pub tracker_ms: f64,
    /// How long a pair has the GPU, median: kernels, and the results taken away.
    pub gpu_turn_ms: f64,
    /// Time of all cores together for a pair. On software Vulkan the kernels run there too.
    pub cpu_ms: f64,
    /// Every stage, longest first on each side.
    pub stages: Vec<StageShare>,
    /// What one session holds on the GPU, MiB.
    pub gpu_mib: f64,
    /// Surfels at the end.
    pub surfels: u32,
    /// Live sessions that fit beside each other.
    pub sessions: Sessions,
}

/// Time of one stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageShare {
    /// Name.
    pub name: &'static str,
    /// `tracker` or `gpu`; the two sides work beside each other.
    pub side: &'static str,
    /// Median.
    pub median_ms: f64,
    /// Of the sum of its side.
    pub share: f64,
}

/// How many sessions of 30 pairs a second one machine holds, by what each takes alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Sessions {
    /// That many.
    pub count: u32,
    /// What there is too little of for one more.
    pub limit: Limit,
}

/// What runs out first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Limit {
    /// One tracker takes longer than the time between two pairs.
    Tracker,
    /// The GPU, which sessions have in turn.
    Gpu,
    /// The cores.
    Cores,
}

impl Limit {
    /// As people are told.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tracker => "tracker",
            Self::Gpu => "GPU",
            Self::Cores => "cores",
        }
    }
}

impl BenchReport {
    pub(super) fn new(adapter: Option<AdapterDescription>, pairs: u32, cases: Vec<BenchCase>) -> Self {
        Self { version: env!("CARGO_PKG_VERSION"), adapter, cores: cores(), pairs, cases }
    }
}

/// # Errors
/// [`BenchError::NotFused`].
pub(super) fn case(
    profile: Profile,
    size_px: (u32, u32),
    measured: &Measured,
) -> Result<BenchCase, BenchError> {
    let pairs = measured.turn_ms.len() as u32;
    if f64::from(measured.fused) < FUSED_SHARE_MIN * f64::from(pairs) || pairs == 0 {
        return Err(BenchError::NotFused { profile, size_px, fused: measured.fused, pairs });
    }
    let tracker_ms = quantiles(&measured.tracker_ms).median;
    let gpu_turn_ms = quantiles(&measured.turn_ms).median;
    let cpu_ms = measured.cpu.as_secs_f64() * 1e3 / f64::from(pairs);
    let mut stages = shares("tracker", &measured.tracker_stages);
    stages.extend(shares("gpu", &measured.gpu_stages));
    Ok(BenchCase {
        profile,
        width_px: size_px.0,
        height_px: size_px.1,
        pairs_per_s: f64::from(pairs) / measured.elapsed.as_secs_f64().max(f64::MIN_POSITIVE),
        tracker_ms,
        gpu_turn_ms,
        cpu_ms,
        stages,
        gpu_mib: measured.gpu_bytes as f64 / f64::from(1 << 20),
        surfels: measured.surfels,
        sessions: sessions(tracker_ms, gpu_turn_ms, cpu_ms / cores() as f64),
    })
}

fn shares(side: &'static str, stages: &BTreeMap<&'static str, Vec<f64>>) -> Vec<StageShare> {
    let medians = stages.iter().map(|(&name, ms)| (name, quantiles(ms).median));
    let mut medians: Vec<(&'static str, f64)> = medians.collect();
    medians.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let sum: f64 = medians.iter().map(|(_, ms)| ms).sum();
    let share = |(name, median_ms): (&'static str, f64)| StageShare {
        name,
        side,
        median_ms,
        share: median_ms / sum.max(f64::MIN_POSITIVE),
    };
    medians.into_iter().map(share).collect()
}

/// Sessions by the time that a pair takes of each resource, milliseconds: of its own tracker, of the one GPU, of all cores.
fn sessions(tracker_ms: f64, gpu_ms: f64, cores_ms: f64) -> Sessions {
    let period_ms = 1e3 / LIVE_HZ;
    if tracker_ms > period_ms {
        return Sessions { count: 0, limit: Limit::Tracker };
    }
    let fit = |taken_ms: f64| (period_ms / taken_ms.max(f64::MIN_POSITIVE)).floor() as u32;
    if fit(gpu_ms) <= fit(cores_ms) {
        Sessions { count: fit(gpu_ms), limit: Limit::Gpu }
    } else {
        Sessions { count: fit(cores_ms), limit: Limit::Cores }
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_are_bounded_by_what_runs_out_first() {
        assert_eq!(sessions(10.0, 6.0, 2.0), Sessions { count: 5, limit: Limit::Gpu });
        assert_eq!(sessions(10.0, 6.0, 9.0), Sessions { count: 3, limit: Limit::Cores });
        assert_eq!(sessions(40.0, 1.0, 1.0), Sessions { count: 0, limit: Limit::Tracker });
        assert_eq!(sessions(30.0, 600.0, 1.0), Sessions { count: 0, limit: Limit::Gpu });
    }

    #[test]
    fn shares_are_of_one_side_and_the_longest_comes_first() {
        let stages = BTreeMap::from([("census", vec![1.0, 1.0, 9.0]), ("fusion", vec![3.0, 3.0, 3.0])]);
        let shares = shares("gpu", &stages);
        assert_eq!(shares.iter().map(|stage| stage.name).collect::<Vec<_>>(), ["fusion", "census"]);
        assert_eq!(shares.iter().map(|stage| stage.share).collect::<Vec<_>>(), [0.75, 0.25]);
    }

    #[test]
    fn a_run_that_fused_little_is_no_benchmark() {
        let measured = Measured { turn_ms: vec![1.0; 10], fused: 7, ..Measured::default() };
        let refused = case(Profile::Cpu, (640, 480), &measured).unwrap_err().to_string();
        assert_eq!(refused, "cpu at 640x480: only 7 of 10 pairs were fused");
    }
}
