//! Checks whether the service can read the files of its configuration.

use std::path::{Path, PathBuf};

use super::kind::CheckKind;
use super::report::CheckReport;
use vehicle_bringup::plausibility::finding::Severity;

/// Folders that the shipped unit hides from the service (`ProtectHome=`, `PrivateTmp=`).
const HIDDEN: [&str; 5] = ["/home", "/root", "/run/user", "/tmp", "/var/tmp"];

/// Returns the hidden folder that contains this file; `None` if the service can see the file.
pub fn hiding_folder(path: &Path) -> Option<&'static str> {
    HIDDEN.into_iter().find(|folder| path.starts_with(Path::new(folder)))
}

/// Warns of files that the unit hides or that its user cannot read.
pub fn service_files(read: &[PathBuf], user: &str, unreadable: &[PathBuf]) -> CheckReport {
    let mut report = CheckReport::default();
    for path in read {
        let name = path.display();
        if let Some(folder) = hiding_folder(path) {
            let text = format!("{name}: the service cannot read it, since its unit hides {folder}");
            let remedy = "move it to /etc/signal-gateway";
            report.find_with(Severity::Warning, CheckKind::ServiceCannotRead, text, remedy);
        } else if unreadable.contains(path) {
            let text = format!("{name}: the service cannot read it, since it runs as user {user}");
            let remedy = format!("chmod a+r {name}, and a+x for its folders");
            report.find_with(Severity::Warning, CheckKind::ServiceCannotRead, text, remedy);
        }
    }
    report
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::ReportedFinding;

    #[test]
    fn hidden_and_unreadable_files_are_found_once_each() {
        let paths =
            ["/etc/signal-gateway/gateway.toml", "/homes/car.toml", "/home/me/car.toml"].map(PathBuf::from);
        let texts = |unreadable: &[PathBuf]| {
            let report = service_files(&paths, "someone", unreadable);
            let text = |finding: &&ReportedFinding| format!("{}: {}", finding.text, finding.remedy);
            report.findings().iter().map(text).collect::<Vec<_>>()
        };
        let hidden = "/home/me/car.toml: the service cannot read it, since its unit hides /home: move it to /etc/signal-gateway";
        assert_eq!(texts(&[]), [hidden]);
        let all = texts(&[paths[0].clone(), paths[2].clone()]);
        assert_eq!(all.len(), 2);
        assert!(
            all[0].contains("since it runs as user someone: chmod a+r /etc/signal-gateway/gateway.toml"),
            "{all:?}"
        );
    }
}
