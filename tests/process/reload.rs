//! SIGHUP: a changed configuration is put into effect, a bad one refused, and both can be seen.

use std::path::PathBuf;
use std::process::Command;

use serde_json::Value;

use crate::support::process::{Folder, Process};
use crate::support::program::{Ran, run};
use crate::support::service_manager::ServiceManager;
use crate::support::waiting::{described, wait_for, wait_until};

/// A gateway on an interface that does not exist, without ROS.
struct Gateway {
    process: Process,
    folder: Folder,
    manager: ServiceManager,
}

const KEYS: &str = "[status]\nsocket = \"status.sock\"\n[ros]\nenabled = false\n";

impl Gateway {
    fn run() -> Self {
        let folder = Folder::with_demo_vehicle("no-such-can", KEYS);
        let manager = ServiceManager::in_folder(folder.path());
        let process = Process::run_with(&folder, |command| manager.supervise(command));
        manager.wait_for("READY=1");
        Self { process, folder, manager }
    }

    /// Reloads, and waits until the service manager is told that it is done; gives the state then.
    fn reload(&self) -> Value {
        self.process.signal("HUP");
        self.manager.wait_for("RELOADING=1\nMONOTONIC_USEC=");
        self.manager.wait_for("READY=1");
        self.status()["process"]["configuration"].take()
    }

    /// The output of a command that asks the gateway, once it is answered in the time that the command gives
    /// it.
    fn ask(&self, arguments: &[&str]) -> Ran {
        let what = described(|| format!("an answer to {arguments:?}: {:?}", self.process.log()));
        wait_for(what, || Some(run(self.folder.path(), arguments)).filter(|ran| ran.code != 8))
    }

    fn status(&self) -> Value {
        serde_json::from_str(&self.ask(&["status", "--json", "--socket", "status.sock"]).out).unwrap()
    }

    /// The exit code and the text of a comparison with the configuration in the folder.
    fn compare(&self, arguments: &[&str]) -> (i32, String) {
        let comparison = ["check", "--config", "gateway.toml", "--against-running=status.sock"];
        let Ran { code, out, .. } = self.ask(&[&comparison, arguments].concat());
        (code, out)
    }

    fn edit(&self, from: &str, to: &str) {
        let path: PathBuf = self.folder.path().join("gateway.toml");
        let text = std::fs::read_to_string(path).unwrap();
        assert!(text.contains(from), "{text}");
        self.folder.write("gateway.toml", &text.replace(from, to));
    }
}

#[test]
fn changed_configuration_is_in_effect_and_a_bad_one_is_refused() {
    let mut gateway = Gateway::run();
    let before = gateway.status()["process"]["configuration"].take();
    assert_eq!((&before["reloads"], &before["last_reload"]), (&0.into(), &Value::Null));
    assert_eq!(before["in_effect"]["fixed"]["[can.body] interface"], "no-such-can");
    assert_eq!(gateway.compare(&[]).0, 0, "nothing is different");

    gateway.folder.append("gateway.toml", "[reports]\nrate_hz = 50.0\n");
    let (code, text) = gateway.compare(&[]);
    assert_eq!(code, 0);
    assert_eq!(text, "a reload changes:\n  [reports] rate_hz: 10 → 50\n");
    let after = gateway.reload();
    assert_eq!((&after["reloads"], &after["refused"]), (&1.into(), &0.into()));
    assert_eq!(after["last_reload"]["is_applied"], true);
    assert_eq!(after["last_reload"]["changes"][0]["part"], "[reports] rate_hz");
    gateway.process.wait_for_log("configuration reloaded: [reports] rate_hz: 10 → 50");
    assert_eq!(gateway.compare(&[]).1, "nothing is different: this configuration is in effect\n");

    gateway.folder.append("gateway.toml", "rate_hz = 3\n");
    let refused = gateway.reload();
    assert_eq!((&refused["reloads"], &refused["refused"]), (&1.into(), &1.into()));
    assert!(refused["last_reload"]["reason"].as_str().unwrap().contains("gateway.toml:"), "{refused}");
    assert_eq!(refused["in_effect"], after["in_effect"], "the one before goes on");
    gateway.process.wait_for_log("configuration not reloaded, the one before goes on: ");
    gateway.process.wait_for_log("configuration: reload refused, the one before goes on: ");
    assert_eq!(gateway.compare(&[]).0, 3, "a bad file is refused here, too");

    gateway.edit("rate_hz = 3\n", "");
    gateway.edit("no-such-can", "no-such-can7");
    let (code, text) = gateway.compare(&["--json"]);
    assert_eq!(code, 9);
    let plan: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(plan["restart"][0]["part"], "[can.body] interface");
    assert_eq!(plan["restart"][0]["after"], "no-such-can7");
    let refused = gateway.reload();
    let reason = refused["last_reload"]["reason"].as_str().unwrap();
    assert_eq!(reason, "restart needed for [can.body] interface: no-such-can → no-such-can7");
    let text = gateway.ask(&["status", "--socket", "status.sock"]).out;
    assert!(text.contains("configuration (1 reload, 2 refused)"), "{text}");
    gateway.edit("no-such-can7", "no-such-can");
    let after = gateway.reload();
    assert_eq!((&after["reloads"], &after["refused"]), (&2.into(), &2.into()));
    gateway.process.stop("TERM");
}

