//! The `mis-slam-cart` command line.
fn main() {}
