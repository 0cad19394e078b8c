//! Requests on their way to the thread that holds the model, and the pictures on their way back.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use geometry::Rgb;
use tokio::sync::oneshot;

use super::{PictureError, PictureWanted};

/// Requests of one session that wait, at most; one is drawn after each frame.
const WAITING_MAX: usize = 8;

/// A request and where its answer goes.
#[derive(Debug)]
pub struct PictureRequest {
    /// What is asked for.
    pub wanted: PictureWanted,
    answer: oneshot::Sender<Result<Rgb, PictureError>>,
}

impl PictureRequest {
    /// Whether nobody waits for it any more.
    pub fn is_abandoned(&self) -> bool {
        self.answer.is_closed()
    }

    /// Hands the picture over.
    pub fn answer(self, picture: Result<Rgb, PictureError>) {
        // Whoever asked may have given up meanwhile.
        let _ = self.answer.send(picture);
    }
}

/// Where pictures of one session are asked for.
#[derive(Clone)]
pub struct PictureInlet {
    requests: SyncSender<PictureRequest>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

/// A bounded queue; `wake` tells the thread at its other end that something waits.
pub fn picture_queue(wake: impl Fn() + Send + Sync + 'static) -> (PictureInlet, Receiver<PictureRequest>) {
    let (requests, waiting) = sync_channel(WAITING_MAX);
    (PictureInlet { requests, wake: Arc::new(wake) }, waiting)
}

impl PictureInlet {
    /// Asks for a picture; returns at once. An answer that never comes means that the reconstruction has ended.
    ///
    /// # Errors
    /// [`PictureError::TooMany`], [`PictureError::NoModel`].
    pub fn ask(
        &self,
        wanted: PictureWanted,
    ) -> Result<oneshot::Receiver<Result<Rgb, PictureError>>, PictureError> {
        let (answer, answered) = oneshot::channel();
        self.requests.try_send(PictureRequest { wanted, answer }).map_err(|error| match error {
            TrySendError::Full(_) => PictureError::TooMany { waiting: WAITING_MAX },
            TrySendError::Disconnected(_) => PictureError::NoModel,
        })?;
        (self.wake)();
        Ok(answered)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use dense::Coloring;

    use super::*;
    use crate::picture::Viewpoint;

    const WANTED: PictureWanted =
        PictureWanted { size_px: (4, 3), viewpoint: Viewpoint::Overview, coloring: Coloring::Colour };

    #[test]
    fn whoever_draws_is_woken_and_who_asks_gets_the_picture() {
        let woken = Arc::new(AtomicUsize::new(0));
        let counter = Arc::clone(&woken);
        let (inlet, waiting) = picture_queue(move || {
            counter.fetch_add(1, Ordering::Relaxed);
        });
        let answered = inlet.ask(WANTED).unwrap();
        assert_eq!(woken.load(Ordering::Relaxed), 1);
        let picture = Rgb::from_fn(4, 3, |_, _| [7; 3]);
        waiting.try_recv().unwrap().answer(Ok(picture.clone()));
        assert_eq!(answered.blocking_recv().unwrap(), Ok(picture));
    }

    #[test]
    fn a_full_queue_and_one_that_nobody_serves_refuse() {
        let (inlet, waiting) = picture_queue(|| ());
        let _answers: Vec<_> = (0..WAITING_MAX).map(|_| inlet.ask(WANTED).unwrap()).collect();
        assert_eq!(inlet.ask(WANTED).unwrap_err(), PictureError::TooMany { waiting: WAITING_MAX });
        drop(waiting);
        assert_eq!(inlet.ask(WANTED).unwrap_err(), PictureError::NoModel);
    }

    #[test]
    fn a_request_that_nobody_waits_for_is_told() {
        let (inlet, waiting) = picture_queue(|| ());
        drop(inlet.ask(WANTED).unwrap());
        assert!(waiting.try_recv().unwrap().is_abandoned());
    }
}
