//! The `mis-slam-cart` command line.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use mis_slam_cart::{
    CartConfig, CartError, Encoding, Endpoint, Progress, PublishOptions, PublishReport, publish_recording,
};
use protocol::SessionId;
use tracing_subscriber::EnvFilter;

/// Streams a recording or a folder of image pairs to a reconstruction server, at the pace of its stamps.
#[derive(Debug, Parser)]
#[command(name = "mis-slam-cart", version)]
struct Cli {
    /// The recording (MCAP), or a folder with left/, right/ and a rig file.
    #[arg(value_name = "REC.mcap|FOLDER")]
    source: PathBuf,
    /// A rig file (config/rigs/*.toml) in place of the folder's own rig.toml.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// How images travel: as jpeg; raw, for a server on the same machine; or unchanged.
    #[arg(long, value_enum, default_value = "jpeg")]
    encoding: EncodingName,
    /// The takeover token of a session that another cart feeds.
    #[arg(long, value_name = "TOKEN", env = "MIS_SLAM_TAKEOVER", hide_env_values = true)]
    takeover: Option<String>,
    /// The server: ws://HOST:PORT or zenoh/tcp/HOST:PORT.
    #[arg(long, value_name = "ADDRESS")]
    to: Endpoint,
    /// The session to feed: 1 to 64 characters of A-Z a-z 0-9 _ -. Without it a new one gets an id.
    #[arg(long, value_name = "ID")]
    session: Option<SessionId>,
    /// Times the recorded pace.
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = positive)]
    rate: f64,
    /// Start over at the end, until stopped.
    #[arg(long = "loop")]
    repeat: bool,
    /// A configuration file laid over the defaults of config/server.toml; [recording] and [cart] are read.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// One option, laid over defaults and file; may be repeated.
    #[arg(long = "set", value_name = "SECTION.KEY=VALUE")]
    overrides: Vec<String>,
}

/// The encodings by their names.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum EncodingName {
    Jpeg,
    Raw,
    Unchanged,
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|error| format!("{error}"))?;
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err("must be positive".into()) }
}

#[tokio::main]
async fn main() -> ExitCode {
    let cli = Cli::parse();
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn,zenoh=error"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    match stream(cli).await {
        Ok(report) => {
            eprint!("{}", describe(&report));
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("mis-slam-cart: {error}");
            ExitCode::from(if error.is_bad_input() { 2 } else { 1 })
        }
    }
}

async fn stream(cli: Cli) -> Result<PublishReport, CartError> {
    let config = CartConfig::load(cli.config.as_deref(), &cli.overrides)?;
    let options = PublishOptions {
        source: cli.source,
        rig_file: cli.calibration,
        encoding: match cli.encoding {
            EncodingName::Jpeg => Encoding::Jpeg { quality: config.cart.jpeg_quality },
            EncodingName::Raw => Encoding::Raw,
            EncodingName::Unchanged => Encoding::Unchanged,
        },
        takeover_token: cli.takeover,
        to: cli.to,
        session: cli.session,
        rate: cli.rate,
        repeat: cli.repeat,
    };
    let mut display = Display::new();
    let interrupted = async {
        // Without signals there is only the end of the recording.
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
    };
    let streamed = publish_recording(&options, &config, |progress| display.show(progress), interrupted).await;
    display.finish();
    streamed
}

/// A bar on a terminal, one line per session otherwise.
struct Display {
    bar: ProgressBar,
    announced: bool,
}

impl Display {
    fn new() -> Self {
        let bar =
            if std::io::stderr().is_terminal() { ProgressBar::no_length() } else { ProgressBar::hidden() };
        let style = ProgressStyle::with_template("{bar:30} {pos}/{len} pairs  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { bar, announced: false }
    }

    fn show(&mut self, progress: &Progress) {
        if !self.announced {
            self.announced = true;
            self.bar.suspend(|| eprintln!("feeding session {}", progress.session));
            self.bar.set_length(progress.expected.unwrap_or_default());
        }
        let expected = progress.expected.unwrap_or_default().max(1);
        self.bar.set_position((progress.sent.saturating_sub(1)) % expected + 1);
        self.bar.set_message(format!("{} poses, {:.0} ms", progress.poses, progress.latency_ms));
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

fn describe(report: &PublishReport) -> String {
    let mut text = format!(
        "session {}: {} pairs sent, {} skipped, {} poses received",
        report.session, report.sent, report.skipped, report.poses
    );
    if let Some(latency) = report.latency {
        text += &format!(", latency {:.0} ms (95 %: {:.0} ms)", latency.median_ms, latency.p95_ms);
    }
    if report.reconnects > 0 {
        text += &format!(", {} reconnects", report.reconnects);
    }
    for (reason, count) in &report.refused {
        text += &format!("\n  refused {count}: {reason}");
    }
    text + "\n"
}
