//! The crate's errors.

/// What can go wrong between opening a device and reading a result back.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GpuError {
    /// No Vulkan driver, not even a software one.
    #[error(
        "no Vulkan adapter found; run config/setup.sh, or on Debian and Ubuntu: \
         apt-get install libvulkan1 mesa-vulkan-drivers"
    )]
    NoVulkan,
    /// The wanted adapter is not among those present.
    #[error("no adapter matches \"{wanted}\"; present: {}", present.join(", "))]
    AdapterNotFound {
        /// Substring of the name, or an index.
        wanted: String,
        /// Names of the adapters present, in index order.
        present: Vec<String>,
    },
    /// The driver refused to make a device.
    #[error("adapter \"{adapter}\" gives no device: {reason}")]
    NoDevice {
        /// Adapter name.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
    /// A driver that falls short of what the kernels need.
    #[error("adapter \"{adapter}\" offers {offered} storage buffers per kernel; {needed} are needed")]
    TooFewBuffers {
        /// Adapter name.
        adapter: String,
        /// The adapter's limit.
        offered: u32,
        /// [`crate::STORAGE_BUFFERS`].
        needed: u32,
    },
    /// The device is gone; it must be opened again.
    #[error("the GPU device is lost: {reason}")]
    DeviceLost {
        /// The driver's words.
        reason: String,
    },
    /// The device has no memory left.
    #[error("GPU memory is exhausted at {what} ({bytes} bytes; {in_use_bytes} bytes in use)")]
    OutOfMemory {
        /// Label of the buffer or action.
        what: String,
        /// Size asked for; 0 where unknown.
        bytes: u64,
        /// What this device's buffers hold.
        in_use_bytes: u64,
    },
    /// A buffer beyond what one binding of this adapter can address.
    #[error("buffer {label} of {bytes} bytes exceeds this adapter's limit of {limit_bytes} bytes")]
    BufferTooLarge {
        /// Buffer label.
        label: String,
        /// Size asked for.
        bytes: u64,
        /// The adapter's limit.
        limit_bytes: u64,
    },
    /// An access outside a buffer.
    #[error("elements {start}..{end} lie outside buffer {label} of {len}")]
    OutOfRange {
        /// Buffer label.
        label: String,
        /// First element.
        start: usize,
        /// One past the last element.
        end: usize,
        /// Elements in the buffer.
        len: usize,
    },
    /// A kernel that does not compile, or does not match its declaration or its buffers.
    #[error("kernel {kernel}: {reason}")]
    Kernel {
        /// Kernel name.
        kernel: String,
        /// What does not fit.
        reason: String,
    },
    /// A dispatch beyond the adapter's workgroup count.
    #[error("kernel {kernel}: {workgroups} workgroups exceed this adapter's {limit} per dimension")]
    DispatchTooLarge {
        /// Kernel name.
        kernel: String,
        /// Workgroups along the largest dimension.
        workgroups: u32,
        /// The adapter's limit.
        limit: u32,
    },
    /// More stages in one frame than the timer has room for.
    #[error("a frame has more than {limit} stages")]
    TooManyStages {
        /// Stages the timer was made for.
        limit: u32,
    },
    /// The driver refused an action; a defect in this program.
    #[error("GPU validation failed: {0}")]
    Validation(String),
}
