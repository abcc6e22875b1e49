//! The metrics over HTTP: what is answered and what is not, and Prometheus's own tools on the result.

use std::io::Write as _;
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::support::http::{ask, body, free_address};
use crate::support::prerequisite::{Missing, Prerequisite, require};
use crate::support::process::{Folder, Process};
use crate::support::waiting::{described, wait_for, wait_until};

/// A gateway on the demo recording, with metrics.
pub(super) struct Gateway {
    process: Process,
    pub(super) address: SocketAddr,
    _folder: Folder,
}

impl Gateway {
    pub(super) fn run(keys: &str) -> Self {
        let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/config/demo.log.gz");
        let address = free_address();
        let keys = format!(
            "source = \"recording\"\n[recording]\nfile = \"{recording}\"\nrepeat = true\n[ros]\nenabled = false\n\
             [http]\naddress = \"{address}\"\n{keys}"
        );
        let folder = Folder::with_demo_vehicle("can0", &keys);
        let process = Process::run(&folder);
        let gateway = Self { process, address, _folder: folder };
        wait_until(described(|| format!("metrics: {:?}", gateway.process.log())), || {
            gateway.get("/metrics").starts_with("HTTP/1.1 200 ")
        });
        gateway
    }

    pub(super) fn get(&self, path: &str) -> String {
        self.ask(&format!("GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", self.address))
    }

    /// The answer to a request, which is repeated when the server has waited too long for the request or for
    /// the gateway.
    pub(super) fn ask(&self, request: &str) -> String {
        let what = described(|| format!("an answer to {request}: {:?}", self.process.log()));
        let is_answer = |text: &String| !text.is_empty() && !text.ends_with("the gateway does not answer\n");
        wait_for(what, || ask(self.address, request).filter(is_answer))
    }
}

#[test]
fn metrics_are_served_in_both_forms_with_the_state_of_the_gateway() {
    let gateway = Gateway::run("");
    let classic = gateway.get("/metrics");
    assert!(classic.contains("content-type: text/plain; version=0.0.4"), "{classic}");
    for line in [
        "# TYPE signal_gateway_report_failures_total counter",
        "# TYPE signal_gateway_build_info gauge",
        "signal_gateway_bus_link_up{bus=\"body\",interface=\"can0\"} 1",
    ] {
        assert!(body(&classic).lines().any(|found| found.starts_with(line)), "{line}\n{classic}");
    }
    assert!(!classic.contains("# EOF"));
    let accept = "Accept: application/openmetrics-text;version=1.0.0,text/plain;q=0.5";
    let open = gateway.ask(&format!("GET /metrics HTTP/1.1\r\nHost: localhost\r\n{accept}\r\n\r\n"));
    assert!(open.contains("content-type: application/openmetrics-text; version=1.0.0"), "{open}");
    assert!(
        open.ends_with("# EOF\n") && open.contains("# TYPE signal_gateway_report_failures counter\n"),
        "{open}"
    );
    assert!(open.to_lowercase().contains("x-content-type-options: nosniff"));
}

#[test]
fn other_hosts_methods_and_paths_are_refused_and_garbage_harms_nobody() {
    let gateway = Gateway::run("hosts = [\"car.local\"]\n");
    let code = |answer: String| answer.split(' ').nth(1).unwrap_or("").to_owned();
    let status = |request: &str| code(gateway.ask(request));
    assert_eq!(status("GET /metrics HTTP/1.1\r\nHost: evil.example\r\n\r\n"), "421");
    assert_eq!(status("GET /metrics HTTP/1.1\r\nHost: CAR.local:80\r\n\r\n"), "200");
    assert_eq!(status("GET /metrics HTTP/1.0\r\n\r\n"), "421", "no host");
    for method in ["POST", "PUT", "DELETE", "OPTIONS"] {
        assert_eq!(
            status(&format!("{method} /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n")),
            "405",
            "{method}"
        );
    }
    assert_eq!(status("GET /metric HTTP/1.1\r\nHost: localhost\r\n\r\n"), "404");
    let long = format!("GET /metrics HTTP/1.1\r\nHost: localhost\r\nX: {}\r\n\r\n", "x".repeat(100_000));
    for garbage in ["\0\0\0\0\r\n\r\n", "GET\r\n\r\n", &long] {
        assert_ne!(code(ask(gateway.address, garbage).unwrap_or_default()), "200");
    }
    // More connections than are served at once, none of which says anything.
    let silent: Vec<_> = (0..200).filter_map(|_| TcpStream::connect(gateway.address).ok()).collect();
    assert!(silent.len() > 64);
    drop(silent);
    assert_eq!(status("GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n"), "200");
}

