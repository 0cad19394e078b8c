//! Shows a session's model: in a window, in mono or side by side for 3-D monitors, or drawn once to a file.
//!
//! [`Feed`] follows a session over WebSocket or zenoh on a thread of its own, comes back by itself where the connection
//! breaks, and keeps a [`Scene`] up to date. [`window`] and [`screenshot`] draw what a [`Shown`] holds: that scene, or the
//! arrays of a model in the same process.

mod age;
mod banner;
mod error;
mod feed;
mod followed;
mod frame;
mod link;
mod remote;
mod scene;
pub mod screenshot;
mod shown;
mod stereo;
mod text;
mod view_control;
pub mod window;

pub use age::STALE_AFTER;
pub use banner::Message;
pub use error::ViewerError;
pub use feed::{Feed, FeedOptions};
pub use frame::Look;
pub use remote::RemoteModel;
pub use scene::Scene;
pub use shown::{Shown, Status};
pub use stereo::Stereo;
pub use view_control::{Camera, ViewControl};
