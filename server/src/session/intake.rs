//! Which pairs are taken: complete ones, of the calibrated size and one format, whose stamps go forward.
//!
//! Everything is judged by the message's own fields; no image byte is read yet.

use std::time::{Duration, Instant};

use protocol::SessionId;
use protocol::v1::{EncodedImage, Reason, StereoPair};

use super::lifecycle::SourceBusy;

/// Why a pair is not taken.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text}")]
pub struct Rejection {
    /// The key under which it is counted.
    pub reason: Reason,
    /// For people, with the values.
    pub text: String,
}

impl Rejection {
    /// A rejection with its values.
    pub fn new(reason: Reason, text: impl Into<String>) -> Self {
        Self { reason, text: text.into() }
    }

    /// There is no such session, or the caller may not know of it: no difference is told.
    pub fn unknown_session(id: &SessionId) -> Self {
        Self::new(Reason::UnknownSession, format!("no session {id}"))
    }
}

impl From<SourceBusy> for Rejection {
    fn from(busy: SourceBusy) -> Self {
        Self::new(Reason::SessionBusy, busy.to_string())
    }
}

/// What is known of the stream so far.
#[derive(Debug)]
pub struct Intake {
    size_px: (u32, u32),
    stamp_lead_max: Duration,
    format: Option<i32>,
    oldest_ns: Option<u64>,
    newest: Option<Newest>,
}

/// The newest pair taken.
#[derive(Clone, Copy, Debug)]
struct Newest {
    stamp_ns: u64,
    /// When it came; `None` where it was found in a recording, whose clock is not this machine's.
    at: Option<Instant>,
}

/// Where a pair comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// From a cart: its stamps run as time does.
    Live,
    /// From a recording: at any pace.
    Stored,
}

impl Intake {
    /// Takes pairs of images of this size.
    pub fn new(size_px: (u32, u32), stamp_lead_max: Duration) -> Self {
        Self { size_px, stamp_lead_max, format: None, oldest_ns: None, newest: None }
    }

    /// Another recording, or another place in it: all may change.
    pub fn restart(&mut self, size_px: (u32, u32)) {
        self.recalibrate(size_px);
        (self.oldest_ns, self.newest) = (None, None);
    }

    /// From the first pair taken to the newest, by their stamps.
    pub fn span(&self) -> Duration {
        let newest_ns = self.newest.map(|newest| newest.stamp_ns);
        Duration::from_nanos(newest_ns.zip(self.oldest_ns).map_or(0, |(newest, oldest)| newest - oldest))
    }

    /// A new calibration: size and format may change, time may not go back.
    pub fn recalibrate(&mut self, size_px: (u32, u32)) {
        self.size_px = size_px;
        self.format = None;
    }

    /// Takes the next pair's header in.
    ///
    /// # Errors
    /// [`Rejection`] with the reason; nothing is then remembered of the pair.
    pub fn admit(&mut self, pair: &StereoPair, origin: Origin, now: Instant) -> Result<(), Rejection> {
        let (left, right) = both_eyes(pair)?;
        self.check_image("left", left)?;
        self.check_image("right", right)?;
        if let Some(mask) = &pair.mask {
            self.check_size("mask", mask)?;
        }
        self.check_stamp(pair.stamp_ns, origin, now)?;
        self.format = Some(left.format);
        let at = (origin == Origin::Live).then_some(now);
        self.oldest_ns = self.oldest_ns.or(Some(pair.stamp_ns));
        self.newest = Some(Newest { stamp_ns: pair.stamp_ns, at });
        Ok(())
    }

    fn check_image(&self, eye: &str, image: &EncodedImage) -> Result<(), Rejection> {
        self.check_size(eye, image)?;
        match self.format {
            Some(format) if format != image.format => Err(Rejection::new(
                Reason::ImageFormatChanged,
                format!(
                    "{eye} image is {}, the stream so far {}; send a calibration first",
                    image.format().as_str_name(),
                    format_name(format)
                ),
            )),
            _ => Ok(()),
        }
    }

    fn check_size(&self, eye: &str, image: &EncodedImage) -> Result<(), Rejection> {
        let got = (image.width_px, image.height_px);
        if got == self.size_px {
            return Ok(());
        }
        let (width, height) = self.size_px;
        Err(Rejection::new(
            Reason::ImageSizeMismatch,
            format!("{eye} image: expected {width}x{height}, got {}x{}", got.0, got.1),
        ))
    }

    fn check_stamp(&self, stamp_ns: u64, origin: Origin, now: Instant) -> Result<(), Rejection> {
        let Some(Newest { stamp_ns: newest_ns, at }) = self.newest else { return Ok(()) };
        let allowed = match at {
            Some(at) if origin == Origin::Live => now.duration_since(at).saturating_add(self.stamp_lead_max),
            _ => Duration::MAX,
        };
        let lead = Duration::from_nanos(stamp_ns.saturating_sub(newest_ns));
        let text = |what: &str| format!("stamp {stamp_ns} ns {what} the newest one, {newest_ns} ns");
        match stamp_ns.cmp(&newest_ns) {
            std::cmp::Ordering::Less => Err(Rejection::new(Reason::StaleStamp, text("is older than"))),
            std::cmp::Ordering::Equal => Err(Rejection::new(Reason::DuplicateStamp, text("repeats"))),
            std::cmp::Ordering::Greater if lead > allowed => Err(Rejection::new(
                Reason::FutureStamp,
                text(&format!(
                    "is {:.1} s ahead, of {:.1} s possible, of",
                    lead.as_secs_f64(),
                    allowed.as_secs_f64()
                )),
            )),
            std::cmp::Ordering::Greater => Ok(()),
        }
    }
}

