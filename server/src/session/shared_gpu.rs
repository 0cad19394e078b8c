//! The device that all sessions share, opened again once for all of them when it is lost.

use std::sync::{Arc, Mutex, PoisonError};

use gpu::{AdapterSelection, Gpu, GpuError};

/// The present device.
pub struct SharedGpu {
    selection: AdapterSelection,
    current: Mutex<Arc<Gpu>>,
}

impl SharedGpu {
    /// A device that was opened by this selection.
    pub fn new(gpu: Arc<Gpu>, selection: AdapterSelection) -> Self {
        Self { selection, current: Mutex::new(gpu) }
    }

    /// The device as of now.
    pub fn current(&self) -> Arc<Gpu> {
        Arc::clone(&self.current.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The device in the place of a lost one; opened by the first who asks. One that is not lost stays.
    ///
    /// # Errors
    /// As [`Gpu::open`].
    pub fn instead_of(&self, old: &Arc<Gpu>) -> Result<Arc<Gpu>, GpuError> {
        let mut current = self.current.lock().unwrap_or_else(PoisonError::into_inner);
        if Arc::ptr_eq(&current, old) && old.is_lost() {
            *current = Arc::new(Gpu::open(&self.selection)?);
        }
        Ok(Arc::clone(&current))
    }
}
