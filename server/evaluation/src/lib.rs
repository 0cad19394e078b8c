//! Scores of a replay against the truth in its recording.
