//! The table, and the same as JSON.

use std::path::Path;

use serde_json::{Value, json};

use crate::clock::quantile;
use crate::error::StreamError;
use crate::late_join::Joined;
use crate::many_viewers::Outcome;
use crate::selection::Run;

/// Rows of the table, and all numbers.
#[derive(Default)]
pub struct Figures {
    rows: Vec<Row>,
    numbers: serde_json::Map<String, Value>,
}

struct Row {
    name: &'static str,
    bound: String,
    found: String,
    kept: bool,
}

impl Figures {
    fn row(&mut self, name: &'static str, bound: impl Into<String>, found: impl Into<String>, kept: bool) {
        self.rows.push(Row { name, bound: bound.into(), found: found.into(), kept });
    }

    fn number(&mut self, name: &str, value: impl Into<Value>) {
        self.numbers.insert(name.to_owned(), value.into());
    }

    /// The GPU's part.
    pub fn selection(&mut self, run: &Run) {
        let of = |value: fn(&crate::selection::Frame) -> f64| {
            let mut values: Vec<f64> = run.frames.iter().skip(1).map(value).collect();
            quantile(&mut values, 0.5)
        };
        self.number("adapter", run.adapter.clone());
        self.number("surfels", run.surfels);
        self.number("nodes", run.nodes);
        self.number("selection_ms", of(|frame| frame.selection_ms));
        self.number("selection_passes_ms", of(|frame| frame.passes_ms));
        self.number("selection_driving_cpu_ms", of(|frame| frame.driving_cpu_ms));
        self.number("sent_anew_per_frame", of(|frame| frame.update.changed.len() as f64));
        println!(
            "{}: {} surfels, {} nodes; selection {:.1} ms a frame, {:.0} surfels sent anew",
            run.adapter,
            run.surfels,
            run.nodes,
            of(|frame| frame.selection_ms),
            of(|frame| frame.update.changed.len() as f64),
        );
    }

    /// Without a slow viewer.
    pub fn viewers(&mut self, run: &Run, outcome: &Outcome) {
        let mut bytes: Vec<f64> = outcome.sent.iter().map(|sent| sent.bytes as f64).collect();
        let mean_kb = bytes.iter().sum::<f64>() / bytes.len().max(1) as f64 / 1e3;
        let p95_kb = quantile(&mut bytes, 0.95) / 1e3;
        self.row(
            "bytes per frame",
            "<= 60 kB",
            format!("{mean_kb:.1} kB (p95 {p95_kb:.1})"),
            mean_kb <= 60.0,
        );
        let mut errors = outcome.errors_mm.clone();
        let (p99, worst) = (quantile(&mut errors, 0.99), quantile(&mut errors, 1.0));
        let bound = format!("p99 <= {} mm", run.bound_mm);
        self.row(
            "position error at the viewer",
            bound,
            format!("p99 {p99:.3} mm, worst {worst:.3}"),
            p99 <= run.bound_mm,
        );
        let mut cpu: Vec<f64> = outcome.sent.iter().map(|sent| sent.cpu.as_secs_f64() * 1e3).collect();
        let cpu_ms = quantile(&mut cpu, 0.5);
        self.row("producer CPU per frame", "<= 2 ms", format!("{cpu_ms:.2} ms"), cpu_ms <= 2.0);
        let epoch_ms = quantile(&mut outcome.epoch_latency_ms.clone(), 0.95);
        self.row(
            "published -> at the viewer",
            "p95 <= 100 ms",
            format!("p95 {epoch_ms:.1} ms"),
            epoch_ms <= 100.0,
        );
        let pose_ms = quantile(&mut outcome.pose_latency_ms.clone(), 0.95);
        self.row("pose lane", "p95 <= 20 ms", format!("p95 {pose_ms:.1} ms"), pose_ms <= 20.0);
        for (name, value) in [
            ("bytes_per_frame", mean_kb * 1e3),
            ("bytes_per_frame_p95", p95_kb * 1e3),
            ("error_p99_mm", p99),
            ("error_worst_mm", worst),
            ("producer_cpu_ms", cpu_ms),
            ("epoch_latency_p95_ms", epoch_ms),
            ("pose_latency_p95_ms", pose_ms),
        ] {
            self.number(name, value);
        }
    }

    /// With one.
    pub fn slow(&mut self, alone: &Outcome, beside: &Outcome) {
        let p99 = |outcome: &Outcome| quantile(&mut outcome.epoch_latency_ms.clone(), 0.99);
        let (before_ms, with_ms) = (p99(alone), p99(beside));
        let moved = 100.0 * (with_ms / before_ms - 1.0);
        let found = format!("{before_ms:.1} -> {with_ms:.1} ms ({moved:+.0} %)");
        self.row("others' p99 beside a slow viewer", "moves < 5 %", found, moved < 5.0);
        self.number("others_p99_ms", json!([before_ms, with_ms]));
        let Some(slow) = &beside.slow else { return };
        let mut errors = slow.errors_mm.clone();
        let worst = quantile(&mut errors, 1.0);
        let found = format!("{} seeds, {} surfels, worst {worst:.3} mm", slow.seeds, slow.surfels);
        self.row("slow viewer after its seed", "error bounded", found, slow.seeds > 0 && worst <= 0.2);
        let age_s = quantile(&mut slow.ages_s.clone(), 0.5);
        let backlog_mib = slow.backlog_bytes as f64 / f64::from(1 << 20);
        let found = format!("{backlog_mib:.2} MiB, median age {age_s:.1} s");
        self.row("memory for it", "<= 8 MiB", found, backlog_mib <= 8.0);
        self.number("slow_error_worst_mm", worst);
        self.number("slow_seeds", slow.seeds);
        self.number("slow_bytes", slow.bytes);
        self.number("slow_median_age_s", age_s);
        self.number("slow_backlog_bytes", slow.backlog_bytes);
    }

    /// A late joiner.
    pub fn late_join(&mut self, joined: &Joined) {
        let (first_s, complete_s) = (joined.first_chunk.as_secs_f64(), joined.complete.as_secs_f64());
        let megabytes = joined.bytes as f64 / 1e6;
        let found = format!(
            "{complete_s:.2} s ({megabytes:.2} MB, first {:.0} ms), {} surfels, digest {}",
            first_s * 1e3,
            joined.surfels,
            if joined.digest_is_equal { "equal" } else { "DIFFERS" },
        );
        let kept = complete_s <= 1.0 && joined.digest_is_equal;
        self.row("late join at 50 Mbit/s", "<= 1 s, digest equal", found, kept);
        let worst = quantile(&mut joined.errors_mm.clone(), 1.0);
        self.row("late joiner's error", "<= 0.2 mm", format!("worst {worst:.3} mm"), worst <= 0.2);
        self.number("late_join_s", complete_s);
        self.number("late_join_bytes", joined.bytes);
        self.number("late_join_error_worst_mm", worst);
    }

    /// The table.
    pub fn print(&self) {
        println!("\n| figure | bound | found | |\n|---|---|---|---|");
        for row in &self.rows {
            let verdict = if row.kept { "kept" } else { "MISSED" };
            println!("| {} | {} | {} | {verdict} |", row.name, row.bound, row.found);
        }
    }

    /// All numbers.
    pub fn write(&self, path: &Path) -> Result<(), StreamError> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        Ok(std::fs::write(path, serde_json::to_vec_pretty(&self.numbers)?)?)
    }
}