fn both_eyes(pair: &StereoPair) -> Result<(&EncodedImage, &EncodedImage), Rejection> {
    let seen = |image: &Option<EncodedImage>| image.as_ref().is_some_and(|image| !image.data.is_empty());
    match (&pair.left, &pair.right) {
        (Some(left), Some(right)) if seen(&pair.left) && seen(&pair.right) => Ok((left, right)),
        _ => {
            let missing = if seen(&pair.left) { "right" } else { "left" };
            Err(Rejection::new(Reason::Unpaired, format!("the {missing} image is missing")))
        }
    }
}

fn format_name(format: i32) -> &'static str {
    protocol::v1::ImageFormat::try_from(format).map_or("unknown", |format| format.as_str_name())
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::v1::ImageFormat;

    fn image(width_px: u32, height_px: u32) -> EncodedImage {
        EncodedImage { format: ImageFormat::Jpeg.into(), width_px, height_px, data: vec![1].into() }
    }

    fn pair(stamp_ns: u64) -> StereoPair {
        StereoPair {
            stamp_ns,
            sequence: 0,
            left: Some(image(64, 48)),
            right: Some(image(64, 48)),
            mask: None,
        }
    }

    fn intake() -> Intake {
        Intake::new((64, 48), Duration::from_secs(10))
    }

    fn reason(result: Result<(), Rejection>) -> Reason {
        result.unwrap_err().reason
    }

    #[test]
    fn stamps_that_go_forward_are_taken() {
        let (mut intake, now) = (intake(), Instant::now());
        assert_eq!(intake.span(), Duration::ZERO);
        for stamp_ns in [5, 6, 9_000_000_000] {
            assert_eq!(intake.admit(&pair(stamp_ns), Origin::Live, now), Ok(()));
        }
        assert_eq!(intake.span(), Duration::from_nanos(8_999_999_995));
        intake.restart((64, 48));
        assert_eq!(intake.span(), Duration::ZERO);
    }

    #[test]
    fn time_never_goes_back_nor_stands_still() {
        let (mut intake, now) = (intake(), Instant::now());
        intake.admit(&pair(100), Origin::Live, now).unwrap();
        assert_eq!(reason(intake.admit(&pair(99), Origin::Live, now)), Reason::StaleStamp);
        assert_eq!(reason(intake.admit(&pair(100), Origin::Live, now)), Reason::DuplicateStamp);
        assert_eq!(intake.admit(&pair(101), Origin::Live, now), Ok(()));
    }

    #[test]
    fn a_stamp_from_the_future_does_not_shut_out_those_after_it() {
        let (mut intake, now) = (intake(), Instant::now());
        intake.admit(&pair(0), Origin::Live, now).unwrap();
        assert_eq!(reason(intake.admit(&pair(u64::MAX), Origin::Live, now)), Reason::FutureStamp);
        assert_eq!(intake.admit(&pair(1), Origin::Live, now), Ok(()));
    }

    #[test]
    fn a_pause_of_the_cart_is_no_jump_into_the_future() {
        let (mut intake, now) = (intake(), Instant::now());
        intake.admit(&pair(0), Origin::Live, now).unwrap();
        assert_eq!(intake.admit(&pair(60_000_000_000), Origin::Live, now + Duration::from_secs(55)), Ok(()));
    }

    #[test]
    fn a_recording_has_its_own_clock_and_a_cart_may_go_on_after_it() {
        let (mut intake, now) = (intake(), Instant::now());
        for stamp_ns in [0, 60_000_000_000] {
            assert_eq!(intake.admit(&pair(stamp_ns), Origin::Stored, now), Ok(()));
        }
        assert_eq!(intake.admit(&pair(3_600_000_000_000), Origin::Live, now), Ok(()));
        assert_eq!(reason(intake.admit(&pair(1), Origin::Live, now)), Reason::StaleStamp);
        intake.restart((64, 48));
        assert_eq!(intake.admit(&pair(1), Origin::Stored, now), Ok(()));
    }

    #[test]
    fn one_eye_is_not_enough() {
        let (mut intake, now) = (intake(), Instant::now());
        let rejection = intake.admit(&StereoPair { right: None, ..pair(1) }, Origin::Live, now).unwrap_err();
        assert_eq!(
            (rejection.reason, rejection.text.as_str()),
            (Reason::Unpaired, "the right image is missing")
        );
        let empty = EncodedImage { data: Vec::new().into(), ..image(64, 48) };
        assert_eq!(
            reason(intake.admit(&StereoPair { left: Some(empty), ..pair(1) }, Origin::Live, now)),
            Reason::Unpaired
        );
    }

    #[test]
    fn another_size_is_refused_with_both_sizes_until_a_new_calibration() {
        let (mut intake, now) = (intake(), Instant::now());
        let larger = StereoPair { left: Some(image(65, 48)), right: Some(image(65, 48)), ..pair(1) };
        let rejection = intake.admit(&larger, Origin::Live, now).unwrap_err();
        assert_eq!(rejection.text, "left image: expected 64x48, got 65x48");
        intake.recalibrate((65, 48));
        assert_eq!(intake.admit(&larger, Origin::Live, now), Ok(()));
    }

    #[test]
    fn another_format_is_refused_until_a_new_calibration() {
        let (mut intake, now) = (intake(), Instant::now());
        intake.admit(&pair(1), Origin::Live, now).unwrap();
        let png = || Some(EncodedImage { format: ImageFormat::Png.into(), ..image(64, 48) });
        let changed = StereoPair { left: png(), right: png(), ..pair(2) };
        assert_eq!(reason(intake.admit(&changed, Origin::Live, now)), Reason::ImageFormatChanged);
        intake.recalibrate((64, 48));
        assert_eq!(intake.admit(&changed, Origin::Live, now), Ok(()));
    }
}
