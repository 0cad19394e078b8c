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
pub fn associate(stamps_ns: &[i64], frame_stamps_ns: &[u64]) -> Association {
    let nothing = Association { frames: vec![None; stamps_ns.len()], clock: Clock::Unknown };
    let Some(&first_ns) = frame_stamps_ns.first() else { return nothing };
    let window_ns = window_ns(frame_stamps_ns);
    for (clock, offset_ns) in [(Clock::Absolute, 0), (Clock::Relative, i128::from(first_ns))] {
        let place = |&stamp: &i64| nearest(i128::from(stamp) + offset_ns, frame_stamps_ns, window_ns);
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
