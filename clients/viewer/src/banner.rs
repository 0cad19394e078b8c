//! The one most important thing to say across the view; the wording is that of the page.

use std::time::Duration;

use protocol::v1::{SessionStatus, TrackingOutcome};

/// Silence of the model lane that is worth words; the model fades long before.
const WORTH_SAYING: Duration = Duration::from_secs(3);

/// How urgent a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Nothing is wrong.
    Quiet,
    /// Look at it.
    Warning,
    /// What is shown cannot be relied on.
    Bad,
}

/// What is said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// In few words.
    pub title: String,
    /// More of it; may be empty.
    pub detail: String,
    /// How urgent.
    pub tone: Tone,
}

/// What decides whether something has to be said.
#[derive(Clone, Debug, PartialEq)]
pub struct Situation<'a> {
    /// Messages come in.
    pub connected: bool,
    /// The server says that there is no such session.
    pub unknown_session: bool,
    /// What the server said when it refused or left, or the network's reason; empty while all is well.
    pub notice: &'a str,
    /// The session's.
    pub status: SessionStatus,
    /// The server's reason for the status.
    pub status_text: &'a str,
    /// The tracker's.
    pub tracking: TrackingOutcome,
    /// Of the model lane.
    pub silence: Option<Duration>,
    /// Of what is shown.
    pub age: Option<Duration>,
    /// Surfels held.
    pub surfels: usize,
    /// The model is too old to be shown.
    pub hidden: bool,
}

/// The message for a situation, or nothing.
pub fn message_for(situation: &Situation) -> Option<Message> {
    let held = held(situation);
    let held = held.as_str();
    let said = |title: &str, details: &[&str], tone| {
        Some(Message { title: title.into(), detail: sentences(details), tone })
    };
    let Situation { status, status_text, notice, .. } = *situation;
    if situation.unknown_session {
        return said("No such session", &["It has ended, or its name is wrong"], Tone::Bad);
    }
    if !situation.connected && (situation.silence.is_some() || !notice.is_empty()) {
        return said("Connection lost", &["Reconnecting …", notice, held], Tone::Bad);
    }
    match status {
        SessionStatus::SourceLost => said("Source lost", &[status_text, held], Tone::Bad),
        SessionStatus::Closed => said("Session closed", &[status_text, held], Tone::Quiet),
        _ if situation.tracking == TrackingOutcome::Lost => {
            said("Tracking lost", &["The model is paused", held], Tone::Warning)
        }
        SessionStatus::Degraded => said("Degraded", &[status_text], Tone::Warning),
        SessionStatus::Live if situation.silence > Some(WORTH_SAYING) => {
            said("No new model data", &[held], Tone::Warning)
        }
        _ if situation.hidden => said("Model too old", &[held], Tone::Warning),
        SessionStatus::Live if situation.surfels == 0 => {
            said("Waiting for the model", &["The first surfels appear in a moment"], Tone::Quiet)
        }
        _ if situation.surfels == 0 => said("Waiting for the model", &["No video has come yet"], Tone::Quiet),
        _ => None,
    }
}

/// One after the other, each with its end.
fn sentences(parts: &[&str]) -> String {
    let ended =
        parts.iter().map(|part| part.trim()).filter(|part| !part.is_empty()).map(|part| {
            if part.ends_with(['.', '!', '?', '…']) { part.to_owned() } else { format!("{part}.") }
        });
    ended.collect::<Vec<_>>().join(" ")
}

fn held(situation: &Situation) -> String {
    let Some(age) = situation.age.filter(|_| situation.surfels > 0) else { return String::new() };
    let shown = if situation.hidden { "is hidden: it is" } else { "shown is" };
    format!("The model {shown} {} old", in_words(age))
}

fn in_words(age: Duration) -> String {
    let seconds = age.as_secs_f64();
    match seconds {
        ..1.0 => format!("{:.0} ms", seconds * 1e3),
        ..90.0 => format!("{seconds:.1} s"),
        _ => format!("{:.0} min", seconds / 60.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL_WELL: Situation = Situation {
        connected: true,
        unknown_session: false,
        notice: "",
        status: SessionStatus::Live,
        status_text: "",
        tracking: TrackingOutcome::Tracked,
        silence: Some(Duration::from_millis(30)),
        age: Some(Duration::from_millis(60)),
        surfels: 1000,
        hidden: false,
    };

    #[test]
    fn nothing_is_said_while_all_is_well() {
        assert_eq!(message_for(&ALL_WELL), None);
    }

    #[test]
    fn each_trouble_has_its_words() {
        let late = Some(Duration::from_secs(4));
        let cases = [
            (Situation { connected: false, notice: "refused", ..ALL_WELL }, "Connection lost"),
            (Situation { unknown_session: true, ..ALL_WELL }, "No such session"),
            (Situation { status: SessionStatus::SourceLost, ..ALL_WELL }, "Source lost"),
            (Situation { status: SessionStatus::Closed, ..ALL_WELL }, "Session closed"),
            (Situation { status: SessionStatus::Degraded, ..ALL_WELL }, "Degraded"),
            (Situation { tracking: TrackingOutcome::Lost, ..ALL_WELL }, "Tracking lost"),
            (Situation { silence: late, ..ALL_WELL }, "No new model data"),
            (Situation { hidden: true, ..ALL_WELL }, "Model too old"),
            (Situation { surfels: 0, ..ALL_WELL }, "Waiting for the model"),
        ];
        for (situation, title) in cases {
            assert_eq!(message_for(&situation).expect("something is said").title, title);
        }
    }

    #[test]
    fn the_age_of_what_is_held_is_said() {
        let lost = Situation { connected: false, age: Some(Duration::from_secs(12)), ..ALL_WELL };
        let message = message_for(&lost).expect("something is said");
        assert_eq!(
            (message.detail.as_str(), message.tone),
            ("Reconnecting … The model shown is 12.0 s old.", Tone::Bad)
        );
    }

    #[test]
    fn nothing_is_lost_before_the_first_connection() {
        let first = Situation {
            connected: false,
            silence: None,
            age: None,
            surfels: 0,
            status: SessionStatus::Unspecified,
            ..ALL_WELL
        };
        assert_eq!(message_for(&first).expect("something is said").title, "Waiting for the model");
    }
}
