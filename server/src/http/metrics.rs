//! Counts and rates of all sessions in the Prometheus text format, read from the sessions at each scrape.

use std::fmt;
use std::sync::{Arc, Weak};

use axum::Extension;
use axum::extract::State;
use axum::http::header;
use axum::response::IntoResponse;
use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric, text};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::registry::{Registry as Metricals, Unit};
use protocol::v1::SessionState;

use super::App;
use super::access::{Caller, Scope};
use super::error::internal;
use crate::session::intake::Rejection;
use crate::session::registry::Registry;

const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// What is scraped.
pub(super) struct Metrics(Metricals);

impl Metrics {
    /// Of all sessions, as they open and close.
    pub fn of(sessions: &Arc<Registry>) -> Self {
        let mut metrics = Metricals::with_prefix("mis_slam");
        metrics.register_collector(Box::new(Sessions(Arc::downgrade(sessions))));
        Self(metrics)
    }
}

/// Counts and rates for Prometheus.
pub(super) async fn render(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
) -> Result<impl IntoResponse, Rejection> {
    caller.require(Scope::View)?;
    let mut rendered = String::new();
    text::encode(&mut rendered, &app.metrics.0).map_err(internal)?;
    Ok(([(header::CONTENT_TYPE, CONTENT_TYPE)], rendered))
}

struct Sessions(Weak<Registry>);

impl fmt::Debug for Sessions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Sessions")
    }
}

/// A figure of each session.
type Figure = fn(&SessionState) -> f64;

const COUNTERS: [(&str, &str, Figure); 4] = [
    ("pairs_received", "Stereo pairs that came", |state| state.pairs_received as f64),
    ("poses_published", "Poses published", |state| state.poses_published as f64),
    ("frames_fused", "Pairs fused into the model", |state| state.frames_fused as f64),
    ("epochs", "Epochs of the model lane", |state| f64::from(state.epoch)),
];

const GAUGES: [(&str, &str, Figure); 7] = [
    ("surfels", "Surfels of the published model", |state| f64::from(state.surfels)),
    ("viewers", "Viewers that follow the model", |state| f64::from(state.viewers)),
    ("status", "1 waiting, 2 live, 3 degraded, 4 source lost, 5 closed, 6 recovering", |state| {
        f64::from(state.status)
    }),
    ("tracking", "1 not initialized, 2 tracked, 3 recovered, 4 lost", |state| f64::from(state.tracking)),
    ("model_stale", "1 while the model does not follow the poses", |state| f64::from(state.model_stale)),
    ("recording", "1 while the session is recorded", |state| f64::from(state.recording)),
    ("alarms", "Alarms raised", |state| state.alarms.len() as f64),
];

const AGES: [(&str, &str, Figure); 3] = [
    ("pair_age", "Time since the newest pair", |state| seconds(state.pair_age_ms)),
    ("pose_age", "Age of the newest pose", |state| seconds(state.pose_age_ms)),
    ("model_age", "Age of the published model", |state| seconds(state.model_age_ms)),
];

/// Not a number where nothing is known, as Prometheus has it.
fn seconds(age_ms: Option<f32>) -> f64 {
    age_ms.map_or(f64::NAN, |ms| f64::from(ms) * 1e-3)
}

impl Collector for Sessions {
    fn encode(&self, mut encoder: DescriptorEncoder) -> Result<(), fmt::Error> {
        let Some(registry) = self.0.upgrade() else { return Ok(()) };
        let states: Vec<SessionState> =
            registry.list().iter().map(|session| session.hub().snapshot_state()).collect();
        let open = ConstGauge::new(states.len() as i64);
        open.encode(encoder.encode_descriptor("sessions", "Open sessions", None, MetricType::Gauge)?)?;
        for (name, help, figure) in COUNTERS {
            let mut family = encoder.encode_descriptor(name, help, None, MetricType::Counter)?;
            for state in &states {
                let labels = [("session", state.session.as_str())];
                ConstCounter::new(figure(state)).encode(family.encode_family(&labels)?)?;
            }
        }
        let gauges = GAUGES.iter().map(|gauge| (gauge, None));
        let ages = AGES.iter().map(|age| (age, Some(Unit::Seconds)));
        for ((name, help, figure), unit) in gauges.chain(ages) {
            let mut family = encoder.encode_descriptor(name, help, unit.as_ref(), MetricType::Gauge)?;
            for state in &states {
                let labels = [("session", state.session.as_str())];
                ConstGauge::new(figure(state)).encode(family.encode_family(&labels)?)?;
            }
        }
        encode_drops(&mut encoder, &states)
    }
}

fn encode_drops(encoder: &mut DescriptorEncoder, states: &[SessionState]) -> Result<(), fmt::Error> {
    let help = "Pairs refused, dropped or not fused, by reason";
    let mut family = encoder.encode_descriptor("drops", help, None, MetricType::Counter)?;
    for state in states {
        for drop in &state.drops {
            let reason = drop.reason().name();
            let labels = [("session", state.session.as_str()), ("reason", reason.as_str())];
            ConstCounter::new(drop.count).encode(family.encode_family(&labels)?)?;
        }
    }
    Ok(())
}
