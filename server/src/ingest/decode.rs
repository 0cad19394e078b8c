//! Encoded pairs to pixels, on a thread of its own for each session.

use std::sync::Arc;
use std::thread::JoinHandle;

use protocol::v1::{EncodedImage, Reason, StereoPair as EncodedPair};
use recording::RecordingError;
use tracing::trace_span;

use crate::convert;
use crate::session::hub::Hub;
use crate::session::intake::Rejection;
use crate::session::mailbox::{MailboxReceiver, MailboxSender, Offer, Policy};
use crate::session::worker::StereoPair;

/// A pair on its way to the reconstruction.
#[derive(Clone, Debug)]
pub struct Incoming {
    /// As it came.
    pub pair: EncodedPair,
    /// Whether a newer one may take its place.
    pub policy: Policy,
}

/// Starts the thread; it ends when all senders of `encoded` are gone.
///
/// # Errors
/// The system's, where no thread can be started.
pub fn spawn(
    encoded: MailboxReceiver<Incoming>,
    decoded: MailboxSender<StereoPair>,
    size_px: (u32, u32),
    hub: Arc<Hub>,
) -> std::io::Result<JoinHandle<()>> {
    std::thread::Builder::new().name("decoder".into()).spawn(move || run(&encoded, &decoded, size_px, &hub))
}

fn run(
    encoded: &MailboxReceiver<Incoming>,
    decoded: &MailboxSender<StereoPair>,
    size_px: (u32, u32),
    hub: &Hub,
) {
    while let Some(Incoming { pair, policy }) = encoded.take() {
        let sequence = pair.sequence;
        let _pair = trace_span!("read pair", frame = sequence).entered();
        match trace_span!("decode").in_scope(|| decode(pair, policy, size_px)) {
            Err(rejection) => hub.reject(sequence, rejection),
            Ok(pair) => match trace_span!("hand over").in_scope(|| decoded.offer_by(policy, pair)) {
                Offer::Queued => {}
                Offer::Superseded => hub.count_drop(Reason::Superseded),
                // The reconstruction has failed and said so; later pairs go the same way.
                Offer::Closed => hub.count_drop(Reason::Internal),
            },
        }
    }
}

/// Decodes a pair; every header is checked against `size_px` before its pixels are allocated.
///
/// # Errors
/// [`Rejection`] that names the eye, and both sizes where they differ.
pub fn decode(pair: EncodedPair, policy: Policy, size_px: (u32, u32)) -> Result<StereoPair, Rejection> {
    Ok(StereoPair {
        stamp_ns: pair.stamp_ns,
        sequence: pair.sequence,
        left: image("left", pair.left, |image| recording::decode_rgb(image, size_px))?,
        right: image("right", pair.right, |image| recording::decode_rgb(image, size_px))?,
        mask: match pair.mask {
            Some(mask) => Some(image("mask", Some(mask), |image| recording::decode_gray(image, size_px))?),
            None => None,
        },
        policy,
    })
}

fn image<T>(
    eye: &str,
    image: Option<EncodedImage>,
    decode: impl FnOnce(&recording::EncodedImage) -> Result<T, RecordingError>,
) -> Result<T, Rejection> {
    let image =
        image.ok_or_else(|| Rejection::new(Reason::Unpaired, format!("the {eye} image is missing")))?;
    let image = convert::image_from_wire(image)?;
    decode(&image).map_err(|error| {
        let reason = match error {
            RecordingError::ImageSize { .. } => Reason::ImageSizeMismatch,
            _ => Reason::MalformedImage,
        };
        Rejection::new(reason, format!("{eye} image: {error}"))
    })
}
