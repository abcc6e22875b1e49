//! `check --against-running`: compares a configuration with the active one of a gateway.

use std::io::{self, Write as _};
use std::path::Path;
use std::process::ExitCode;

use super::failure::Failure;
use super::messages;
use crate::config::Settings;
use crate::daemon::build;
use crate::io::snapshots::client::StatusClient;
use crate::process_status::configuration::{Change, ReloadPlan, plan};
use crate::process_status::snapshot::{Build, Snapshot};
use crate::report::text::escaped;

use super::exit_code::UNREACHABLE;
use super::status::unreachable;

const RESTART_NEEDED: u8 = 9;

pub(super) fn run(settings: &Settings, socket: &Path, json: bool) -> Result<ExitCode, Failure> {
    let received = StatusClient::connect(socket).and_then(|mut client| client.receive());
    let running = match received {
        Ok((snapshot, _)) => snapshot,
        Err(error) => return Ok(unreachable(socket, &error)),
    };
    let Some(plan) = plan_for(settings, &running) else {
        let reason = "the running gateway does not reload: it runs on a terminal, plays a recording, or is of another \
                      version";
        messages::error(reason, "restart it");
        return Ok(ExitCode::from(UNREACHABLE));
    };
    let text = if json { json_text(&plan) } else { text(&plan) };
    io::stdout().lock().write_all(text.as_bytes())?;
    Ok(if plan.restart.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(RESTART_NEEDED) })
}

/// Returns the changes that a configuration would make; `None` if the gateway does not report its own.
pub(super) fn plan_for(settings: &Settings, running: &Snapshot) -> Option<ReloadPlan> {
    let process = running.process.as_ref()?;
    let mut plan = plan(&process.configuration.as_ref()?.in_effect, &settings.in_effect);
    let own = build();
    if process.build != own {
        let [before, after] = [&process.build, &own].map(|build| Some(build_text(build)));
        plan.restart.insert(0, Change { part: "program".to_owned(), before, after });
    }
    Some(plan)
}

fn build_text(build: &Build) -> String {
    let Build { version, commit, distribution } = build;
    let rest = commit.iter().chain(distribution);
    rest.fold(version.clone(), |text, part| text + " " + part)
}

fn text(plan: &ReloadPlan) -> String {
    if plan.is_empty() {
        return "nothing is different: this configuration is in effect\n".to_owned();
    }
    let list = |title: &str, changes: &[Change]| {
        let lines = changes.iter().map(|change| format!("  {}\n", escaped(&change.to_string())));
        let lines: String = lines.collect();
        if lines.is_empty() { lines } else { format!("{title}\n{lines}") }
    };
    let restart = list("a restart is needed, a reload would be refused:", &plan.restart);
    restart.clone()
        + &list(if restart.is_empty() { "a reload changes:" } else { "changed as well:" }, &plan.reloadable)
}

fn json_text(plan: &ReloadPlan) -> String {
    serde_json::json!({ "reload": plan.reloadable, "restart": plan.restart }).to_string() + "\n"
}
