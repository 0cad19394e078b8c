//! End-to-end, fault and evaluation tests.
