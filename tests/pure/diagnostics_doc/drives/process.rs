//! The process itself, well and not.

use std::time::Duration;

use gateway_base::time::WallStamp;
use ros_transport::link::ZenohLinks;
use signal_gateway::process_status::configuration::{ConfigurationState, EffectiveConfiguration};
use signal_gateway::process_status::confinement::Confinement;
use signal_gateway::process_status::log::LogState;
use signal_gateway::process_status::network::{Burden, NetworkFailure, NetworkState, SharedTopic};
use signal_gateway::process_status::recordings::{McapState, RecorderState};

use super::Reported;

pub(super) fn drive(reported: &mut Reported) {
    let failed = Some("No space left on device (os error 28)".to_owned());
    let recorder = RecorderState { last_error: failed.clone(), ..RecorderState::default() };
    let mcap = McapState { last_error: failed.clone(), ..McapState::default() };
    let log = LogState { last_error: failed, ..LogState::default() };
    for is_failing in [false, true] {
        let recorder = RecorderState { is_failing, ..recorder.clone() };
        let mcap = McapState { is_failing, ..mcap.clone() };
        let log = LogState { is_failing, ..log.clone() };
        reported.take(vec![recorder.status(), mcap.status(), log.status()]);
    }
    configuration(reported);
    network(reported);
}

/// A configuration is reloaded, and the next one refused.
fn configuration(reported: &mut Reported) {
    let mut state = ConfigurationState::default();
    let mut statuses = vec![state.status()];
    state.applied(EffectiveConfiguration::default(), Vec::new(), WallStamp::from_nanos(1));
    statuses.push(state.status());
    state.refused(
        "restart needed for [ros] domain_id: 0 → 1".to_owned(),
        Vec::new(),
        WallStamp::from_nanos(2),
    );
    statuses.push(state.status());
    reported.take(statuses);
}

/// The network side joins, hangs, is replaced, and is well again.
fn network(reported: &mut Reported) {
    let joining = NetworkState::default();
    let failed = NetworkState { last_failure: Some(NetworkFailure::NoAnswer), ..joining.clone() };
    let joined = |seconds: u64| NetworkState {
        is_up: true,
        age: Some(Duration::from_secs(seconds)),
        memory_bytes: Some(30_000_000),
        confinement: Some(Confinement::default()),
        ..failed.clone()
    };
    let alone = NetworkState { links: Some(ZenohLinks::default()), ..joined(60) };
    let foreign = NetworkState { has_other_graph: true, ..joined(60) };
    let looking = NetworkState { last_failure: None, age: Some(Duration::ZERO), ..alone.clone() };
    let unreachable = vec!["/planning/planner".to_owned()];
    let links = ZenohLinks { routers: 1, peers: 3, lost: 1, unreachable };
    let lost = NetworkState { links: Some(links), ..joined(60) };
    let again = NetworkState { recent_ends: 3, ..joined(1) };
    let burdened = |burden| NetworkState { burden: Some(burden), processor_percent: Some(99), ..joined(60) };
    let [unheard, crowd, busy] = [Burden::Unheard, Burden::Crowd, Burden::Busy].map(burdened);
    let taken_anew = NetworkState { taken_anew: 1, since_taken_anew: Some(Duration::ZERO), ..joined(60) };
    let topic = SharedTopic { name: "/vehicle/status/gear_status".to_owned(), other_writers: 1 };
    let shared = NetworkState { shared_topics: vec![topic], ..joined(60) };
    let states = [
        joining,
        shared,
        failed.clone(),
        joined(1),
        again,
        joined(60),
        unheard,
        crowd,
        busy,
        taken_anew,
        looking,
        lost,
        alone,
        foreign,
    ];
    reported.take(states.map(|state| state.status()).to_vec());
}
