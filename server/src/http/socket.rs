//! A WebSocket peer: greeting, envelopes both ways, and one way to end for each reason.

use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message, WebSocket};
use futures_util::FutureExt;
use futures_util::future::{BoxFuture, Fuse};
use protocol::limits::{CLOSE_GOING_AWAY, CLOSE_MALFORMED, CLOSE_OVERSIZED, CLOSE_REFUSED, HELLO_TIMEOUT_MS};
use protocol::v1::{Farewell, Hello, Reason, from_server, to_server};
use protocol::{Bytes, SessionId};
use tokio::sync::watch;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite;

use super::access::Caller;
use crate::session::intake::Rejection;
use crate::session::lifecycle::Closing;

/// What a client is told at the end may take this long to write.
const LAST_WORDS_TIMEOUT: Duration = Duration::from_secs(1);

/// Text that a close frame holds (RFC 6455: 125 bytes, 2 of them the code).
const CLOSE_TEXT_MAX_BYTES: usize = 123;

/// Why a stream ends.
#[derive(Debug)]
pub enum Ending {
    /// The peer closed it, vanished, or took nothing for too long.
    Gone,
    /// The peer sent what is no envelope.
    Malformed(String),
    /// The peer sent a message over the limit.
    Oversized,
    /// A rule of the protocol refuses to go on.
    Refused(Rejection),
    /// The session has ended.
    SessionClosed(Closing),
}

/// What a peer is held to.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Largest message that it may send.
    pub message_max_bytes: usize,
    /// A peer that takes nothing for this time is let go.
    pub stall: Duration,
}

/// A connected WebSocket.
pub struct Peer {
    socket: WebSocket,
    limits: Limits,
    /// Ready once the peer's token is not valid any more.
    token_ended: Fuse<BoxFuture<'static, Rejection>>,
}

impl Peer {
    /// A peer that is held to limits, and let go when its token ends.
    pub fn new(socket: WebSocket, limits: Limits, caller: Caller) -> Self {
        Self { socket, limits, token_ended: caller.token_ended().boxed().fuse() }
    }

    /// Agrees on a version with the peer, whose first message is a hello; a cart is told the takeover token.
    ///
    /// # Errors
    /// [`Ending`] where none comes in time, or no common version.
    pub async fn greet(&mut self, takeover_token: &str) -> Result<(), Ending> {
        let first = timeout(Duration::from_millis(HELLO_TIMEOUT_MS), self.receive()).await;
        let refused = |reason, text: String| Ending::Refused(Rejection::new(reason, text));
        let hello = match first {
            Ok(Ok(Some(to_server::Body::Hello(hello)))) => hello,
            Ok(Ok(_)) => {
                return Err(refused(Reason::MalformedMessage, "the first message must be a hello".into()));
            }
            Ok(Err(ending)) => return Err(ending),
            Err(_) => return Err(refused(Reason::MalformedMessage, "no hello came in time".into())),
        };
        let answer = answer(&hello).map_err(Ending::Refused)?;
        let answer = Hello { takeover_token: takeover_token.to_owned(), ..answer };
        self.send(protocol::from_server(from_server::Body::Hello(answer))).await
    }

    /// The next message; its body is `None` where this version does not know it.
    ///
    /// Nothing is lost when the future is dropped before it is ready.
    ///
    /// # Errors
    /// [`Ending`].
    pub async fn receive(&mut self) -> Result<Option<to_server::Body>, Ending> {
        loop {
            let message = tokio::select! {
                message = self.socket.recv() => message,
                rejection = &mut self.token_ended => return Err(Ending::Refused(rejection)),
            };
            match message {
                Some(Ok(Message::Binary(bytes))) => {
                    return protocol::decode_to_server(bytes, self.limits.message_max_bytes)
                        .map(|envelope| envelope.body)
                        .map_err(|error| Ending::Malformed(error.to_string()));
                }
                Some(Ok(Message::Text(_))) => return Err(Ending::Malformed("text, not binary".into())),
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                Some(Err(error)) if is_oversized(&error) => return Err(Ending::Oversized),
                Some(Ok(Message::Close(_)) | Err(_)) | None => return Err(Ending::Gone),
            }
        }
    }

