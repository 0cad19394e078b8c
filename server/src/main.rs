//! The `mis-slam` command line.
fn main() {}
