//! Where have I been before? Places are recognised by what they look like, without a vocabulary learnt beforehand.

mod candidates;
mod index;
mod table;

pub use candidates::{Candidate, candidates};
pub use index::PlaceIndex;
