//! The user of the packaged service, and its read permissions.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// The user that the shipped unit runs as.
pub const SERVICE_USER: &str = "signal-gateway";

/// Prints the arguments that cannot be read.
const SCRIPT: &str = r#"for file; do test -r "$file" || printf '%s\0' "$file"; done"#;

/// Returns the files that the service's user cannot read, by absolute paths. The kernel decides, so groups
/// and access lists are respected. Returns `None` if this process is not root or the user does not exist.
pub fn unreadable_for_service(files: &[PathBuf]) -> Option<Vec<PathBuf>> {
    let user = [format!("--reuid={SERVICE_USER}"), format!("--regid={SERVICE_USER}")];
    let mut command = Command::new("setpriv");
    command.args(user).args(["--init-groups", "sh", "-c", SCRIPT, "sh"]).args(files);
    let output = command.current_dir("/").stdin(Stdio::null()).output().ok()?;
    let paths = output.stdout.split(|byte| *byte == 0).filter(|path| !path.is_empty());
    output.status.success().then(|| paths.map(|path| PathBuf::from(OsStr::from_bytes(path))).collect())
}
