//! Pictures of a model from any pose, of sessions that are open and of those that have ended.

use std::ops::RangeInclusive;
use std::time::Duration;

use axum::Extension;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Path, Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use geometry::Rgb;
use geometry::viewpoint::{self, OVERVIEW_HALF_OPENING_TANGENT};
use protocol::limits;
use protocol::v1::Reason;
use schemars::JsonSchema;
use serde::Deserialize;

use super::App;
use super::access::{Caller, Scope};
use super::api::session;
use super::error::{internal, off_runtime};
use super::finished::model_file;
use crate::picture::{Answered, PictureError, PictureWanted, Viewpoint};
use crate::session::intake::Rejection;

/// Columns and rows where none are asked for.
const DEFAULT_SIZE_PX: (u32, u32) = (640, 480);
/// A session that draws nothing for so long is being rebuilt, or works on something larger than a frame.
const PATIENCE: Duration = Duration::from_secs(20);

/// Why there is no picture, besides the caller's token.
pub(super) const REFUSALS: &[StatusCode] =
    &[StatusCode::BAD_REQUEST, StatusCode::NOT_FOUND, StatusCode::SERVICE_UNAVAILABLE];

/// What is to be seen; see protocol/SPEC.md.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "some fields are allowed and say nothing to this handler")]
pub(super) struct PictureQuery {
    /// Columns, 640 where left out.
    width: Option<u32>,
    /// Rows, 480 where left out.
    height: Option<u32>,
    /// Where it is taken from, where no pose says so: `overview` or `scope`.
    from: Option<Standpoint>,
    /// Where the camera is, `x,y,z`, metres in the world.
    eye: Option<String>,
    /// What is in the middle, `x,y,z`.
    target: Option<String>,
    /// `tx,ty,tz,qx,qy,qz,qw`: `world_from_camera`.
    pose: Option<String>,
    /// With `eye` or `pose`: the angle by which the shorter side opens.
    opening_deg: Option<f64>,
    /// How surfels are coloured.
    coloring: Option<Coloring>,
    /// Changes nothing; with the epoch that is shown in it, an address stands for one picture and not for its successors.
    epoch: Option<u32>,
    /// As for every request.
    access_token: Option<String>,
}

/// Viewpoints with a name.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum Standpoint {
    Overview,
    Scope,
}

/// The colourings by their names, which are those of the page.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum Coloring {
    Colour,
    Shape,
    Normal,
    Confidence,
}

impl From<Coloring> for dense::Coloring {
    fn from(coloring: Coloring) -> Self {
        match coloring {
            Coloring::Colour => Self::Colour,
            Coloring::Shape => Self::Shape,
            Coloring::Normal => Self::Normal,
            Coloring::Confidence => Self::Confidence,
        }
    }
}

impl From<PictureError> for Rejection {
    fn from(error: PictureError) -> Self {
        let reason = match error {
            PictureError::Gpu(_) => Reason::Internal,
            PictureError::TooMany { .. } | PictureError::NoModel | PictureError::NoScope => {
                Reason::PictureUnavailable
            }
        };
        Self::new(reason, error.to_string())
    }
}

/// A picture of an open session's model.
pub(super) async fn of_session(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
    query: Result<Query<PictureQuery>, QueryRejection>,
) -> Result<Response, Rejection> {
    let session = session(&app, &caller, Scope::View, &id)?;
    let wanted = wanted(query)?;
    let picture = answered_in_time(session.pictures()?.ask(wanted)?).await?;
    off_runtime(move || png(&picture)).await?
}

/// What whoever holds the model answers.
pub(super) async fn answered_in_time<T>(answered: Answered<T>) -> Result<T, PictureError> {
    let answer = tokio::time::timeout(PATIENCE, answered).await;
    // Given up, or the reconstruction ended with the request still in the queue.
    answer.ok().and_then(Result::ok).ok_or(PictureError::NoModel)?
}

/// A picture of the model that a session left behind.
pub(super) async fn of_finished(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(run): Path<String>,
    query: Result<Query<PictureQuery>, QueryRejection>,
) -> Result<Response, Rejection> {
    let path = model_file(&app, &caller, &run)?;
    let wanted = wanted(query)?;
    if wanted.viewpoint == Viewpoint::Scope {
        return Err(unusable("from: a finished session has no scope; give a pose"));
    }
    // A model takes memory while it is drawn: one at a time.
    let _turn = app.stored_pictures.acquire().await.map_err(internal)?;
    off_runtime(move || {
        let model = recording::export::read_ply(&path).map_err(internal)?;
        png(&app.registry.engine().draw(&model, &wanted)?)
    })
    .await?
}

fn png(picture: &Rgb) -> Result<Response, Rejection> {
    let image = recording::encode_png_rgb(picture).map_err(internal)?;
    let headers = [(header::CONTENT_TYPE, "image/png"), (header::CACHE_CONTROL, "no-store")];
    Ok((headers, image.bytes).into_response())
}

