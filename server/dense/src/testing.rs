//! What the tests of this crate share.

use std::sync::{Arc, OnceLock};

use gpu::{AdapterSelection, Gpu};

use crate::DenseConfig;

/// The shipped configuration.
pub fn config() -> DenseConfig {
    let file: toml::Table = toml::from_str(include_str!("../../../config/server.toml")).unwrap();
    file["dense"].clone().try_into().unwrap()
}

/// One device with poisoned buffers for all tests.
pub fn gpu() -> Arc<Gpu> {
    static GPU: OnceLock<Arc<Gpu>> = OnceLock::new();
    let open = || {
        let selection = AdapterSelection { adapter: String::new() }.with_environment();
        Arc::new(Gpu::open(&selection).unwrap().with_poisoned_buffers())
    };
    GPU.get_or_init(open).clone()
}
