//! The process itself, well and not.

use signal_gateway::core::gateway::process_status::{LogState, RecorderState};

use super::Said;

pub(super) fn drive(said: &mut Said) {
    let failed = Some("No space left on device (os error 28)".to_owned());
    let recorder = RecorderState { last_error: failed.clone(), ..RecorderState::default() };
    let log = LogState { last_error: failed, ..LogState::default() };
    for is_failing in [false, true] {
        let recorder = RecorderState { is_failing, ..recorder.clone() };
        let log = LogState { is_failing, ..log.clone() };
        said.take(vec![recorder.status("gateway"), log.status("gateway")]);
    }
}
