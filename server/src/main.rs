//! The `mis-slam` command line.

fn main() -> std::process::ExitCode {
    mis_slam::cli::run()
}
