//! The `mis-slam-view` command line.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use clap::{Parser, ValueEnum};
use geometry::Pose;
use geometry::viewpoint::{self, OVERVIEW_HALF_OPENING_TANGENT};
use gpu::{AdapterSelection, Gpu};
use mis_slam_view::window::{self, ModelEvent, WindowOptions};
use mis_slam_view::{Feed, FeedOptions, Look, RemoteModel, Stereo, ViewControl, ViewerError, screenshot};
use nalgebra::Point3;
use protocol::{Endpoint, SessionId};
use render::Coloring;
use tracing_subscriber::EnvFilter;

const EXAMPLES: &str = "\
Examples:
  mis-slam-view --to ws://gpu-box:8088 --session theatre-3
  mis-slam-view --to zenoh/tcp/gpu-box:7447 --session theatre-3 --follow --stereo half --full-screen
  mis-slam-view --to ws://gpu-box:8088 --session theatre-3 --headless --screenshot model.png --size 1280x960";

/// Shows a session's model in a window, or draws it to a file.
#[derive(Debug, Parser)]
#[command(name = "mis-slam-view", version, after_help = format!("{}\n\n{EXAMPLES}", window::KEYS))]
struct Cli {
    /// The server: ws://HOST:PORT or zenoh/tcp/HOST:PORT.
    #[arg(long, value_name = "ADDRESS")]
    to: Endpoint,
    /// The session to show.
    #[arg(long, value_name = "ID")]
    session: SessionId,
    /// An access token, where the server wants one (ws:// only).
    #[arg(long, value_name = "TOKEN", env = "MIS_SLAM_TOKEN", hide_env_values = true)]
    token: Option<String>,
    /// Looks through the scope.
    #[arg(long, conflicts_with_all = ["eye", "pose"])]
    follow: bool,
    /// Looks from this point, x,y,z in metres, at the target.
    #[arg(long, value_name = "X,Y,Z", requires = "target", allow_hyphen_values = true, value_parser = viewpoint::point_from_text)]
    eye: Option<Point3<f64>>,
    /// What is in the middle.
    #[arg(long, value_name = "X,Y,Z", requires = "eye", allow_hyphen_values = true, value_parser = viewpoint::point_from_text)]
    target: Option<Point3<f64>>,
    /// Looks from this pose: `world_from_camera`, metres and a unit quaternion.
    #[arg(long, value_name = "TX,TY,TZ,QX,QY,QZ,QW", conflicts_with = "eye", allow_hyphen_values = true, value_parser = viewpoint::pose_from_text)]
    pose: Option<Pose>,
    /// With an eye or a pose: the angle by which the shorter side opens, degrees.
    #[arg(long, value_name = "DEG", value_parser = opening)]
    opening_deg: Option<f64>,
    /// How surfels are coloured.
    #[arg(long, value_enum, default_value = "colour")]
    coloring: ColoringName,
    /// A picture for each eye, side by side: half, squeezed as 3-D monitors take it; full, of the right proportions.
    #[arg(long, value_enum)]
    stereo: Option<StereoName>,
    /// Between the eyes, mm; a thirtieth of the distance to the model where none is given.
    #[arg(long, value_name = "MM", value_parser = positive)]
    eye_separation_mm: Option<f64>,
    /// Hides a model that is older than this, seconds.
    #[arg(long, value_name = "S", value_parser = positive)]
    hide_after: Option<f64>,
    /// The model alone: no fading where it is stale, no banner.
    #[arg(long)]
    plain: bool,
    /// Size of window or picture.
    #[arg(long, value_name = "WxH", default_value = "1280x960", value_parser = size)]
    size: (u32, u32),
    /// On the whole screen.
    #[arg(long)]
    full_screen: bool,
    /// Where key P writes what is seen; with --headless, where the picture goes.
    #[arg(long, value_name = "FILE.png", default_value = "model.png")]
    screenshot: PathBuf,
    /// Draws one picture without a window, once the model has come, and ends.
    #[arg(long)]
    headless: bool,
    /// With --headless: gives up after this time, seconds.
    #[arg(long, value_name = "S", default_value_t = 30.0, value_parser = positive)]
    timeout: f64,
    /// The GPU: part of its name or its number; `MIS_SLAM_ADAPTER` counts more.
    #[arg(long, value_name = "NAME", default_value = "")]
    adapter: String,
}

/// The colourings by their names.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum ColoringName {
    Colour,
    Shape,
    Normal,
    Confidence,
}

/// The ways to divide a frame between the eyes.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum StereoName {
    Half,
    Full,
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|error| format!("{error}"))?;
    if (1e-3..=1e6).contains(&value) { Ok(value) } else { Err("must be between 0.001 and 1000000".into()) }
}

