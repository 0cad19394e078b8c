//! The stream: read, paced, sent, reconnected.

use std::future::Future;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use connection::LinkError;
use protocol::SessionId;
use protocol::v1::{Reason, from_server};
use recording::RecordingError;
use tokio::task::JoinHandle;

use crate::config::{CartConfig, ConnectionConfig};
use crate::link::{Joined, Link, Purpose};
use crate::open::Source;
use crate::queue::{QueueOutlet, queue};
use crate::report::{Progress, PublishReport, Tally};
use crate::{CartError, Encoding, Endpoint, convert, source};

/// Time to read what the server said before a connection was lost.
const LAST_WORDS_TIMEOUT: Duration = Duration::from_millis(100);

/// What to stream, and to whom.
#[derive(Clone, Debug)]
pub struct PublishOptions {
    /// The recording, or a folder of image pairs.
    pub source: PathBuf,
    /// A rig file in place of the folder's own.
    pub rig_file: Option<PathBuf>,
    /// How images travel.
    pub encoding: Encoding,
    /// The server.
    pub to: Endpoint,
    /// The session to feed; the server names one where none is given.
    pub session: Option<SessionId>,
    /// The session's takeover token, to take it over from another cart.
    pub takeover_token: Option<String>,
    /// Times the recorded pace.
    pub rate: f64,
    /// Starts over at the end, with stamps that go on.
    pub repeat: bool,
}

/// Streams a recording or folder to its end, or until `stop` is ready; `observe` is told after each message.
///
/// # Errors
/// [`CartError`]: the recording cannot be read, the server refuses or stays away.
pub async fn publish_recording(
    options: &PublishOptions,
    config: &CartConfig,
    mut observe: impl FnMut(&Progress) + Send,
    stop: impl Future<Output = ()> + Send,
) -> Result<PublishReport, CartError> {
    let source = open(options, config).await?;
    let (reader, calibration) = (source.reader.clone(), source.calibration);
    let mut tally = Tally::new(reader.expected_pairs());
    let mut sender = Sender {
        to: &options.to,
        config: &config.cart,
        purpose: Purpose {
            session: options.session.clone(),
            calibration: convert::calibration(&calibration),
            takeover_token: options.takeover_token.clone().unwrap_or_default(),
        },
        link: None,
    };
    // The first connection is made before time starts to run, so that no pair is missed.
    let stream = async {
        sender.connect(&mut tally).await?;
        let form = (calibration.image_size_px(), options.encoding);
        let pairs = source::read(reader, form, options.repeat);
        let (inlet, waiting) = queue(config.cart.buffer_pairs);
        let pacing = tokio::spawn(source::pace(pairs, options.rate, inlet));
        let sent = sender.send_all(waiting, &mut tally, &mut observe).await;
        finish(pacing, sent).await
    };
    let streamed = tokio::select! {
        streamed = stream => streamed,
        () = stop => Ok(()),
    };
    if let Some(link) = sender.link.take() {
        link.close().await;
    }
    streamed?;
    Ok(tally.report())
}

/// Reads files, so it happens off the async runtime.
async fn open(options: &PublishOptions, config: &CartConfig) -> Result<Source, CartError> {
    let (path, rig_file) = (options.source.clone(), options.rig_file.clone());
    let (recording, limits) = (config.recording.clone(), config.rig);
    let opened =
        tokio::task::spawn_blocking(move || Source::open(&path, rig_file.as_deref(), (&recording, &limits)));
    match opened.await {
        Ok(opened) => opened,
        Err(panic) => std::panic::resume_unwind(panic.into_panic()),
    }
}

/// The reason why the stream ended: what was read comes before what was sent.
async fn finish(
    pacing: JoinHandle<Result<(), RecordingError>>,
    sent: Result<(), CartError>,
) -> Result<(), CartError> {
    if sent.is_err() {
        pacing.abort();
        return sent;
    }
    match pacing.await {
        Ok(read) => Ok(read?),
        Err(panic) => std::panic::resume_unwind(panic.into_panic()),
    }
}

/// The connection, made again where it is lost.
struct Sender<'a> {
    to: &'a Endpoint,
    config: &'a ConnectionConfig,
    purpose: Purpose,
    link: Option<Link>,
}

