//! Follows a session on a thread of its own, and comes back by itself.

use std::hash::{BuildHasher, RandomState};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use connection::LinkError;
use protocol::v1::Reason;
use protocol::{Endpoint, SessionId};

use crate::ViewerError;
use crate::followed::Followed;
use crate::link::Link;
use crate::scene::Scene;

/// Session states come a few times a second: after this silence the network has to be taken for broken.
const SILENCE_LIMIT: Duration = Duration::from_secs(5);
/// How often it is looked whether the model has to be asked for again.
const RESYNC_CHECK: Duration = Duration::from_millis(500);
const FIRST_DELAY: Duration = Duration::from_millis(250);
const LONGEST_DELAY: Duration = Duration::from_secs(8);

/// What is followed.
#[derive(Clone, Debug)]
pub struct FeedOptions {
    /// The server.
    pub to: Endpoint,
    /// The session.
    pub session: SessionId,
    /// Shown where the server wants a token.
    pub token: Option<String>,
}

/// The newest scene of a session that is followed until the process ends.
#[derive(Clone, Debug)]
pub struct Feed {
    scene: Arc<Mutex<Scene>>,
}

impl Feed {
    /// Starts to follow; `changed` is called after each change of the scene, from another thread.
    ///
    /// # Errors
    /// [`ViewerError::Thread`].
    pub fn start(options: FeedOptions, changed: impl Fn() + Send + 'static) -> Result<Self, ViewerError> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .map_err(ViewerError::Thread)?;
        let feed = Self { scene: Arc::default() };
        let follower = Follower { followed: Followed::default(), scene: Arc::clone(&feed.scene), changed };
        std::thread::Builder::new()
            .name("feed".into())
            .spawn(move || runtime.block_on(follower.follow(&options)))
            .map_err(ViewerError::Thread)?;
        Ok(feed)
    }

    /// The scene now; its surfels are shared, not copied.
    pub fn scene(&self) -> Scene {
        lock(&self.scene).clone()
    }
}

struct Follower<F> {
    followed: Followed,
    scene: Arc<Mutex<Scene>>,
    changed: F,
}

impl<F: Fn() + Send> Follower<F> {
    async fn follow(mut self, options: &FeedOptions) {
        let mut delay = FIRST_DELAY;
        loop {
            let ended = match Link::connect(&options.to, &options.session, options.token.as_deref()).await {
                Ok(mut link) => {
                    self.followed.connected(Instant::now());
                    self.publish();
                    let begun = Instant::now();
                    let ended = self.take_all(&mut link).await;
                    if begun.elapsed() > SILENCE_LIMIT {
                        delay = FIRST_DELAY;
                    }
                    ended
                }
                Err(error) => error,
            };
            let unknown = matches!(ended, LinkError::Refused { reason: Reason::UnknownSession, .. });
            tracing::warn!(error = %ended, "not connected");
            self.followed.disconnected(ended.to_string(), unknown);
            self.publish();
            tokio::time::sleep(shortened(delay)).await;
            delay = (delay * 2).min(LONGEST_DELAY);
        }
    }

    /// Takes messages until the connection ends.
    async fn take_all(&mut self, link: &mut Link) -> LinkError {
        let mut check = tokio::time::interval(RESYNC_CHECK);
        let mut last_heard = Instant::now();
        loop {
            tokio::select! {
                body = link.receive() => match body {
                    Ok(body) => {
                        last_heard = Instant::now();
                        self.followed.take(body, last_heard);
                        self.publish();
                    }
                    Err(error) => return error,
                },
                _ = check.tick() => {
                    if last_heard.elapsed() > SILENCE_LIMIT {
                        return LinkError::Lost("the server is silent".into());
                    }
                    if let Some(held_epoch) = self.followed.resync_due(Instant::now())
                        && let Err(error) = link.resync(held_epoch).await
                    {
                        return error;
                    }
                }
            }
        }
    }

    fn publish(&self) {
        let scene = self.followed.scene.clone();
        *lock(&self.scene) = scene;
        (self.changed)();
    }
}

/// By a half at most, at random, so that not all viewers come back at once.
fn shortened(delay: Duration) -> Duration {
    let share = (RandomState::new().hash_one(0) >> 40) as f32 / (1u32 << 24) as f32;
    delay.mul_f32(1.0 - 0.5 * share)
}

/// The scene is replaced as a whole, so a panic elsewhere does not spoil it.
fn lock(scene: &Mutex<Scene>) -> MutexGuard<'_, Scene> {
    scene.lock().unwrap_or_else(PoisonError::into_inner)
}
