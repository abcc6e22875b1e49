//! `[status]`: the socket on which the present state is served.

use std::path::{Path, PathBuf};

use super::diagnostics::NO_HARDWARE_ID;

use crate::config::reading::{Fields, flag, key_rows, path};

key_rows! {
    ENABLED: bool = flag("enabled", true).restart().doc("false: no socket");
    SOCKET: PathBuf = path("socket").example("\"status.sock\"").restart()
        .doc("default: status.sock in systemd's runtime directory, else a name of its own in signal-gateway of $XDG_RUNTIME_DIR");
}

/// The socket that serves the current state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatusConfig {
    /// False for no socket at all.
    pub enabled: bool,
    /// Path of the socket; by default in the runtime directory of systemd or of the user.
    pub socket: Option<PathBuf>,
}

pub(super) fn status(fields: &Fields<'_>) -> StatusConfig {
    StatusConfig { enabled: fields.read(&ENABLED), socket: fields.given(&SOCKET) }
}

/// Maximum length of an instance's name, so that the path of its socket is short enough for the kernel.
const MAX_NAME: usize = 40;

/// Returns the name of an instance, for the name of its socket: its `hardware_id`, else the name of its
/// configuration, with `-` for characters that are unusual in names of files.
pub(super) fn instance_name(hardware_id: &str, file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let name = if hardware_id == NO_HARDWARE_ID { &*stem } else { hardware_id };
    let usual = |letter: char| letter.is_ascii_alphanumeric() || "._-".contains(letter);
    let name: String =
        name.chars().take(MAX_NAME).map(|letter| if usual(letter) { letter } else { '-' }).collect();
    let name = name.trim_start_matches('.');
    if name.is_empty() { "gateway".to_owned() } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instance_has_the_name_of_its_hardware_or_file_in_usual_characters() {
        let name = |hardware_id: &str| instance_name(hardware_id, Path::new("/etc/kona.toml"));
        assert_eq!(name("none"), "kona");
        assert_eq!(name("vehicle_pc_1"), "vehicle_pc_1");
        assert_eq!(name("../träger 2"), "-tr-ger-2");
        assert_eq!(name(".."), "gateway");
        assert_eq!(name(&"x".repeat(200)).len(), MAX_NAME);
        assert_eq!(instance_name("none", Path::new("/")), "gateway");
    }
}
