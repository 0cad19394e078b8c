//! Progress of long work: a bar on a terminal, a plain line now and then elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

const BAR: &str = "{prefix:>10} {wide_bar} {pos}/{len} {per_sec} eta {eta}";
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Progress over a known number of steps.
pub struct Progress {
    bar: ProgressBar,
    name: &'static str,
    plain: bool,
    total: u64,
    last_line: Instant,
}

impl Progress {
    /// Starts at 0 of `total`.
    pub fn new(name: &'static str, total: u64) -> Self {
        let plain = !std::io::stderr().is_terminal();
        let bar = if plain { ProgressBar::hidden() } else { ProgressBar::new(total) };
        bar.set_prefix(name);
        if let Ok(style) = ProgressStyle::with_template(BAR) {
            bar.set_style(style);
        }
        Self { bar, name, plain, total, last_line: Instant::now() }
    }

    /// `done` steps are done.
    pub fn set(&mut self, done: u64) {
        self.bar.set_position(done);
        if self.plain && self.last_line.elapsed() >= LINE_EVERY {
            eprintln!("{} {done}/{}", self.name, self.total);
            self.last_line = Instant::now();
        }
    }

    /// All is done.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
