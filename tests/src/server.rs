//! A real `mis-slam serve` on loopback ports of its own.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::process;

/// Long enough for a loaded two-core machine with software Vulkan.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// A running server; killed when dropped.
pub struct Server {
    child: Child,
    /// `http://127.0.0.1:PORT`.
    pub http: String,
    /// `tcp/127.0.0.1:PORT`.
    pub zenoh: String,
}

/// The setting that keeps what a server stores in this folder.
pub fn stored_in(directory: &Path) -> String {
    format!("storage.directory={}", directory.display())
}

impl Server {
    /// Starts a server and waits until it says where it listens.
    pub fn start(settings: &[&str]) -> Self {
        let mut command = process::program("mis-slam");
        command.arg("serve");
        Self::run(command, settings)
    }

    /// As [`Self::start`], with a window on the last session on this X display.
    pub fn start_with_window(display: &str, settings: &[&str]) -> Self {
        let mut command = process::program("mis-slam");
        command.args(["serve", "--view"]).env("DISPLAY", display).env_remove("WAYLAND_DISPLAY");
        Self::run(command, settings)
    }

    fn run(mut command: Command, settings: &[&str]) -> Self {
        command.args(["--set", "server.listen=127.0.0.1:0", "--set", "zenoh.listen=['tcp/127.0.0.1:0']"]);
        // Nothing is left behind unless a test says where.
        command.args(["--set", "storage.directory=", "--set", "storage.free_min_mib=0"]);
        for setting in settings {
            command.args(["--set", setting]);
        }
        let mut child = command.stdout(Stdio::piped()).spawn().expect("the server starts");
        let mut lines = BufReader::new(child.stdout.take().expect("stdout is piped")).lines();
        let mut announced = |what: &str| loop {
            let line = lines.next().expect("the server says where it listens").expect("readable output");
            if let Some(address) = line.strip_prefix(what) {
                break address.trim().to_string();
            }
        };
        let (http, zenoh) = (announced("http "), announced("zenoh "));
        Self { child, http, zenoh }
    }

    /// The same address for WebSocket clients.
    pub fn ws(&self) -> String {
        self.http.replacen("http", "ws", 1)
    }

    /// POST of a JSON body, the answer parsed.
    pub fn post(&self, path: &str, body: &Value) -> Value {
        let response = ureq::post(format!("{}{path}", self.http)).send_json(body);
        response.expect("an answer").body_mut().read_json().expect("a JSON answer")
    }

    /// DELETE.
    pub fn delete(&self, path: &str) {
        ureq::delete(format!("{}{path}", self.http)).call().expect("an answer");
    }

    /// GET of a file.
    pub fn get_bytes(&self, path: &str) -> Vec<u8> {
        let mut response = ureq::get(format!("{}{path}", self.http)).call().expect("an answer");
        let limited = response.body_mut().with_config().limit(1 << 30);
        limited.read_to_vec().expect("its bytes")
    }

    /// GET, parsed.
    pub fn get(&self, path: &str) -> Value {
        let response = ureq::get(format!("{}{path}", self.http)).call();
        response.expect("an answer").body_mut().read_json().expect("a JSON answer")
    }

    /// The server's process.
    pub fn process_id(&self) -> u32 {
        self.child.id()
    }

    /// Waits until `condition` finds what it looks for in the answer to GET `path`.
    ///
    /// # Panics
    /// After [`PATIENCE`], with the last answer.
    pub fn wait_for<T>(&self, path: &str, condition: impl Fn(&Value) -> Option<T>) -> T {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let answer = self.get(path);
            if let Some(found) = condition(&answer) {
                return found;
            }
            assert!(Instant::now() < deadline, "gave up waiting on {path}: {answer:#}");
            std::thread::park_timeout(Duration::from_millis(50));
        }
    }

    /// Waits until what was on its way to the model of the session at `path` is fused and published.
    pub fn wait_until_still(&self, path: &str) {
        let mut epoch_since = (self.get(path)["epoch"].clone(), Instant::now());
        while epoch_since.1.elapsed() < Duration::from_secs(4) {
            std::thread::park_timeout(Duration::from_millis(100));
            let epoch = self.get(path)["epoch"].clone();
            if epoch != epoch_since.0 {
                epoch_since = (epoch, Instant::now());
            }
        }
    }

    /// SIGTERM, then waits for the end.
    pub fn terminate(&mut self) -> std::process::ExitStatus {
        let mut kill = Command::new("kill");
        process::run({
            kill.args(["-TERM", &self.child.id().to_string()]);
            kill
        });
        self.child.wait().expect("the server ends")
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
