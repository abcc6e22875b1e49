//! Statuses of the process itself.

use signal_gateway::core::diagnostics::Level::{Ok, Warn};

use super::{NOTHING, Task, key, message};

pub(super) fn configuration() -> Task {
    Task {
        names: &["configuration"],
        about: "The configuration in effect, and what became of the last reload (SIGHUP, `systemctl reload`). With `run` on \
                SocketCAN.",
        messages: vec![
            message(Ok, "as at the start", NOTHING),
            message(Ok, "reloaded", NOTHING),
            message(
                Warn,
                "reload refused, the one before goes on: {reason}",
                "Correct the file at the place that is named and reload again; restart where a restart is needed. \
                 `check --against-running` says which before.",
            ),
        ],
        keys: vec![
            key("reloads", "-", "Configurations that were reloaded since start."),
            key("refused_reloads", "-", "Configurations that were refused since start."),
            key("last_changes", "-", "What the last reload changed, or would have; or `none`."),
            key("last_error", "-", "Why the last reload was refused, or `none`."),
        ],
    }
}

pub(super) fn black_box() -> Task {
    Task {
        names: &["black_box"],
        about: "Whether recordings of faults can be written. With `run` on SocketCAN and a folder for them. It is never \
                an ERROR, which would ask for another recording.",
        messages: vec![
            message(Ok, "ready", NOTHING),
            message(
                Warn,
                "recordings cannot be written: {error}",
                "Make room, or correct `[black_box] folder` and its rights; it is tried again every 10 s.",
            ),
        ],
        keys: vec![
            key("folder", "-", "Folder of the recordings."),
            key("newest", "-", "File name of the newest recording there, or `none`."),
            key("recordings", "-", "Recordings there."),
            key("written", "-", "Recordings written since start."),
            key("failures", "-", "Attempts to write that failed since start."),
            key("last_error", "-", "Reason of the last failure, or `none`."),
        ],
    }
}

pub(super) fn mcap() -> Task {
    Task {
        names: &["mcap"],
        about: "Whether the recording can be written. With `run` on SocketCAN and `--record` or `[mcap] folder`.",
        messages: vec![
            message(Ok, "recording", NOTHING),
            message(
                Warn,
                "the recording cannot be written: {error}",
                "Make room, or correct the folder and its rights. What waits, up to 16 MB, is written once the disk takes it; \
                 what comes beyond that is lost. A folder that cannot be made is tried again every 10 s.",
            ),
        ],
        keys: vec![
            key("folder", "-", "Folder of the recordings."),
            key("bag", "-", "The recording in it that is being written, or `none`."),
            key("files", "-", "Files of this recording."),
            key("bytes", "bytes", "Size of all recordings in the folder."),
            key("messages", "-", "Messages recorded since start."),
            key("lost", "-", "Messages lost since start, because the disk was full or too slow."),
            key("failures", "-", "Attempts to write that failed since start."),
            key("last_error", "-", "Reason of the last failure, or `none`."),
        ],
    }
}

pub(super) fn log() -> Task {
    Task {
        names: &["log"],
        about: "Whether the log reaches standard error. With `run` on SocketCAN.",
        messages: vec![
            message(Ok, "written", NOTHING),
            message(
                Warn,
                "log lines are lost: {error}",
                "Mend what reads standard error: the journal, a pipe's reader, a full disk.",
            ),
        ],
        keys: vec![
            key(
                "suppressed_lines",
                "-",
                "Lines left out since start, those of the network process included: at most 20 of a kind are written each second.",
            ),
            key("dropped_lines", "-", "Lines that standard error did not take since start, likewise."),
            key("last_error", "-", "Why a line was dropped last, or `none`."),
        ],
    }
}
