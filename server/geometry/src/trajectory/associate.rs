//! Which pose belongs to which frame.

/// How the stamps of a trajectory relate to those of the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// The same clock.
    Absolute,
    /// Time since the first frame.
    Relative,
    /// Neither fits.
    Unknown,
}

/// The frame of each stamp.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Association {
    /// For each stamp the index of its frame, if one is near enough.
    pub frames: Vec<Option<usize>>,
    /// On which clock they were found.
    pub clock: Clock,
}

/// Half width of the window (ns) where there is one frame only, so that no frame gap is known.
const LONE_FRAME_WINDOW_NS: i128 = 10_000_000;

/// Finds for each stamp the nearest frame within a third of the median frame gap: on the frames' own clock,
/// or, if no stamp fits there, counted from the first frame.
///
/// `frame_stamps_ns` must be sorted.
pub fn associate(stamps_ns: &[u64], frame_stamps_ns: &[u64]) -> Association {
    let nothing = Association { frames: vec![None; stamps_ns.len()], clock: Clock::Unknown };
    let Some(&first_ns) = frame_stamps_ns.first() else { return nothing };
    let window_ns = window_ns(frame_stamps_ns);
    for (clock, offset_ns) in [(Clock::Absolute, 0), (Clock::Relative, i128::from(first_ns))] {
        let place = |&stamp: &u64| nearest(i128::from(stamp) + offset_ns, frame_stamps_ns, window_ns);
        let frames: Vec<_> = stamps_ns.iter().map(place).collect();
        if frames.iter().any(Option::is_some) {
            return Association { frames, clock };
        }
    }
    nothing
}

fn window_ns(frame_stamps_ns: &[u64]) -> i128 {
    let mut gaps_ns: Vec<i128> =
        frame_stamps_ns.windows(2).map(|pair| i128::from(pair[1]) - i128::from(pair[0])).collect();
    if gaps_ns.is_empty() {
        return LONE_FRAME_WINDOW_NS;
    }
    gaps_ns.sort_unstable();
    let (low, high) = (gaps_ns[(gaps_ns.len() - 1) / 2], gaps_ns[gaps_ns.len() / 2]);
    (low + high) / 6
}

fn nearest(stamp_ns: i128, frame_stamps_ns: &[u64], window_ns: i128) -> Option<usize> {
    let distance_ns = |frame: usize| (stamp_ns - i128::from(frame_stamps_ns[frame])).abs();
    let after = frame_stamps_ns.partition_point(|&frame_ns| i128::from(frame_ns) < stamp_ns);
    let candidates = after.saturating_sub(1)..=after.min(frame_stamps_ns.len() - 1);
    candidates.min_by_key(|&frame| distance_ns(frame)).filter(|&frame| distance_ns(frame) <= window_ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAMES_NS: [u64; 4] = [1_000, 1_030, 1_060, 1_090];

    #[test]
    fn a_stamp_belongs_to_the_nearest_frame_within_a_third_of_the_gap() {
        let found = associate(&[1_000, 1_039, 1_045, 1_071, 1_100], &FRAMES_NS);
        assert_eq!(found.clock, Clock::Absolute);
        assert_eq!(found.frames, [Some(0), Some(1), None, None, Some(3)]);
    }

    #[test]
    fn stamps_may_count_from_the_first_frame() {
        let found = associate(&[0, 31, 90], &FRAMES_NS);
        assert_eq!(found.clock, Clock::Relative);
        assert_eq!(found.frames, [Some(0), Some(1), Some(3)]);
    }

    #[test]
    fn stamps_of_another_clock_belong_nowhere() {
        let found = associate(&[5_000, u64::MAX], &FRAMES_NS);
        assert_eq!(found, Association { frames: vec![None, None], clock: Clock::Unknown });
        assert_eq!(associate(&[0], &[]).clock, Clock::Unknown);
    }

    #[test]
    fn a_lone_frame_takes_what_is_within_ten_milliseconds() {
        let found = associate(&[9_000_000, 11_000_000], &[0]);
        assert_eq!(found.frames, [Some(0), None]);
    }
}
