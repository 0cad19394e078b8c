//! Lets a real server run for a while and tells whether its memory and its times stay flat:
//!
//! `cargo run --release -p tests --bin soak [-- --minutes 10 --sessions 2]`
//!
//! Carts stream a simulated liver in a loop to a server of its own; each few seconds its resident memory, CPU time and
//! the sessions' figures are read. A straight line is laid through the second half of each series, when caches and the
//! model have been filled: what still grows there grows for ever.

#![expect(clippy::print_stdout, reason = "what a command prints is its result")]

mod series;

use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use series::Series;
use tests::cart::Cart;
use tests::data;
use tests::server::{Server, stored_in};

/// Between two readings.
const INTERVAL: Duration = Duration::from_secs(5);

/// Streams to a server for minutes and tells whether memory and times stay flat.
#[derive(Debug, Parser)]
struct Arguments {
    /// How long.
    #[arg(long, default_value_t = 10.0)]
    minutes: f64,
    /// Sessions at once.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..))]
    sessions: u16,
    /// Columns and rows of the pictures.
    #[arg(long, default_value = "320x240")]
    size: String,
    /// Pairs of the scene that is streamed over and over.
    #[arg(long, default_value_t = 120)]
    frames: u32,
    /// Pairs a second; software Vulkan manages few.
    #[arg(long, default_value_t = 5.0)]
    fps: f64,
    /// Greatest growth of memory that passes for flat, MiB a minute.
    #[arg(long, default_value_t = 2.0)]
    growth_max_mib_per_min: f64,
    /// A setting of the server, `section.key=value`; may be repeated.
    #[arg(long = "set")]
    settings: Vec<String>,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let scratch = match tempfile::tempdir() {
        Ok(scratch) => scratch,
        Err(error) => {
            eprintln!("soak: no temporary directory: {error}");
            return ExitCode::FAILURE;
        }
    };
    let growth_mib_per_min = run(&arguments, scratch.path());
    if growth_mib_per_min <= arguments.growth_max_mib_per_min {
        ExitCode::SUCCESS
    } else {
        println!("NOT FLAT: {growth_mib_per_min:.2} MiB a minute");
        ExitCode::FAILURE
    }
}

/// Prints the series; gives the growth of memory.
fn run(arguments: &Arguments, scratch: &Path) -> f64 {
    let (frames, fps) = (arguments.frames.to_string(), arguments.fps.to_string());
    let scene = ["--size", &arguments.size, "--frames", &frames, "--fps", &fps];
    let recording = data::simulate(scratch, "liver", &scene);
    let directory = stored_in(&scratch.join("data"));
    let settings: Vec<&str> =
        [directory.as_str()].into_iter().chain(arguments.settings.iter().map(String::as_str)).collect();
    let server = Server::start(&settings);
    let cart = |number| Cart::start(&recording, &server.ws(), &format!("soak-{number}"));
    let _carts: Vec<Cart> = (0..arguments.sessions).map(cart).collect();
    let (mut memory, mut load, mut fused) = (Series::default(), Series::default(), Series::default());
    println!("{:>8} {:>12} {:>10} {:>10} {:>10}", "s", "memory MiB", "CPU %", "fused/s", "surfels");
    let started = Instant::now();
    let mut last = (0.0, process_cpu_s(server.process_id()), 0.0);
    while started.elapsed().as_secs_f64() < arguments.minutes * 60.0 {
        std::thread::park_timeout(INTERVAL);
        let now_s = started.elapsed().as_secs_f64();
        let sessions = server.get("/api/sessions");
        let sum = |key: &str| -> f64 {
            sessions.as_array().into_iter().flatten().filter_map(|session| session[key].as_f64()).sum()
        };
        let (cpu_s, frames) = (process_cpu_s(server.process_id()), sum("frames_fused"));
        memory.push(now_s, resident_mib(server.process_id()));
        load.push(now_s, 100.0 * (cpu_s - last.1) / (now_s - last.0));
        fused.push(now_s, (frames - last.2) / (now_s - last.0));
        last = (now_s, cpu_s, frames);
        println!(
            "{now_s:8.0} {:12.1} {:10.0} {:10.2} {:10.0}",
            memory.newest(),
            load.newest(),
            fused.newest(),
            sum("surfels")
        );
    }
    for (name, unit, series) in [("memory", "MiB", &memory), ("CPU", "%", &load), ("fused", "1/s", &fused)] {
        println!("{name:>8}: {:.2} {unit}, {:+.3} {unit} a minute", series.mean(), series.slope_per_min());
    }
    memory.slope_per_min()
}

/// Resident memory of a process; not a number where the system does not tell.
fn resident_mib(process: u32) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kib.map_or(f64::NAN, |kib| kib / 1024.0)
}

/// User and system time of a process; not a number where the system does not tell.
fn process_cpu_s(process: u32) -> f64 {
    /// Clock ticks of Linux's /proc, on all its architectures.
    const TICKS_PER_S: f64 = 100.0;
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    let behind_name = stat.rsplit_once(')').map_or("", |(_, rest)| rest);
    let ticks =
        |field: usize| behind_name.split_whitespace().nth(field).and_then(|text| text.parse::<f64>().ok());
    match (ticks(11), ticks(12)) {
        (Some(user), Some(system)) => (user + system) / TICKS_PER_S,
        _ => f64::NAN,
    }
}
