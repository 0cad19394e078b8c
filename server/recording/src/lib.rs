//! Recordings (MCAP), data-set importers and result files.
