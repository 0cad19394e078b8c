//! From spans and events to records.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;

use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::{LookupSpan, SpanRef};

use super::file::{Done, TraceFile, Track};

/// The spans that a trace shows: those of our stages.
pub fn stages() -> Targets {
    ["mis_slam", "dense", "tracking", gpu::PASSES]
        .into_iter()
        .fold(Targets::new(), |all, target| all.with_target(target, Level::TRACE))
}

/// Writes spans and passes as they end.
pub struct TraceLayer {
    file: Arc<TraceFile>,
    epoch: Instant,
    threads: AtomicU32,
}

/// What is known of an open span.
#[derive(Clone, Copy, Default)]
struct Open {
    frame: Option<u64>,
    entered_ns: u64,
}

thread_local! {
    static TRACK: std::cell::Cell<Option<Track>> = const { std::cell::Cell::new(None) };
}

impl TraceLayer {
    /// A layer that writes to `file`.
    pub fn new(file: Arc<TraceFile>) -> Self {
        Self { file, epoch: gpu::trace_epoch(), threads: AtomicU32::new(1) }
    }

    fn now_ns(&self) -> u64 {
        u64::try_from(self.epoch.elapsed().as_nanos()).unwrap_or(u64::MAX)
    }

    /// The thread's track, named when it is first seen.
    fn track(&self) -> Track {
        TRACK.get().unwrap_or_else(|| {
            let track = Track::thread(self.threads.fetch_add(1, Ordering::Relaxed));
            self.file.name_thread(track, std::thread::current().name().unwrap_or("thread"));
            TRACK.set(Some(track));
            track
        })
    }
}

fn frame_of<'a, S: LookupSpan<'a>>(span: &SpanRef<'a, S>) -> Option<u64> {
    span.extensions().get::<Open>().and_then(|open| open.frame)
}

impl<S: Subscriber + for<'a> LookupSpan<'a>> Layer<S> for TraceLayer {
    /// A span is about the frame that it names, or else the one around it does.
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, context: Context<'_, S>) {
        let Some(span) = context.span(id) else { return };
        let mut named = FrameField::default();
        attributes.record(&mut named);
        let frame = named.0.or_else(|| span.parent().and_then(|around| frame_of(&around)));
        span.extensions_mut().insert(Open { frame, entered_ns: 0 });
    }

    fn on_enter(&self, id: &Id, context: Context<'_, S>) {
        let Some(span) = context.span(id) else { return };
        if let Some(open) = span.extensions_mut().get_mut::<Open>() {
            open.entered_ns = self.now_ns();
        }
    }

    fn on_exit(&self, id: &Id, context: Context<'_, S>) {
        let end_ns = self.now_ns();
        let Some(span) = context.span(id) else { return };
        let Some(open) = span.extensions().get::<Open>().copied() else { return };
        let (name, track, frame) = (span.name(), self.track(), open.frame);
        self.file.add(&Done { name, track, begin_ns: open.entered_ns, end_ns, frame });
    }

    fn on_event(&self, event: &Event<'_>, context: Context<'_, S>) {
        if event.metadata().target() != gpu::PASSES {
            return;
        }
        let mut pass = PassFields::default();
        event.record(&mut pass);
        let frame = context.event_span(event).and_then(|around| frame_of(&around));
        let PassFields { name, begin_ns, end_ns } = pass;
        self.file.add(&Done { name: &name, track: Track::GPU, begin_ns, end_ns, frame });
    }
}

#[derive(Default)]
struct FrameField(Option<u64>);

impl Visit for FrameField {
    fn record_u64(&mut self, field: &Field, value: u64) {
        if field.name() == "frame" {
            self.0 = Some(value);
        }
    }

    fn record_debug(&mut self, _: &Field, _: &dyn std::fmt::Debug) {}
}

/// As [`gpu::PASSES`] documents them.
#[derive(Default)]
struct PassFields {
    name: String,
    begin_ns: u64,
    end_ns: u64,
}

impl Visit for PassFields {
    fn record_u64(&mut self, field: &Field, value: u64) {
        match field.name() {
            "begin_ns" => self.begin_ns = value,
            "end_ns" => self.end_ns = value,
            _ => {}
        }
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        if field.name() == "pass" {
            value.clone_into(&mut self.name);
        }
    }

    fn record_debug(&mut self, _: &Field, _: &dyn std::fmt::Debug) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;
    use tracing_subscriber::layer::SubscriberExt;

    fn traced(work: impl FnOnce()) -> Vec<Value> {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("trace.json");
        let file = Arc::new(TraceFile::create(&path).unwrap());
        let layer = TraceLayer::new(Arc::clone(&file)).with_filter(stages());
        tracing::subscriber::with_default(tracing_subscriber::registry().with(layer), work);
        file.finish().unwrap();
        serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
    }

    fn record<'a>(records: &'a [Value], name: &str) -> &'a Value {
        records
            .iter()
            .find(|record| record["name"] == name)
            .unwrap_or_else(|| panic!("no {name}: {records:?}"))
    }

    #[test]
    fn spans_nest_and_carry_the_frame_of_the_one_around_them() {
        let records = traced(|| {
            let _frame = tracing::trace_span!("outer", frame = 7u64).entered();
            let _stage = tracing::trace_span!("inner").entered();
        });
        let (outer, inner) = (record(&records, "outer"), record(&records, "inner"));
        assert_eq!((&outer["args"]["frame"], &inner["args"]["frame"]), (&7.into(), &7.into()));
        assert_eq!((&outer["pid"], &outer["tid"]), (&inner["pid"], &inner["tid"]));
        let ends = |of: &Value| {
            let begin = of["ts"].as_f64().unwrap();
            (begin, begin + of["dur"].as_f64().unwrap())
        };
        let ((outer_begin, outer_end), (inner_begin, inner_end)) = (ends(outer), ends(inner));
        assert!(outer_begin <= inner_begin && inner_end <= outer_end + 1e-3);
    }

    #[test]
    fn a_pass_is_on_the_track_of_the_gpu_at_its_own_time() {
        let records = traced(|| {
            let _frame = tracing::trace_span!("fuse", frame = 3u64).entered();
            tracing::trace!(target: gpu::PASSES, pass = "census", begin_ns = 2_000u64, end_ns = 5_500u64);
        });
        let pass = record(&records, "census");
        assert_eq!(
            pass,
            &serde_json::json!({
                "ph": "X", "name": "census", "pid": 2, "tid": 1, "ts": 2.0, "dur": 3.5, "args": {"frame": 3}
            })
        );
    }

    #[test]
    fn what_others_log_is_left_out() {
        let records =
            traced(|| tracing::trace_span!(target: "zenoh", "theirs").in_scope(|| tracing::info!("hello")));
        assert!(records.iter().all(|record| record["ph"] == "M"), "{records:?}");
    }
}
