//! `mis-slam doctor`: what on this machine is ready, and what is not.

use std::net::{SocketAddr, TcpListener};

use clap::Args;

use super::{Failure, Outcome};
use crate::config::Config;
use crate::ingest;

/// Check drivers, adapter, page, port and zenoh on this machine.
#[derive(Debug, Args)]
pub struct Doctor {}

/// One line of the report.
struct Finding {
    what: &'static str,
    verdict: Result<String, String>,
}

impl Doctor {
    pub(super) fn run(&self, config: &Config) -> Outcome {
        let findings = examine(config);
        for finding in &findings {
            let (mark, text) = match &finding.verdict {
                Ok(text) => ("ok     ", text),
                Err(text) => ("problem", text),
            };
            println!("{mark}  {:8} {text}", finding.what);
        }
        let problems = findings.iter().filter(|finding| finding.verdict.is_err()).count();
        if problems == 0 { Ok(()) } else { Err(Failure::failed(format!("{problems} problem(s) found"))) }
    }
}

fn examine(config: &Config) -> Vec<Finding> {
    let mut findings: Vec<Finding> = gpu::list_adapters()
        .into_iter()
        .map(|adapter| Finding {
            what: "adapter",
            verdict: Ok(format!("{} ({}, {})", adapter.name, adapter.kind, adapter.driver)),
        })
        .collect();
    findings.extend([
        Finding { what: "device", verdict: device(&config.gpu) },
        Finding { what: "page", verdict: page() },
        Finding { what: "http", verdict: port(&config.server.listen) },
        Finding { what: "zenoh", verdict: zenoh(config) },
    ]);
    findings
}

fn device(selection: &gpu::AdapterSelection) -> Result<String, String> {
    let gpu = gpu::Gpu::open(&selection.clone().with_environment()).map_err(|error| error.to_string())?;
    let (adapter, can) = (gpu.description(), gpu.capabilities());
    Ok(format!(
        "{}: {} MiB per binding, {} storage buffers per kernel, timestamps {}, subgroups {}",
        adapter.name,
        adapter.max_binding_bytes >> 20,
        adapter.max_storage_buffers,
        yes_no(can.timestamps),
        yes_no(can.subgroups),
    ))
}

fn page() -> Result<String, String> {
    if crate::http::page::is_built() {
        Ok("built into this program".into())
    } else {
        Err("not built into this program: run config/setup.sh, then build again".into())
    }
}

fn port(listen: &SocketAddr) -> Result<String, String> {
    TcpListener::bind(listen)
        .map(|_| format!("{listen} is free"))
        .map_err(|error| format!("{listen}: {error}"))
}

fn zenoh(config: &Config) -> Result<String, String> {
    if !config.zenoh.enabled {
        return Ok("disabled by zenoh.enabled".into());
    }
    let runtime = super::serve::runtime().map_err(|failure| format!("{failure:?}"))?;
    runtime.block_on(async {
        let opened = ingest::zenoh::open(&config.zenoh, config.server.message_max_bytes()).await;
        let session = opened.map_err(|error| error.to_string())?;
        session.close().await.map_err(|error| error.to_string())?;
        Ok(format!("{} can be listened on", config.zenoh.listen.join(", ")))
    })
}

fn yes_no(value: bool) -> &'static str {
    if value { "yes" } else { "no" }
}