#[test]
fn nothing_listens_unless_an_address_is_configured_and_a_wrong_one_is_refused() {
    let folder = Folder::with_demo_vehicle(
        "no-such-can",
        "[ros]\nenabled = false\n[http]\naddress = \"everywhere\"\n",
    );
    let mut gateway = Process::run(&folder);
    assert_eq!(gateway.ended().code(), Some(3));
    assert!(gateway.log().iter().any(|line| line.contains("http.address")), "{:?}", gateway.log());
}

fn promtool(arguments: &[&str], input: &str) -> Result<(bool, String), Missing> {
    let missing = || Prerequisite::Prometheus.missing("promtool is not installed");
    let mut command = Command::new("promtool");
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|_| missing())?;
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    Ok((output.status.success(), text))
}

fn shipped(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path).display().to_string()
}

#[test]
fn promtool_finds_nothing_in_the_metrics_and_the_rules() {
    let gateway = Gateway::run("");
    let metrics = body(&gateway.get("/metrics")).to_owned();
    assert_eq!(require!(promtool(&["check", "metrics"], &metrics)), (true, String::new()), "{metrics}");
    let (is_good, text) = require!(promtool(&["check", "rules", &shipped("docs/grafana/alerts.yml")], ""));
    assert!(is_good, "{text}");
}

#[test]
fn an_alert_on_a_status_has_what_to_do_as_an_annotation() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("alerts.yml");
    let rules = include_str!("alerts.yml").replace("RULES", &shipped("docs/grafana/alerts.yml"));
    std::fs::write(&path, rules).unwrap();
    let (is_good, text) = require!(promtool(&["test", "rules", &path.display().to_string()], ""));
    assert!(is_good, "{text}");
}

mod slow {
    use super::*;
    use serde_json::Value;

    /// A Prometheus that scrapes the gateway; killed when the test ends.
    struct Prometheus(std::process::Child, SocketAddr, #[allow(dead_code)] tempfile::TempDir);

    impl Drop for Prometheus {
        fn drop(&mut self) {
            let _ = self.0.kill();
            let _ = self.0.wait();
        }
    }

    impl Prometheus {
        fn run(gateway: SocketAddr) -> Result<Self, Missing> {
            let (folder, address) = (tempfile::tempdir().unwrap(), free_address());
            let config = format!(
                "global: {{ scrape_interval: 1s, evaluation_interval: 1s }}\nrule_files: [\"{}\"]\nscrape_configs:\n  \
                 - job_name: signal-gateway\n    static_configs: [{{ targets: [\"{gateway}\"] }}]\n",
                shipped("docs/grafana/alerts.yml")
            );
            std::fs::write(folder.path().join("prometheus.yml"), config).unwrap();
            let mut command = Command::new("prometheus");
            command
                .current_dir(folder.path())
                .arg("--config.file=prometheus.yml")
                .arg("--storage.tsdb.path=data");
            command
                .arg(format!("--web.listen-address={address}"))
                .stdout(Stdio::null())
                .stderr(Stdio::null());
            let missing = |_| Prerequisite::Prometheus.missing("prometheus is not installed");
            Ok(Self(command.spawn().map_err(missing)?, address, folder))
        }

        /// The result of a query, a list.
        fn query(&self, expression: &str) -> Option<Vec<Value>> {
            let encoded: String = expression.bytes().map(|byte| format!("%{byte:02X}")).collect();
            let request = format!("GET /api/v1/query?query={encoded} HTTP/1.0\r\nHost: {}\r\n\r\n", self.1);
            let answer: Value = serde_json::from_str(body(&ask(self.1, &request)?)).ok()?;
            assert_eq!(answer["status"], "success", "{expression}: {answer}");
            answer["data"]["result"].as_array().cloned()
        }
    }

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn every_query_of_the_dashboard_answers_on_a_prometheus_that_scrapes_a_run() {
        let gateway = Gateway::run("");
        let prometheus = require!(Prometheus::run(gateway.address));
        let dashboard = std::fs::read_to_string(shipped("docs/grafana/dashboard.json")).unwrap();
        let dashboard: Value = serde_json::from_str(&dashboard).unwrap();
        let panels = dashboard["panels"].as_array().unwrap();
        let targets = panels.iter().flat_map(|panel| panel["targets"].as_array().unwrap());
        let queries: Vec<_> = targets.map(|target| target["expr"].as_str().unwrap()).collect();
        assert!(queries.len() > 12, "{queries:?}");
        for query in queries {
            let query = query.replace("$job", "signal-gateway");
            // Rates need several scrapes.
            wait_until(format_args!("an answer to {query}"), || {
                prometheus.query(&query).is_some_and(|result| !result.is_empty())
            });
        }
        // The undefined value and the silence of the demo end a report for more than 5 s together; rules are
        // evaluated.
        wait_until("the alerts", || prometheus.query("ALERTS").is_some());
    }
}
