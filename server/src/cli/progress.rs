//! Progress of long work: a bar on a terminal, a plain line now and then elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

const BAR: &str = "{prefix:>10} {wide_bar} {pos}/{len} {per_sec} eta {eta}";
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Progress of one piece of work.
pub struct Progress {
    bar: ProgressBar,
    name: &'static str,
    plain: bool,
    last_line: Instant,
}

impl Progress {
    /// Starts at nothing done.
    pub fn new(name: &'static str) -> Self {
        let plain = !std::io::stderr().is_terminal();
        let bar = if plain { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
        bar.set_prefix(name);
        if let Ok(style) = ProgressStyle::with_template(BAR) {
            bar.set_style(style);
        }
        Self { bar, name, plain, last_line: Instant::now() }
    }

    /// `done` steps are done, of `total` where that is known.
    pub fn set(&mut self, done: u64, total: Option<u64>) {
        if let Some(total) = total {
            self.bar.set_length(total);
        }
        self.bar.set_position(done);
        if self.plain && self.last_line.elapsed() >= LINE_EVERY {
            let of = total.map(|total| format!("/{total}")).unwrap_or_default();
            eprintln!("{} {done}{of}", self.name);
            self.last_line = Instant::now();
        }
    }

    /// All is done.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
