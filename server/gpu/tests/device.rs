//! The device on whatever Vulkan adapter is present.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{
    AdapterSelection, Clock, FrameRecorder, Gpu, GpuError, Kernel, KernelDeclaration, PrefixSum, Readback,
    StageTimer,
};

const SCALE: KernelDeclaration = KernelDeclaration::new(
    "scale",
    "@group(0) @binding(0) var<uniform> factor: f32;
     @group(0) @binding(1) var<storage, read> source: array<f32>;
     @group(0) @binding(2) var<storage, read_write> scaled: array<f32>;
     @compute @workgroup_size(64) fn scale(@builtin(global_invocation_id) id: vec3<u32>) {
         if id.x < arrayLength(&source) { scaled[id.x] = factor * source[id.x]; }
     }",
    &[Uniform, Read, ReadWrite],
);

fn open() -> Gpu {
    let section: toml::Table = toml::from_str(include_str!("../../../config/server.toml")).unwrap();
    let selection: AdapterSelection = section["gpu"].clone().try_into().unwrap();
    Gpu::open(&selection.with_environment()).unwrap()
}

fn any() -> AdapterSelection {
    AdapterSelection { adapter: String::new() }.with_environment()
}

fn run_two_stages(gpu: &Gpu, clock: Clock) {
    let source: Vec<f32> = (0..345).map(|i| i as f32).collect();
    let input = gpu.storage_from("input", &source).unwrap();
    let (middle, output) =
        (gpu.storage::<f32>("middle", 345).unwrap(), gpu.storage::<f32>("output", 345).unwrap());
    let factor = gpu.uniform("factor", &3.0f32).unwrap();
    let kernel = Kernel::compile(gpu, &SCALE).unwrap();
    let first = kernel.bind(gpu, &[&factor, &input, &middle]).unwrap();
    let second = kernel.bind(gpu, &[&factor, &middle, &output]).unwrap();
    let timer = StageTimer::new(gpu, 8).unwrap();
    let readback = Readback::<f32>::new(gpu, "output", 345).unwrap();
    for _ in 0..2 {
        let mut frame = FrameRecorder::begin(gpu, &timer);
        frame.stage("triple", |stage| stage.run(&first, [345, 1, 1])).unwrap();
        frame.stage("again", |stage| stage.run(&second, [345, 1, 1])).unwrap();
        readback.fetch(&mut frame, &output, 0);
        let times = frame.submit().collect().unwrap();
        assert_eq!(times.stages.iter().map(|stage| stage.name).collect::<Vec<_>>(), ["triple", "again"]);
        assert!(times.stages.iter().all(|stage| stage.clock == clock && stage.ms > 0.0));
        assert_eq!(times.dispatches, 2);
        let nine_fold: Vec<f32> = source.iter().map(|x| 9.0 * x).collect();
        assert_eq!(readback.read(gpu).unwrap(), nine_fold);
    }
}

#[test]
fn a_frame_runs_its_stages_in_order_and_times_each() {
    let gpu = open();
    let clock = if gpu.capabilities().timestamps { Clock::Gpu } else { Clock::Cpu };
    run_two_stages(&gpu, clock);
}

#[test]
fn without_gpu_time_stamps_stages_are_timed_by_the_cpu() {
    run_two_stages(&open().with_plain_paths(), Clock::Cpu);
}

#[test]
fn a_missing_adapter_is_named_with_those_present() {
    let error = Gpu::open(&AdapterSelection { adapter: "no such adapter".to_owned() }).unwrap_err();
    assert!(matches!(&error, GpuError::AdapterNotFound { present, .. } if !present.is_empty()), "{error}");
}

#[test]
fn memory_is_accounted_and_given_back() {
    let gpu = Gpu::open(&any()).unwrap();
    let before = gpu.memory_use();
    let buffer = gpu.storage::<[f32; 4]>("points", 1000).unwrap();
    assert_eq!(gpu.memory_use().current_bytes, before.current_bytes + 16_000);
    drop(buffer);
    assert_eq!(gpu.memory_use().current_bytes, before.current_bytes);
    assert_eq!(gpu.memory_use().peak_bytes, before.peak_bytes + 16_000);
}

#[test]
fn a_buffer_beyond_the_limit_is_refused_before_allocation() {
    let gpu = Gpu::open(&any()).unwrap();
    let error = gpu.storage::<u32>("huge", usize::MAX / 8).unwrap_err();
    assert!(matches!(error, GpuError::BufferTooLarge { .. }), "{error}");
    assert_eq!(gpu.memory_use().current_bytes, 0);
}

