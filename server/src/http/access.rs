//! Who may do what, where the server wants tokens: JSON Web Tokens in requests, watched as long as a stream is open.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use axum::extract::{Request, State};
use axum::http::header;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use hmac::{Hmac, Mac};
use jwt::{SignWithKey, VerifyWithKey};
use protocol::SessionId;
use protocol::v1::Reason;
use serde::{Deserialize, Serialize};
use sha2::Sha256;

use super::App;
use crate::random;
use crate::session::intake::Rejection;

/// A key that can be guessed protects nothing.
const KEY_MIN_BYTES: usize = 32;
/// How often an open stream's token is looked at again.
const WATCH_INTERVAL: Duration = Duration::from_secs(1);

/// Section `[access]` of the configuration.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AccessConfig {
    /// Whether requests need a token.
    pub required: bool,
    /// File with the secret that tokens are signed with.
    pub key_file: PathBuf,
    /// File with the ids of revoked tokens; empty for none.
    pub revoked_file: PathBuf,
}

/// Why tokens cannot be checked.
#[derive(Debug, thiserror::Error)]
pub enum AccessError {
    /// The key cannot be read.
    #[error("access.key_file {}: {source}", .path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The key is too short.
    #[error("access.key_file {}: {bytes} bytes are too few, {KEY_MIN_BYTES} are needed", .path.display())]
    ShortKey {
        /// The file.
        path: PathBuf,
        /// Its length.
        bytes: usize,
    },
    /// A token cannot be signed.
    #[error("the token cannot be signed: {0}")]
    Unsigned(String),
    /// zenoh would be a way around the tokens.
    #[error("access.required needs zenoh.enabled=false: zenoh peers show no tokens")]
    Zenoh,
}

/// What a token may be for; each may also do what those before it may.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Scope {
    /// Look at sessions and results.
    View,
    /// Open sessions and feed them.
    Feed,
    /// Everything, recordings and closing included.
    Manage,
}

impl Scope {
    fn of_name(name: &str) -> Option<Self> {
        match name {
            "view" => Some(Self::View),
            "feed" => Some(Self::Feed),
            "manage" => Some(Self::Manage),
            _ => None,
        }
    }
}

/// What a token says.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Claims {
    /// Who it was given to.
    pub sub: String,
    /// Its end, seconds since 1970.
    pub exp: u64,
    /// Its own id, by which it is revoked.
    pub jti: String,
    /// `view`, `feed`, `manage`.
    pub scope: String,
    /// The only session that it is for; all, where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub session: Option<String>,
}

/// Checks tokens.
pub struct Access {
    /// `None` where everybody may do everything.
    key: Option<Key>,
    revoked: Revoked,
}

impl Access {
    /// Reads the key.
    ///
    /// # Errors
    /// [`AccessError`].
    pub fn load(config: &AccessConfig, zenoh_enabled: bool) -> Result<Self, AccessError> {
        let revoked = Revoked::new(&config.revoked_file);
        if !config.required {
            return Ok(Self { key: None, revoked });
        }
        if zenoh_enabled {
            return Err(AccessError::Zenoh);
        }
        Ok(Self { key: Some(read_key(config)?), revoked })
    }

    fn caller(self: &Arc<Self>, token: Option<&str>) -> Result<Caller, Rejection> {
        let Some(key) = &self.key else { return Ok(Caller { access: Arc::clone(self), claims: None }) };
        let refused = |text: String| Rejection::new(Reason::Unauthenticated, text);
        let token = token.ok_or_else(|| refused("a token is needed".into()))?;
        let claims: Claims = token
            .verify_with_key(key)
            .map_err(|error| refused(format!("the token is not valid: {error}")))?;
        let caller = Caller { access: Arc::clone(self), claims: Some(Arc::new(claims)) };
        caller.check_valid()?;
        Ok(caller)
    }
}

/// HMAC with SHA-256, the algorithm `HS256` of JSON Web Tokens; tokens of any other are refused.
type Key = Hmac<Sha256>;

/// The secret that tokens are signed with.
fn read_key(config: &AccessConfig) -> Result<Key, AccessError> {
    let path = &config.key_file;
    let text = std::fs::read(path).map_err(|source| AccessError::Key { path: path.clone(), source })?;
    let secret = text.trim_ascii();
    if secret.len() < KEY_MIN_BYTES {
        return Err(AccessError::ShortKey { path: path.clone(), bytes: secret.len() });
    }
    Ok(Key::new_from_slice(secret).expect("HMAC takes keys of any length"))
}

/// A token with these claims.
///
/// # Errors
/// [`AccessError`] where the key cannot be used.
pub fn sign(config: &AccessConfig, claims: &Claims) -> Result<String, AccessError> {
    claims.sign_with_key(&read_key(config)?).map_err(|error| AccessError::Unsigned(error.to_string()))
}