    /// Sends an encoded envelope.
    ///
    /// # Errors
    /// [`Ending::Gone`] where the peer does not take it.
    pub async fn send(&mut self, bytes: Bytes) -> Result<(), Ending> {
        match timeout(self.limits.stall, self.socket.send(Message::Binary(bytes))).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(Ending::Gone),
        }
    }

    /// Says why, and closes.
    pub async fn end(mut self, ending: Ending) {
        let oversized = matches!(ending, Ending::Oversized);
        let (last_words, code, text) = match ending {
            Ending::Gone => return,
            Ending::Malformed(text) => (refusal(Reason::MalformedMessage, &text), CLOSE_MALFORMED, text),
            Ending::Oversized => {
                let text = format!("a message is over the limit of {} bytes", self.limits.message_max_bytes);
                (refusal(Reason::OversizedMessage, &text), CLOSE_OVERSIZED, text)
            }
            Ending::Refused(Rejection { reason, text }) => (refusal(reason, &text), CLOSE_REFUSED, text),
            Ending::SessionClosed(closing) => (farewell(&closing), CLOSE_GOING_AWAY, closing.text),
        };
        let close = Message::Close(Some(CloseFrame { code, reason: close_text(&text).into() }));
        // The peer may be gone by now, which is what is wanted.
        let _ = timeout(LAST_WORDS_TIMEOUT, async {
            let _ = self.socket.send(Message::Binary(protocol::from_server(last_words))).await;
            let _ = self.socket.send(close).await;
            while let Some(Ok(_)) = self.socket.recv().await {}
            if oversized {
                // The rest of the message lies unread: closing now would reset the connection, and the peer might
                // never read why.
                std::future::pending::<()>().await;
            }
        })
        .await;
    }
}

/// A refusal of a whole stream.
pub fn refusal(reason: Reason, text: &str) -> from_server::Body {
    from_server::Body::Refusal(protocol::refusal(reason, text, None))
}

/// The last words of a session.
pub fn farewell(closing: &Closing) -> from_server::Body {
    from_server::Body::Farewell(Farewell { text: closing.text.clone(), r#final: closing.on_purpose })
}

/// The server's answer to a hello: the one version that is spoken from then on.
///
/// # Errors
/// [`Rejection`] where there is no common version.
pub fn answer(hello: &Hello) -> Result<Hello, Rejection> {
    let version = protocol::negotiate(hello)
        .map_err(|error| Rejection::new(Reason::UnsupportedVersion, error.to_string()))?;
    Ok(Hello { oldest_version: version, newest_version: version, ..own_hello() })
}

/// What this server speaks.
pub fn own_hello() -> Hello {
    protocol::hello(concat!("mis-slam ", env!("CARGO_PKG_VERSION")))
}

/// Waits until a session has ended.
pub async fn session_closed(closing: &mut watch::Receiver<Option<Closing>>, session: &SessionId) -> Closing {
    let told = closing.wait_for(Option::is_some).await.ok().and_then(|told| told.clone());
    told.unwrap_or_else(|| Closing::because(&format!("session {session} has ended")))
}

/// Waits for the next value of a latest-wins lane.
///
/// Never ready once the lane is gone; [`session_closed`] then is. Nothing is lost when the future is dropped.
pub async fn newest(lane: &mut watch::Receiver<Option<Bytes>>) -> Bytes {
    loop {
        if lane.changed().await.is_err() {
            std::future::pending::<()>().await;
        }
        if let Some(bytes) = lane.borrow_and_update().clone() {
            return bytes;
        }
    }
}

fn is_oversized(error: &axum::Error) -> bool {
    let source = std::error::Error::source(error);
    matches!(source.and_then(|source| source.downcast_ref()), Some(tungstenite::Error::Capacity(_)))
}

/// What fits a close frame.
fn close_text(text: &str) -> &str {
    &text[..text.floor_char_boundary(CLOSE_TEXT_MAX_BYTES)]
}
