//! Support for the end-to-end tests: real programs, real sockets, a real browser.

pub mod browser;
pub mod data;
pub mod process;
pub mod server;
