//! Requests on their way to the thread that holds the model, and pictures and copies of it on their way back.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use dense::Surfel;
use geometry::Rgb;
use tokio::sync::oneshot;

use super::{PictureError, PictureWanted};

/// Requests of one session that wait, at most; one is answered after each frame.
const WAITING_MAX: usize = 8;

/// What is asked for, and where the answer goes.
#[derive(Debug)]
pub enum PictureRequest {
    /// A picture of the model.
    Picture(PictureWanted, Answer<Rgb>),
    /// Its stable surfels, by increasing id.
    Surfels(Answer<Vec<Surfel>>),
}

/// Where an answer goes.
#[derive(Debug)]
pub struct Answer<T>(oneshot::Sender<Result<T, PictureError>>);

/// Where an answer comes from; an error means that the reconstruction has ended.
pub type Answered<T> = oneshot::Receiver<Result<T, PictureError>>;

impl<T> Answer<T> {
    /// Answers with what `find` gives, unless nobody waits for it any more.
    pub fn with(self, find: impl FnOnce() -> Result<T, PictureError>) {
        if !self.0.is_closed() {
            // Whoever asked may give up meanwhile.
            let _ = self.0.send(find());
        }
    }
}

/// Where pictures and copies of one session's model are asked for.
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
    /// Asks for a picture; returns at once.
    ///
    /// # Errors
    /// [`PictureError::TooMany`], [`PictureError::NoModel`].
    pub fn ask(&self, wanted: PictureWanted) -> Result<Answered<Rgb>, PictureError> {
        self.send(|answer| PictureRequest::Picture(wanted, answer))
    }

    /// Asks for the model; returns at once.
    ///
    /// # Errors
    /// As [`Self::ask`].
    pub fn ask_for_surfels(&self) -> Result<Answered<Vec<Surfel>>, PictureError> {
        self.send(PictureRequest::Surfels)
    }

    fn send<T>(
        &self,
        request: impl FnOnce(Answer<T>) -> PictureRequest,
    ) -> Result<Answered<T>, PictureError> {
        let (answer, answered) = oneshot::channel();
        self.requests.try_send(request(Answer(answer))).map_err(|error| match error {
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
        let PictureRequest::Picture(wanted, answer) = waiting.try_recv().unwrap() else {
            panic!("another request");
        };
        assert_eq!(wanted, WANTED);
        answer.with(|| Ok(picture.clone()));
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
    fn a_request_that_nobody_waits_for_is_not_answered() {
        let (inlet, waiting) = picture_queue(|| ());
        drop(inlet.ask_for_surfels().unwrap());
        let PictureRequest::Surfels(answer) = waiting.try_recv().unwrap() else { panic!("another request") };
        answer.with(|| unreachable!("nobody waits"));
    }
}
