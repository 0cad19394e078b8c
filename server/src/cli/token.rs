//! `mis-slam token`: an access token for whoever may look, feed or manage.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use clap::{Args, ValueEnum};

use super::{Failure, Outcome};
use crate::config::Config;
use crate::http::access::{self, Claims};

/// Sign an access token with `access.key_file`; its id, by which it can be revoked, goes to standard error.
#[derive(Debug, Args)]
pub struct Token {
    /// What it is for; each may also do what those before it may.
    scope: ScopeName,
    /// Who gets it, for people.
    #[arg(long, value_name = "NAME")]
    to: String,
    /// The only session that it is for.
    #[arg(long, value_name = "ID")]
    session: Option<protocol::SessionId>,
    /// How long it is valid.
    #[arg(long, value_name = "HOURS", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..))]
    hours: u32,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ScopeName {
    View,
    Feed,
    Manage,
}

impl Token {
    pub(super) fn run(self, config: &Config) -> Outcome {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
        let scope = match self.scope {
            ScopeName::View => "view",
            ScopeName::Feed => "feed",
            ScopeName::Manage => "manage",
        };
        let claims = Claims {
            sub: self.to,
            exp: now.as_secs() + u64::from(self.hours) * 3600,
            jti: access::token_id().map_err(Failure::failed)?,
            scope: scope.into(),
            session: self.session.map(|id| id.to_string()),
        };
        let token = access::sign(&config.access, &claims).map_err(Failure::bad_input)?;
        eprintln!("id {}", claims.jti);
        println!("{token}");
        Ok(())
    }
}