#[test]
fn many_requests_at_once_leave_the_last_file_in_effect() {
    let mut gateway = Gateway::run();
    gateway.folder.append("gateway.toml", "[diagnostics]\nperiod_ms = 250\n");
    for period in [100, 200, 300, 400, 499] {
        let path = gateway.folder.path().join("gateway.toml");
        let text = std::fs::read_to_string(path).unwrap();
        let (before, _) = text.split_once("period_ms").unwrap();
        gateway.folder.write("gateway.toml", &format!("{before}period_ms = {period}\n"));
        gateway.process.signal("HUP");
    }
    wait_until(described(|| format!("the last file: {:?}", gateway.process.log())), || {
        let status = gateway.status();
        status["process"]["configuration"]["in_effect"]["reloadable"]["[diagnostics] period_ms"] == "499"
    });
    gateway.process.stop("TERM");
}

#[test]
fn a_gateway_that_plays_a_recording_says_by_its_process_alone_that_it_does_not_reload() {
    let folder = Folder::with_demo_vehicle("no-such-can", KEYS);
    let mut playing = Process::start(folder.path(), |command| {
        command.args(["demo", "--plain", "--repeat"]);
    });
    let reload =
        |pid: u32| run(folder.path(), &["reload", "--socket", "none.sock", "--pid", &pid.to_string()]);
    // Before, a SIGHUP that the test's own parent ignores is ignored as well.
    let status = format!("/proc/{}/status", playing.id());
    wait_until("its handlers of signals", || {
        let status = std::fs::read_to_string(&status).unwrap();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap().trim();
        u64::from_str_radix(caught, 16).unwrap() & (1 << (libc::SIGTERM - 1)) != 0
    });
    wait_until("a reload that is refused", || {
        let refused = reload(playing.id());
        refused.code == 8 && refused.error.contains("does not reload: it plays a recording")
    });
    playing.stop("TERM");

    let live = Gateway::run();
    reload(live.process.id()).succeeded();
    live.manager.wait_for("RELOADING=1\nMONOTONIC_USEC=");
    // A process without a handler would end.
    let mut sleeper = Command::new("sleep").arg("600").spawn().unwrap();
    wait_until("a refusal for its sake", || reload(sleeper.id()).code == 8);
    assert!(sleeper.try_wait().unwrap().is_none());
    sleeper.kill().unwrap();
    sleeper.wait().unwrap();
}

#[test]
fn without_a_gateway_a_comparison_says_so() {
    let folder = Folder::with_demo_vehicle("no-such-can", KEYS);
    let compared = ["check", "--config", "gateway.toml", "--against-running=status.sock"];
    run(folder.path(), &compared).assert(8, "start the service");
}
