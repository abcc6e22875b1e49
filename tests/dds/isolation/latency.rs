//! What the boundary of the process costs.

use std::time::{Duration, Instant};

use gateway_base::time::WallStamp;
use gateway_core::command::input::CommandInput;
use gateway_core::gateway::event::{Input, Output};
use signal_gateway::io::ros::inbox::{Arrival, Inbox};
use signal_gateway::io::ros::session::{
    Isolation, OutgoingTopic, RosSession, RosSettings, Subscription, SubscriptionKind, Topics,
};
use tokio::time::timeout;
use turn_signal::light_command::TurnCommand;
use turn_signal::output::TurnSignalOutput;

use crate::support::peer::domain;
use crate::support::waiting::{DEADLINE, Pace, wait_until};

/// Messages in each direction.
const COUNT: i64 = 2_000;

fn session(domain_id: u16, node: &str, isolation: Isolation, topics: Topics, reads: &[&str]) -> RosSession {
    let settings = RosSettings {
        node: node.to_owned(),
        domain_id,
        only_networks: vec!["127.0.0.1".parse().unwrap()],
        topics,
        subscriptions: reads
            .iter()
            .map(|name| Subscription::new(name, SubscriptionKind::TurnCommand))
            .collect(),
        isolation,
        ..RosSettings::default()
    };
    RosSession::start(settings).unwrap()
}

/// A session that sends commands on a topic.
fn sender(domain_id: u16, name: &str, isolation: Isolation) -> RosSession {
    let topics = Topics::default()
        .with(OutgoingTopic::TurnIndicatorsReport, "")
        .with(OutgoingTopic::HazardLightsReport, "")
        .with(OutgoingTopic::Diagnostics, &format!("/{name}/diagnostics"))
        .with(OutgoingTopic::TurnCommand, &format!("/{name}"));
    session(domain_id, name, isolation, topics, &[])
}

/// The time until a command of this number has been received; `None` when a network side was replaced
/// meanwhile.
async fn travel(session: &RosSession, inbox: &Inbox, number: i64) -> Option<Duration> {
    let stamp = WallStamp::from_nanos(number);
    let (sent, restarts) = (Instant::now(), session.status().network.restarts);
    session.send(&Output::TurnSignal(TurnSignalOutput::TurnCommand { command: TurnCommand::Left, stamp }));
    let arrival = async {
        while let Some(Arrival { input, .. }) = inbox.take().await {
            if matches!(input, Input::Command(CommandInput::Turn { stamp: arrived, .. }) if arrived == stamp)
            {
                return Some(sent.elapsed());
            }
        }
        None
    };
    let arrived = timeout(DEADLINE, arrival).await.ok().flatten();
    assert!(
        arrived.is_some() || session.status().network.restarts > restarts,
        "message {number} is lost: {:?}",
        session.status()
    );
    arrived
}

fn percentiles(mut times: Vec<Duration>) -> (Duration, Duration) {
    times.sort();
    let at = |share: usize| times[(times.len() - 1) * share / 100];
    (at(50), at(99))
}

/// A command goes from one session to another, whose network side is a thread in both cases. The two kinds
/// take turns, so that whatever else the machine does troubles both.
#[test]
fn the_boundary_of_the_process_adds_little_to_a_message() {
    let domain = domain();
    let process = Isolation::Process {
        program: env!("CARGO_BIN_EXE_signal-gateway").into(),
        memory_limit_mb: 384,
        supervisor: None,
    };
    let senders = [sender(domain, "thread", Isolation::Thread), sender(domain, "process", process)];
    let receiver =
        session(domain, "receiver", Isolation::Thread, Topics::default(), &["/thread", "/process"]);
    let inbox = receiver.inbox();
    let meet = || {
        wait_until("the sessions to find each other", || {
            receiver.status().incoming.iter().all(|topic| topic.writers == 1)
                && senders.iter().all(|sender| sender.status().outgoing.iter().any(|topic| topic.peers == 1))
        });
    };
    meet();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
    let (mut times, mut pace) = ([Vec::new(), Vec::new()], Pace::every(Duration::from_micros(500)));
    for number in 1..=COUNT {
        for (sender, times) in senders.iter().zip(&mut times) {
            match runtime.block_on(travel(sender, &inbox, number)) {
                Some(time) => times.push(time),
                None => meet(),
            }
            pace.wait();
        }
    }
    for (place, times) in ["thread", "process"].iter().zip(times) {
        let (middle, late) = percentiles(times);
        println!("network side in a {place}: p50 {middle:?}, p99 {late:?}");
    }
}