fn unusable(text: impl Into<String>) -> Rejection {
    Rejection::new(Reason::MalformedMessage, text)
}

fn wanted(query: Result<Query<PictureQuery>, QueryRejection>) -> Result<PictureWanted, Rejection> {
    let Query(query) = query.map_err(|error| unusable(error.body_text()))?;
    let within = |name: &str, side_px: u32, range: RangeInclusive<u32>| {
        let text = || format!("{name} {side_px} is not between {} and {}", range.start(), range.end());
        if range.contains(&side_px) { Ok(side_px) } else { Err(unusable(text())) }
    };
    let size_px = (
        within("width", query.width.unwrap_or(DEFAULT_SIZE_PX.0), limits::PICTURE_SIDES_PX)?,
        within("height", query.height.unwrap_or(DEFAULT_SIZE_PX.1), limits::PICTURE_SIDES_PX)?,
    );
    let coloring = query.coloring.unwrap_or(Coloring::Colour).into();
    Ok(PictureWanted { size_px, viewpoint: viewpoint_of(&query)?, coloring })
}

fn viewpoint_of(query: &PictureQuery) -> Result<Viewpoint, Rejection> {
    let point = |name: &str, text: &str| {
        viewpoint::point_from_text(text).map_err(|problem| unusable(format!("{name}: {problem}")))
    };
    let world_from_camera = match (&query.pose, &query.eye, &query.target) {
        (None, None, None) => {
            return match (query.from, query.opening_deg) {
                (_, Some(_)) => Err(unusable("opening_deg goes with eye or pose")),
                (Some(Standpoint::Scope), None) => Ok(Viewpoint::Scope),
                (Some(Standpoint::Overview) | None, None) => Ok(Viewpoint::Overview),
            };
        }
        _ if query.from.is_some() => Err(unusable("from goes without eye, target and pose")),
        (Some(pose), None, None) => {
            viewpoint::pose_from_text(pose).map_err(|problem| unusable(format!("pose: {problem}")))
        }
        (None, Some(eye), Some(target)) => {
            viewpoint::looking_at(&point("eye", eye)?, &point("target", target)?)
                .ok_or_else(|| unusable("eye and target are one point"))
        }
        _ => Err(unusable("a pose is either eye and target, or pose")),
    }?;
    let half_opening_tangent = query.opening_deg.map_or(Ok(OVERVIEW_HALF_OPENING_TANGENT), half_tangent)?;
    Ok(Viewpoint::Pose { world_from_camera, half_opening_tangent })
}

fn half_tangent(opening_deg: f64) -> Result<f64, Rejection> {
    let range = limits::PICTURE_OPENINGS_DEG;
    if range.contains(&opening_deg) {
        return Ok((opening_deg.to_radians() / 2.0).tan());
    }
    Err(unusable(format!("opening_deg {opening_deg} is not between {} and {}", range.start(), range.end())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(query: PictureQuery) -> Result<PictureWanted, String> {
        wanted(Ok(Query(query))).map_err(|rejection| rejection.text)
    }

    fn some(text: &str) -> Option<String> {
        Some(text.into())
    }

    #[test]
    fn nothing_asked_for_is_an_overview() {
        let found = of(PictureQuery::default()).unwrap();
        assert_eq!((found.size_px, found.viewpoint), ((640, 480), Viewpoint::Overview));
    }

    #[test]
    fn a_pose_is_given_by_two_points_or_by_itself() {
        let looked = PictureQuery { eye: some("0,0,-0.1"), target: some("0,0,0"), ..Default::default() };
        let posed = PictureQuery { pose: some("0,0,-0.1,0,0,0,1"), ..Default::default() };
        assert_eq!(of(looked).unwrap().viewpoint, of(posed).unwrap().viewpoint);
    }

    #[test]
    fn what_cannot_be_drawn_is_named() {
        let huge = PictureQuery { width: Some(2049), ..Default::default() };
        let flat = PictureQuery { height: Some(0), ..Default::default() };
        let nan = PictureQuery { eye: some("0,NaN,0"), target: some("0,0,0"), ..Default::default() };
        let half = PictureQuery { eye: some("0,0,0"), ..Default::default() };
        let same = PictureQuery { eye: some("0,0,0"), target: some("0,0,0"), ..Default::default() };
        let long = PictureQuery { pose: some("0,0,0,0,0,0,2"), ..Default::default() };
        let wide =
            PictureQuery { pose: some("0,0,0,0,0,0,1"), opening_deg: Some(f64::NAN), ..Default::default() };
        let both =
            PictureQuery { from: Some(Standpoint::Scope), pose: some("0,0,0,0,0,0,1"), ..Default::default() };
        let cases = [
            (huge, "width"),
            (flat, "height"),
            (nan, "eye"),
            (half, "either"),
            (same, "one point"),
            (long, "pose"),
            (wide, "opening_deg"),
            (both, "from"),
        ];
        for (query, named) in cases {
            let text = of(query).unwrap_err();
            assert!(text.contains(named), "{text}");
        }
    }
}
