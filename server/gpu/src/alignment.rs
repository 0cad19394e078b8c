//! Where the GPU's time stamps lie on the CPU's clock.
//!
//! The two clocks share neither zero nor exact rate, and wgpu reads them together nowhere. But a frame's first pass cannot
//! begin before the frame was handed over, nor its last one end after its results were seen: each frame bounds the offset
//! between the clocks from both sides. The offset of the frame before is kept where it is within the bounds, else it
//! moves by as little as they ask for, which follows clocks that drift apart. It starts at the lower bound, as if the GPU
//! had begun at once; while it waits for work, as between the frames of live video, that is right within its latency.

use std::ops::Range;
use std::sync::LazyLock;
use std::time::Instant;

/// What the times of passes count from: about the start of the process.
pub fn trace_epoch() -> Instant {
    static EPOCH: LazyLock<Instant> = LazyLock::new(Instant::now);
    *EPOCH
}

/// Nanoseconds since [`trace_epoch`]; none before it.
pub(crate) fn since_epoch_ns(at: Instant) -> u64 {
    let since = at.saturating_duration_since(trace_epoch());
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

/// The offset between the two clocks as of the last frame.
#[derive(Debug, Default)]
pub(crate) struct Alignment {
    /// A tick that ticks are counted from, and when that was, nanoseconds on the CPU's clock.
    reference: Option<(u64, f64)>,
}

impl Alignment {
    /// Where the passes of one frame lie on the CPU's clock, nanoseconds. `ticks` are the GPU's own, begin and end of each
    /// pass; the frame was handed over and its results were seen at the ends of `window_ns`.
    pub fn place(&mut self, ticks: &[u64], ns_per_tick: f64, window_ns: Range<u64>) -> Vec<Range<u64>> {
        let (Some(&first), Some(&last)) = (ticks.iter().min(), ticks.iter().max()) else { return Vec::new() };
        let (zero, offset_ns) = self.reference.unwrap_or((first, f64::NEG_INFINITY));
        let elapsed_ns = |tick: u64| (i128::from(tick) - i128::from(zero)) as f64 * ns_per_tick;
        let earliest_ns = window_ns.start as f64 - elapsed_ns(first);
        let latest_ns = window_ns.end as f64 - elapsed_ns(last);
        let offset_ns = offset_ns.min(latest_ns).max(earliest_ns);
        self.reference = Some((zero, offset_ns));
        let on_cpu = |tick: u64| (offset_ns + elapsed_ns(tick)).round() as u64;
        ticks.chunks_exact(2).map(|pass| on_cpu(pass[0])..on_cpu(pass[1].max(pass[0]))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_frame_begins_when_it_was_handed_over() {
        let placed = Alignment::default().place(&[500, 600, 600, 700], 10.0, 10_000..20_000);
        assert_eq!(placed, [10_000..11_000, 11_000..12_000]);
    }

    #[test]
    fn later_frames_keep_the_offset_that_their_bounds_allow() {
        let mut alignment = Alignment::default();
        alignment.place(&[0, 100], 1.0, 1_000..5_000);
        assert_eq!(
            alignment.place(&[2_000, 2_100], 1.0, 2_500..9_000),
            std::slice::from_ref(&(3_000..3_100))
        );
    }

    #[test]
    fn clocks_that_drift_apart_are_followed_and_no_pass_leaves_its_frame() {
        for drift in [-1e-3, 1e-3] {
            let mut alignment = Alignment::default();
            for frame in 0..100u64 {
                let begin_ns = 1_000 + frame * 1_000_000;
                let tick = |ns: f64| (ns * (1.0 + drift)) as u64 + (1 << 60);
                let ticks = [tick(begin_ns as f64 + 400.0), tick(begin_ns as f64 + 900.0)];
                let placed = alignment.place(&ticks, 1.0, begin_ns..begin_ns + 1_000);
                assert!(
                    placed[0].start >= begin_ns && placed[0].end <= begin_ns + 1_000,
                    "{frame}: {placed:?}"
                );
            }
        }
    }

    #[test]
    fn stamps_that_were_never_written_do_no_harm() {
        let placed = Alignment::default().place(&[7, 0], 1.0, 100..200);
        assert_eq!(placed.len(), 1);
        assert!(placed[0].start <= placed[0].end);
        assert!(Alignment::default().place(&[], 1.0, 0..1).is_empty());
    }
}
