//! Sessions: one patient, one rig, one tracker, one model.

pub mod mailbox;
pub mod quality;
pub mod worker;
