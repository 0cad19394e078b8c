//! Session ids: opaque, never personal data, safe in paths and zenoh keys.

use std::fmt;
use std::str::FromStr;

use crate::ProtocolError;
use crate::limits::MAX_SESSION_ID_CHARS;

/// A valid session id: 1 to 64 characters of `A-Z a-z 0-9 _ -`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SessionId(String);

impl SessionId {
    /// The id as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for SessionId {
    type Err = ProtocolError;

    /// # Errors
    /// [`ProtocolError::SessionId`] with the start of what was given.
    fn from_str(given: &str) -> Result<Self, ProtocolError> {
        let length_ok = (1..=MAX_SESSION_ID_CHARS).contains(&given.len());
        let allowed = |c: u8| c.is_ascii_alphanumeric() || c == b'_' || c == b'-';
        if length_ok && given.bytes().all(allowed) {
            Ok(Self(given.to_owned()))
        } else {
            Err(ProtocolError::SessionId { given: given.chars().take(MAX_SESSION_ID_CHARS).collect() })
        }
    }
}

impl fmt::Display for SessionId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_of_every_allowed_character_are_accepted() {
        for id in ["a", "A-Z_09", &"x".repeat(64)] {
            assert_eq!(id.parse::<SessionId>().unwrap().as_str(), id);
        }
    }

    #[test]
    fn ids_that_could_escape_a_path_or_a_key_are_refused() {
        for id in ["", "a/b", "..", "*", "**", "a b", "@x", "ä", "a\n", &"x".repeat(65)] {
            assert!(id.parse::<SessionId>().is_err(), "{id:?}");
        }
    }

    #[test]
    fn a_refusal_does_not_echo_megabytes() {
        let refusal = "/".repeat(1 << 20).parse::<SessionId>().unwrap_err();
        assert!(refusal.to_string().len() < 200);
    }
}
