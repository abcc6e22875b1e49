//! Input and output: each file handles one external interface and contains no decisions.

pub mod awaited_thread;
pub mod can;
pub mod clock;
pub mod clock_state;
pub mod folder_access;
pub mod hangup;
pub mod history_file;
pub mod http;
mod journal;
pub mod lock;
pub mod mcap;
pub mod new_files;
pub mod optional_future;
pub mod output_queue;
pub mod precise_timer;
pub mod process_log;
pub mod recorder;
pub mod ros;
pub mod sample_log;
pub mod service_state;
pub mod service_user;
pub mod snapshots;
pub mod systemd;
pub mod terminal;
