//! Streams a recording or a camera to a reconstruction server.