/// An id for a token, which nobody else has.
///
/// # Errors
/// [`AccessError::Unsigned`] where the system has no random numbers.
pub fn token_id() -> Result<String, AccessError> {
    random::hex::<8>().map_err(|error| AccessError::Unsigned(error.to_string()))
}

/// The ids of revoked tokens, read again when their file changes.
struct Revoked {
    path: PathBuf,
    read: Mutex<(Option<SystemTime>, BTreeSet<String>)>,
}

impl Revoked {
    fn new(path: &Path) -> Self {
        Self { path: path.to_path_buf(), read: Mutex::default() }
    }

    /// Once a list has been read, a file that cannot be read any more revokes what it revoked before.
    fn contains(&self, id: &str) -> bool {
        if self.path.as_os_str().is_empty() {
            return false;
        }
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        let changed = std::fs::metadata(&self.path).and_then(|metadata| metadata.modified()).ok();
        if changed.is_some()
            && changed != read.0
            && let Ok(text) = std::fs::read_to_string(&self.path)
        {
            let ids = text.lines().map(str::trim).filter(|line| !line.is_empty()).map(str::to_owned);
            *read = (changed, ids.collect());
        }
        read.1.contains(id)
    }
}

/// Whoever made a request.
#[derive(Clone)]
pub struct Caller {
    access: Arc<Access>,
    /// `None` where no tokens are wanted.
    claims: Option<Arc<Claims>>,
}

impl Caller {
    /// Whether the caller may know of a session; one that it may not know of does not exist for it.
    pub fn knows(&self, session: &str) -> bool {
        self.claims.as_ref().and_then(|claims| claims.session.as_deref()).is_none_or(|only| only == session)
    }

    /// Fails unless the caller may do this at all.
    ///
    /// # Errors
    /// [`Rejection`]: forbidden.
    pub fn require(&self, wanted: Scope) -> Result<(), Rejection> {
        let Some(claims) = &self.claims else { return Ok(()) };
        let most = claims.scope.split(' ').filter_map(Scope::of_name).max();
        if most >= Some(wanted) {
            return Ok(());
        }
        let text = format!("the token of {} allows {:?}, not this", claims.sub, claims.scope);
        Err(Rejection::new(Reason::Forbidden, text))
    }

    /// Fails unless the caller may do this with a session.
    ///
    /// # Errors
    /// [`Rejection`]: unknown session, whether it exists or not, or forbidden.
    pub fn require_for(&self, wanted: Scope, session: &str) -> Result<(), Rejection> {
        if !self.knows(session) {
            let id: SessionId = session
                .parse()
                .map_err(|error| Rejection::new(Reason::InvalidSessionId, format!("{error}")))?;
            return Err(Rejection::unknown_session(&id));
        }
        self.require(wanted)
    }

    fn check_valid(&self) -> Result<(), Rejection> {
        let Some(claims) = &self.claims else { return Ok(()) };
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
        let problem = if now.as_secs() >= claims.exp {
            "the token has expired"
        } else if self.access.revoked.contains(&claims.jti) {
            "the token was revoked"
        } else {
            return Ok(());
        };
        Err(Rejection::new(Reason::Unauthenticated, problem))
    }

    /// Ready once the caller's token is not valid any more; never, where none is wanted.
    pub async fn token_ended(self) -> Rejection {
        if self.claims.is_none() {
            return std::future::pending().await;
        }
        loop {
            if let Err(rejection) = self.check_valid() {
                return rejection;
            }
            tokio::time::sleep(WATCH_INTERVAL).await;
        }
    }
}

/// Finds out who asks; requests without a valid token end here where the server wants one. The page itself is public,
/// as a browser must load it before anybody can give it a token.
pub(super) async fn identify(State(app): State<App>, mut request: Request, next: Next) -> Response {
    let path = request.uri().path();
    let guarded = path.starts_with("/api/") || path == protocol::routes::METRICS;
    if !guarded || path == protocol::routes::HEALTH {
        return next.run(request).await;
    }
    match app.access.caller(token(&request).as_deref()) {
        Ok(caller) => {
            request.extensions_mut().insert(caller);
            next.run(request).await
        }
        Err(rejection) => rejection.into_response(),
    }
}

/// From the header; or, as browsers cannot set one on a WebSocket, from the query.
fn token(request: &Request) -> Option<String> {
    let in_header = request.headers().get(header::AUTHORIZATION);
    if let Some(value) = in_header {
        return value.to_str().ok()?.strip_prefix("Bearer ").map(str::to_owned);
    }
    let query = request.uri().query()?;
    query.split('&').find_map(|pair| pair.strip_prefix("access_token=")).map(str::to_owned)
}