impl Sender<'_> {
    /// Connects, again and again within the time given.
    async fn connect(&mut self, tally: &mut Tally) -> Result<(), CartError> {
        let started = Instant::now();
        let mut pause = Duration::from_secs_f64(self.config.retry_first_s);
        loop {
            let problem = match Link::connect(self.to, &self.purpose).await {
                Ok((link, Joined { session, takeover_token })) => {
                    self.purpose.takeover_token = takeover_token;
                    tally.session = session.to_string();
                    self.purpose.session = Some(session);
                    self.link = Some(link);
                    return Ok(());
                }
                Err(LinkError::Lost(problem)) => problem,
                // The server may not have noticed yet that the last connection is lost.
                Err(LinkError::Refused { reason: Reason::SessionBusy, text }) if tally.has_sent() => text,
                Err(LinkError::Refused { reason, text }) => return Err(CartError::Refused { reason, text }),
                Err(LinkError::Closed(text)) => return Err(CartError::SessionClosed { text }),
            };
            let after = started.elapsed();
            if after.as_secs_f64() > self.config.give_up_s {
                return Err(CartError::Unreachable { to: self.to.to_string(), after, problem });
            }
            tracing::info!(problem, "no connection; trying again");
            tokio::time::sleep(pause).await;
            pause = (pause * 2).min(Duration::from_secs_f64(self.config.retry_max_s));
        }
    }

    async fn send_all(
        &mut self,
        mut waiting: QueueOutlet,
        tally: &mut Tally,
        observe: &mut impl FnMut(&Progress),
    ) -> Result<(), CartError> {
        loop {
            let Some(link) = &mut self.link else {
                self.connect(tally).await?;
                tally.reconnects += 1;
                continue;
            };
            match exchange(link, &mut waiting, tally, observe).await {
                Ok(Exchange::Goes) => {}
                Ok(Exchange::SourceEnded) => {
                    self.linger(tally, observe).await?;
                    return if tally.has_sent() { Ok(()) } else { Err(CartError::Empty) };
                }
                Err(LinkError::Lost(problem)) => {
                    tracing::warn!(problem, "connection lost");
                    last_words(link).await?;
                    self.link = None;
                }
                Err(LinkError::Refused { reason, text }) => return Err(CartError::Refused { reason, text }),
                Err(LinkError::Closed(text)) => return Err(CartError::SessionClosed { text }),
            }
        }
    }

    /// Waits for the poses that are still to come.
    async fn linger(
        &mut self,
        tally: &mut Tally,
        observe: &mut impl FnMut(&Progress),
    ) -> Result<(), CartError> {
        let Some(link) = &mut self.link else { return Ok(()) };
        let rest = async {
            while tally.awaits_poses() {
                hear(link.receive().await?, tally, observe)?;
            }
            Ok::<(), LinkError>(())
        };
        match tokio::time::timeout(Duration::from_secs_f64(self.config.linger_s), rest).await {
            Ok(Err(LinkError::Refused { reason, text })) => Err(CartError::Refused { reason, text }),
            // Pairs that were overtaken in the server have no pose, so it is usual that time runs out; and a
            // connection lost or closed after the last pair has done its work.
            Ok(Ok(()) | Err(LinkError::Lost(_) | LinkError::Closed(_))) | Err(_) => Ok(()),
        }
    }
}

/// A server that ends the connection in the middle of a pair has said why before.
///
/// # Errors
/// [`CartError::Refused`] where it does not want the stream, [`CartError::SessionClosed`] where somebody has ended it.
async fn last_words(link: &mut Link) -> Result<(), CartError> {
    while let Ok(Ok(body)) = tokio::time::timeout(LAST_WORDS_TIMEOUT, link.receive()).await {
        match body {
            from_server::Body::Refusal(refusal) if refusal.sequence.is_none() => {
                return Err(CartError::Refused { reason: refusal.reason(), text: refusal.text });
            }
            from_server::Body::Farewell(farewell) if farewell.r#final => {
                return Err(CartError::SessionClosed { text: farewell.text });
            }
            _ => {}
        }
    }
    Ok(())
}

enum Exchange {
    Goes,
    SourceEnded,
}

/// One message, in either direction.
async fn exchange(
    link: &mut Link,
    waiting: &mut QueueOutlet,
    tally: &mut Tally,
    observe: &mut impl FnMut(&Progress),
) -> Result<Exchange, LinkError> {
    tokio::select! {
        pair = waiting.take() => {
            let Some(pair) = pair else { return Ok(Exchange::SourceEnded) };
            tally.note_sent(pair.sequence, Instant::now());
            link.send(pair).await?;
            observe(&tally.progress());
        }
        body = link.receive() => hear(body?, tally, observe)?,
    }
    Ok(Exchange::Goes)
}

/// A refusal of a pair is counted; one of the whole stream ends it, as does the farewell of a session that was closed on purpose.
fn hear(
    body: from_server::Body,
    tally: &mut Tally,
    observe: &mut impl FnMut(&Progress),
) -> Result<(), LinkError> {
    match body {
        from_server::Body::Pose(pose) => tally.note_pose(&pose, Instant::now()),
        from_server::Body::Refusal(refusal) => {
            if refusal.sequence.is_none() {
                return Err(LinkError::Refused { reason: refusal.reason(), text: refusal.text });
            }
            tracing::debug!(reason = refusal.reason().name(), text = refusal.text, "refused");
            tally.note_refused(refusal.reason());
        }
        from_server::Body::Farewell(farewell) if farewell.r#final => {
            return Err(LinkError::Closed(farewell.text));
        }
        _ => return Ok(()),
    }
    observe(&tally.progress());
    Ok(())
}