fn opening(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|error| format!("{error}"))?;
    let range = protocol::limits::PICTURE_OPENINGS_DEG;
    if range.contains(&value) {
        return Ok(value);
    }
    Err(format!("must be between {} and {}", range.start(), range.end()))
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| text.parse().ok().filter(|side| (16..=8192).contains(side));
    let sides = text.split_once('x').and_then(|(width, height)| Some((side(width)?, side(height)?)));
    sides.ok_or_else(|| "must be WIDTHxHEIGHT, 16 to 8192 each".to_owned())
}

impl Cli {
    fn view(&self) -> Result<ViewControl, String> {
        let half_opening_tangent = self
            .opening_deg
            .map_or(OVERVIEW_HALF_OPENING_TANGENT, |opening_deg| (opening_deg.to_radians() / 2.0).tan());
        let looked = self.eye.zip(self.target).map(|(eye, target)| {
            viewpoint::looking_at(&eye, &target).ok_or("--eye and --target are one point")
        });
        let world_from_camera = looked.transpose()?.or(self.pose);
        if self.opening_deg.is_some() && world_from_camera.is_none() {
            return Err("--opening-deg goes with --eye or --pose".into());
        }
        let fixed = world_from_camera.map(|pose| ViewControl::at(&pose, half_opening_tangent));
        Ok(fixed.unwrap_or_else(|| ViewControl::new(self.follow)))
    }

    fn look(&self) -> Look {
        Look {
            coloring: match self.coloring {
                ColoringName::Colour => Coloring::Colour,
                ColoringName::Shape => Coloring::Shape,
                ColoringName::Normal => Coloring::Normal,
                ColoringName::Confidence => Coloring::Confidence,
            },
            stereo: match self.stereo {
                None => Stereo::Off,
                Some(StereoName::Half) => Stereo::HalfWidth,
                Some(StereoName::Full) => Stereo::FullWidth,
            },
            eye_separation_m: self.eye_separation_mm.map(|mm| mm * 1e-3),
            plain: self.plain,
        }
    }
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("error"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    let view = match cli.view() {
        Ok(view) => view,
        Err(problem) => {
            eprintln!("mis-slam-view: {problem}");
            return ExitCode::from(2);
        }
    };
    match show(&cli, view) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("mis-slam-view: {error}");
            ExitCode::from(1)
        }
    }
}

fn show(cli: &Cli, view: ViewControl) -> Result<(), ViewerError> {
    let feed = FeedOptions { to: cli.to.clone(), session: cli.session.clone(), token: cli.token.clone() };
    let hide_after = cli.hide_after.map(Duration::from_secs_f64);
    let selection = AdapterSelection { adapter: cli.adapter.clone() }.with_environment();
    let gpu = Arc::new(Gpu::open(&selection)?);
    if cli.headless {
        let mut model = RemoteModel::new(&gpu, Feed::start(feed, || ())?, hide_after)?;
        let patience = Duration::from_secs_f64(cli.timeout);
        let picture = (cli.screenshot.as_path(), cli.size, patience);
        return screenshot::take(&gpu, &mut model, (view, cli.look()), picture);
    }
    let (events, proxy) = window::event_loop()?;
    let changed = move || {
        // The window may have been closed already.
        let _ = proxy.send_event(ModelEvent::Changed);
    };
    let model = RemoteModel::new(&gpu, Feed::start(feed, changed)?, hide_after)?;
    let options = WindowOptions {
        title: format!("{} - MIS-SLAM", cli.session),
        size_px: cli.size,
        full_screen: cli.full_screen,
        pictures: cli.screenshot.clone(),
    };
    window::run(events, gpu, model, (view, cli.look()), options)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(arguments: &[&str]) -> Result<Cli, clap::Error> {
        let always = ["mis-slam-view", "--to", "ws://a:1", "--session", "s"];
        Cli::try_parse_from(always.iter().chain(arguments))
    }

    #[test]
    fn the_options_are_consistent_and_poses_may_be_negative() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
        assert!(parsed(&["--eye", "-1,0,0", "--target", "0,0,0"]).unwrap().view().is_ok());
        assert!(parsed(&["--pose", "-1,0,0,0,0,0,1", "--opening-deg", "60"]).unwrap().view().is_ok());
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        for wrong in [
            &["--eye", "0,0,0"][..],
            &["--pose", "0,0,0,0,0,0,0"],
            &["--follow", "--pose", "0,0,0,0,0,0,1"],
            &["--size", "0x9"],
            &["--opening-deg", "NaN"],
            &["--hide-after", "-1"],
            &["--session", "a b"],
        ] {
            assert!(parsed(wrong).is_err(), "{wrong:?}");
        }
        assert!(parsed(&["--opening-deg", "50"]).unwrap().view().is_err());
        assert!(parsed(&["--eye", "1,1,1", "--target", "1,1,1"]).unwrap().view().is_err());
    }
}