#[test]
fn accesses_outside_a_buffer_are_refused() {
    let gpu = Gpu::open(&any()).unwrap();
    let buffer = gpu.storage::<u32>("short", 4).unwrap();
    assert!(matches!(gpu.write(&buffer, 2, &[0; 3]), Err(GpuError::OutOfRange { end: 5, len: 4, .. })));
    assert!(matches!(gpu.read_range(&buffer, usize::MAX, 2), Err(GpuError::OutOfRange { .. })));
}

#[test]
fn fresh_buffers_are_zero_or_poisoned_on_request() {
    let clean = Gpu::open(&any()).unwrap();
    assert_eq!(clean.read(&clean.storage::<u32>("fresh", 5).unwrap()).unwrap(), [0; 5]);
    let poisoned = clean.with_poisoned_buffers();
    let floats = poisoned.read(&poisoned.storage::<f32>("fresh", 5).unwrap()).unwrap();
    assert!(floats.iter().all(|value| value.is_nan()));
}

#[test]
fn a_kernel_refuses_buffers_that_do_not_fit_its_wgsl() {
    let gpu = Gpu::open(&any()).unwrap();
    let kernel = Kernel::compile(&gpu, &SCALE).unwrap();
    let factor = gpu.uniform("factor", &1.0f32).unwrap();
    let floats = gpu.storage::<f32>("floats", 4).unwrap();
    let vectors = gpu.storage::<[f32; 4]>("vectors", 4).unwrap();
    let too_few = kernel.bind(&gpu, &[&factor, &floats]).unwrap_err().to_string();
    assert!(too_few.contains("3 bindings, got 2"), "{too_few}");
    let wrong_kind = kernel.bind(&gpu, &[&floats, &floats, &floats]).unwrap_err().to_string();
    assert!(wrong_kind.contains("factor is Uniform"), "{wrong_kind}");
    let wrong_element = kernel.bind(&gpu, &[&factor, &vectors, &floats]).unwrap_err().to_string();
    assert!(wrong_element.contains("source has 4 bytes, of buffer vectors 16"), "{wrong_element}");
}

#[test]
fn a_kernel_that_differs_from_its_declaration_is_refused() {
    let gpu = Gpu::open(&any()).unwrap();
    let wrong = KernelDeclaration { bindings: &[Uniform, Read, Read], ..SCALE };
    assert!(Kernel::compile(&gpu, &wrong).unwrap_err().to_string().contains("in its WGSL"));
    let renamed = KernelDeclaration { name: "other", ..SCALE };
    assert!(Kernel::compile(&gpu, &renamed).unwrap_err().to_string().contains("entry point is \"scale\""));
}

#[test]
fn a_frame_refuses_more_stages_than_its_timer_holds() {
    let gpu = Gpu::open(&any()).unwrap();
    let timer = StageTimer::new(&gpu, 1).unwrap();
    let mut frame = FrameRecorder::begin(&gpu, &timer);
    frame.stage("one", |_| Ok::<_, GpuError>(())).unwrap();
    assert_eq!(frame.stage("two", |_| Ok(())), Err(GpuError::TooManyStages { limit: 1 }));
}

#[test]
fn a_prefix_sum_agrees_with_the_plain_one_at_awkward_lengths() {
    let gpu = Gpu::open(&any()).unwrap().with_poisoned_buffers();
    let capacity = 70_001;
    let scan = PrefixSum::new(&gpu, capacity).unwrap();
    let timer = StageTimer::new(&gpu, 1).unwrap();
    let flags: Vec<u32> =
        (0..capacity as u32).map(|i| u32::from(i.wrapping_mul(2_654_435_761) >> 29 < 3)).collect();
    gpu.write(&scan.flags, 0, &flags).unwrap();
    for count in [0, 1, 63, 64, 65, 4096, 4097, 70_001] {
        let mut frame = FrameRecorder::begin(&gpu, &timer);
        frame.stage("scan", |stage| scan.record(&gpu, stage, count)).unwrap();
        frame.submit().collect().unwrap();
        let mut sum = 0;
        let expected: Vec<u32> = flags[..count as usize]
            .iter()
            .map(|flag| {
                sum += flag;
                sum - flag
            })
            .collect();
        assert_eq!(gpu.read_range(&scan.offsets, 0, count as usize).unwrap(), expected, "{count}");
        assert_eq!(gpu.read(&scan.total).unwrap(), [sum]);
    }
}
