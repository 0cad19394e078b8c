//! zenoh keys: `mis-slam/<session>/<lane>`.
//!
//! Every payload is an envelope: [`ToServer`](crate::v1::ToServer) below `ingest/` and in queries,
//! [`FromServer`](crate::v1::FromServer) elsewhere.

use crate::{ProtocolError, SessionId};

/// First chunk of every key.
pub const ROOT: &str = "mis-slam";

/// What a server subscribes to: stereo pairs and calibrations of all sessions.
pub const ALL_INGEST: &str = "mis-slam/*/ingest/**";
/// Queries with a calibration or a hello, of all sessions.
pub const ALL_CALIBRATION: &str = "mis-slam/*/ingest/calibration";
/// Queries with a hello, of all sessions.
pub const ALL_CONTROL: &str = "mis-slam/*/control";
/// Queries for the whole model, of all sessions.
pub const ALL_SNAPSHOTS: &str = "mis-slam/*/model/snapshot";
/// Liveliness tokens of the carts of all sessions.
pub const ALL_SOURCES: &str = "mis-slam/*/alive/source/*";

/// A lane below a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// Stereo pairs, put by the cart.
    IngestStereo,
    /// Calibration: put, or a query that is answered by hello or refusal.
    IngestCalibration,
    /// Newest pose.
    Pose,
    /// Ordered model epochs.
    ModelEpoch,
    /// The whole model: a query, answered chunk by chunk.
    ModelSnapshot,
    /// Session state.
    State,
    /// Newest left image.
    Preview,
    /// Notes on the tissue and the model's place in the room.
    Shared,
    /// Query with a hello; also the farewell of the server.
    Control,
}

impl Lane {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::IngestStereo,
        Self::IngestCalibration,
        Self::Pose,
        Self::ModelEpoch,
        Self::ModelSnapshot,
        Self::State,
        Self::Preview,
        Self::Shared,
        Self::Control,
    ];

    /// The part of the key behind the session.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::IngestStereo => "ingest/stereo",
            Self::IngestCalibration => "ingest/calibration",
            Self::Pose => "pose",
            Self::ModelEpoch => "model/epoch",
            Self::ModelSnapshot => "model/snapshot",
            Self::State => "state",
            Self::Preview => "preview",
            Self::Shared => "shared",
            Self::Control => "control",
        }
    }

    /// The whole key.
    pub fn key(self, session: &SessionId) -> String {
        format!("{ROOT}/{session}/{}", self.suffix())
    }
}

/// Session and lane of a key; no lane where the key is of the session but not one that this version knows.
///
/// # Errors
/// [`ProtocolError::SessionId`] where the second chunk is no session id or the first is not [`ROOT`].
pub fn parse(key: &str) -> Result<(SessionId, Option<Lane>), ProtocolError> {
    let (session, suffix) = split(key)?;
    Ok((session, Lane::ALL.into_iter().find(|lane| lane.suffix() == suffix)))
}

/// Key of a cart's liveliness token.
pub fn source_token(session: &SessionId, source: &SessionId) -> String {
    format!("{ROOT}/{session}/alive/source/{source}")
}

/// Key of a server's liveliness token for a session that it holds.
pub fn server_token(session: &SessionId) -> String {
    format!("{ROOT}/{session}/alive/server")
}

/// Key on which a cart hears refusals of what it put.
pub fn reply(session: &SessionId, source: &SessionId) -> String {
    format!("{ROOT}/{session}/reply/{source}")
}

/// Session and cart of a liveliness token's key.
///
/// # Errors
/// [`ProtocolError::SessionId`] where the key is not of [`source_token`]'s form.
pub fn parse_source_token(key: &str) -> Result<(SessionId, SessionId), ProtocolError> {
    let (session, suffix) = split(key)?;
    let source = suffix.strip_prefix("alive/source/").unwrap_or_default();
    Ok((session, source.parse()?))
}

fn split(key: &str) -> Result<(SessionId, &str), ProtocolError> {
    let below_root = key.strip_prefix(ROOT).and_then(|rest| rest.strip_prefix('/')).unwrap_or_default();
    let (session, suffix) = below_root.split_once('/').unwrap_or((below_root, ""));
    Ok((session.parse()?, suffix))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lane_survives_the_way_through_its_key() {
        let session: SessionId = "or-3".parse().unwrap();
        for lane in Lane::ALL {
            assert_eq!(parse(&lane.key(&session)), Ok((session.clone(), Some(lane))));
        }
    }

    #[test]
    fn unknown_lanes_of_a_session_are_told_apart_from_foreign_keys() {
        assert_eq!(parse("mis-slam/a/ingest/audio").unwrap().1, None);
        assert!(parse("other/a/pose").is_err());
        assert!(parse("mis-slam").is_err());
        assert!(parse("mis-slam//pose").is_err());
    }

    #[test]
    fn a_liveliness_token_names_session_and_cart() {
        let (session, cart) = ("s".parse().unwrap(), "c".parse().unwrap());
        assert_eq!(parse_source_token(&source_token(&session, &cart)), Ok((session, cart)));
        assert!(parse_source_token("mis-slam/s/alive/server").is_err());
    }
}
