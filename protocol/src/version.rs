//! Version negotiation: the highest version that both sides speak.

use crate::ProtocolError;
use crate::limits::{NEWEST_VERSION, OLDEST_VERSION};
use crate::v1::Hello;

/// The greeting of this side.
pub fn hello(software: &str) -> Hello {
    Hello {
        oldest_version: OLDEST_VERSION,
        newest_version: NEWEST_VERSION,
        software: software.to_owned(),
        takeover_token: String::new(),
    }
}

/// The version to speak with a peer.
///
/// # Errors
/// [`ProtocolError::NoCommonVersion`].
pub fn negotiate(peer: &Hello) -> Result<u32, ProtocolError> {
    let common = peer.newest_version.min(NEWEST_VERSION);
    if common >= peer.oldest_version.max(OLDEST_VERSION) {
        Ok(common)
    } else {
        Err(ProtocolError::NoCommonVersion {
            peer_oldest: peer.oldest_version,
            peer_newest: peer.newest_version,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peer(oldest_version: u32, newest_version: u32) -> Hello {
        Hello { oldest_version, newest_version, ..Hello::default() }
    }

    #[test]
    fn the_highest_common_version_is_spoken() {
        assert_eq!(negotiate(&peer(1, 1)), Ok(1));
        assert_eq!(negotiate(&peer(1, 7)), Ok(NEWEST_VERSION));
    }

    #[test]
    fn a_peer_from_the_future_the_past_or_nowhere_is_refused() {
        for (oldest, newest) in [(NEWEST_VERSION + 1, NEWEST_VERSION + 1), (0, 0), (1, 0)] {
            let refusal = negotiate(&peer(oldest, newest)).unwrap_err();
            assert_eq!(refusal, ProtocolError::NoCommonVersion { peer_oldest: oldest, peer_newest: newest });
        }
    }
}
