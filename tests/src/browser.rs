//! A real headless Chromium on the server's page, driven by `clients/web/e2e/observe.mjs`.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use serde_json::Value;

use crate::data;

/// What to wait for on which page.
pub struct Observation<'a> {
    /// `http://…` of the server.
    pub url: &'a str,
    /// The session to open; the list of sessions where `None`.
    pub session: Option<&'a str>,
    /// A JavaScript expression over `misSlam` that ends the observation.
    pub until: &'a str,
    /// Where the last picture goes.
    pub screenshot: &'a Path,
}

/// A browser at work.
pub struct Browser {
    child: Child,
    lines: std::io::Lines<BufReader<ChildStdout>>,
}

/// What a browser saw.
#[derive(Debug, Default)]
pub struct Seen {
    /// The last status of the page (`window.misSlam`).
    pub status: Value,
    /// Errors and warnings on the console.
    pub console: Vec<String>,
    /// Whether the condition came true.
    pub fulfilled: bool,
    /// Whether the screenshot shows something.
    pub not_blank: bool,
}

impl Browser {
    /// Opens the page; the condition has [`crate::server::PATIENCE`] to come true.
    ///
    /// # Panics
    /// Where Node cannot be started.
    pub fn open(observation: &Observation) -> Self {
        let mut command = Command::new("node");
        command.arg(data::workspace().join("clients/web/e2e/observe.mjs"));
        command.arg(observation.url).args(["--until", observation.until]);
        command.args(["--seconds", &crate::server::PATIENCE.as_secs().to_string()]);
        command.arg("--screenshot").arg(observation.screenshot);
        if let Some(session) = observation.session {
            command.args(["--session", session]);
        }
        let mut child = command.stdout(Stdio::piped()).spawn().expect("node runs");
        let lines = BufReader::new(child.stdout.take().expect("stdout is piped")).lines();
        Self { child, lines }
    }

    /// Waits for the condition.
    ///
    /// # Panics
    /// Where the browser does not say how it ended.
    pub fn finish(mut self) -> Seen {
        let mut seen = Seen::default();
        for line in self.lines.by_ref() {
            let line = line.expect("readable output");
            let mut message: Value =
                serde_json::from_str(&line).unwrap_or_else(|error| panic!("{line}: {error}"));
            if let Some(status) = message.get_mut("status") {
                seen.status = status.take();
            } else if let Some(text) = message["console"].as_str() {
                seen.console.push(text.to_string());
            } else {
                seen.fulfilled = message["end"] == "until";
                seen.not_blank = message["not_blank"] == true;
            }
        }
        self.child.wait().expect("the browser ends");
        seen
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
