//! Support for the end-to-end tests: real programs, real sockets, a real browser.

#![expect(clippy::panic, reason = "a test support function fails by panicking, with what it saw")]

pub mod browser;
pub mod cart;
pub mod data;
pub mod display;
pub mod process;
pub mod server;
