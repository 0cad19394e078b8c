//! A figure and what it must reach.

use std::fmt;

use crate::outcome::Outcome;

/// What a figure must reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// Smaller is better.
    AtMost(f64),
    /// Larger is better.
    AtLeast(f64),
    /// Printed for comparison.
    None,
}

impl Bound {
    /// Whether `value` reaches it; nothing never does.
    pub fn is_met(self, value: Option<f64>) -> Option<bool> {
        match self {
            Self::AtMost(limit) => Some(value.is_some_and(|value| value <= limit)),
            Self::AtLeast(limit) => Some(value.is_some_and(|value| value >= limit)),
            Self::None => None,
        }
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtMost(limit) => write!(f, "<= {limit}"),
            Self::AtLeast(limit) => write!(f, ">= {limit}"),
            Self::None => write!(f, "-"),
        }
    }
}

/// One figure of a row.
#[derive(Clone, Copy)]
pub struct Figure {
    /// What it is, with its unit.
    pub label: &'static str,
    /// What the paper reached, in its words.
    pub anchor: &'static str,
    /// What it must reach.
    pub bound: Bound,
    /// Takes it from a replay's outcome.
    pub value: fn(&Outcome) -> Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_that_could_not_be_computed_is_missed() {
        assert_eq!(Bound::AtMost(1.0).is_met(None), Some(false));
        assert_eq!(Bound::AtMost(1.0).is_met(Some(1.0)), Some(true));
        assert_eq!(Bound::AtLeast(0.7).is_met(Some(0.69)), Some(false));
        assert_eq!(Bound::AtMost(1.0).is_met(Some(f64::NAN)), Some(false));
        assert_eq!(Bound::None.is_met(Some(3.0)), None);
    }
}
