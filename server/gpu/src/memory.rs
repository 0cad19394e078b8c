//! How many bytes this device's buffers hold.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes in this device's buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryUse {
    /// Held now.
    pub current_bytes: u64,
    /// The most ever held.
    pub peak_bytes: u64,
}

#[derive(Debug, Default)]
pub(crate) struct Ledger {
    current: AtomicU64,
    peak: AtomicU64,
}

impl Ledger {
    pub(crate) fn memory_use(&self) -> MemoryUse {
        MemoryUse {
            current_bytes: self.current.load(Ordering::Relaxed),
            peak_bytes: self.peak.load(Ordering::Relaxed),
        }
    }
}

/// An entry in the ledger, struck out when the buffer that owns it goes.
#[derive(Debug)]
pub(crate) struct Allocation {
    ledger: Arc<Ledger>,
    bytes: u64,
}

impl Allocation {
    pub(crate) fn new(ledger: &Arc<Ledger>, bytes: u64) -> Self {
        let now = ledger.current.fetch_add(bytes, Ordering::Relaxed) + bytes;
        ledger.peak.fetch_max(now, Ordering::Relaxed);
        Self { ledger: ledger.clone(), bytes }
    }
}

impl Drop for Allocation {
    fn drop(&mut self) {
        self.ledger.current.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}
