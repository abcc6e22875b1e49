//! Many vehicles, one router and one observer, who hears all of them: what that costs, and how it grows.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use gateway_base::time::WallStamp;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_lights::verdict::TurnIndicators;
use gateway_core::vehicle_report::Step;
use ros_messages::type_hash;
use serde_json::Value;
use signal_gateway::io::ros::session::{RosSession, RosSettings, Transport, TypeHashes, ZenohSettings};

use super::peer::{Peer, router};
use crate::support::json_process::Mark;
use crate::support::peer::domain;
use crate::support::ports::free_port;
use crate::support::prerequisite::require;
use crate::support::waiting::Pace;

/// Reports of each vehicle.
const REPORTS: i64 = 100;
/// Time between two reports of a vehicle, as a gateway has it by default.
const PERIOD: Duration = Duration::from_millis(100);

/// Processor time of a process, and its memory in use.
fn cost(process: u32) -> (Duration, u64) {
    let read = |name| std::fs::read_to_string(format!("/proc/{process}/{name}")).unwrap();
    let stat = read("stat");
    let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    let ticks = |field: usize| fields[field].parse::<u64>().unwrap();
    let status = read("status");
    let memory = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    (
        Duration::from_millis(10 * (ticks(11) + ticks(12))),
        memory.trim().trim_end_matches(" kB").parse().unwrap(),
    )
}

fn vehicle(domain: u16, port: u16, number: u32) -> RosSession {
    let config = format!(
        "{{ mode: 'client', connect: {{ endpoints: ['tcp/127.0.0.1:{port}'] }}, scouting: {{ multicast: {{ enabled: false }} }} }}"
    );
    let mut settings = RosSettings {
        namespace: format!("/car{number}"),
        domain_id: domain,
        transport: Transport::Zenoh(ZenohSettings { config: Some(config), type_hashes: TypeHashes::Rihs01 }),
        ..RosSettings::default()
    };
    for name in settings.topics.names_mut() {
        *name = format!("/car{number}{name}");
    }
    RosSession::start(settings).unwrap()
}

fn drive(count: u32) {
    let (domain, port) = (domain(), free_port());
    let router = Peer::start(domain, &router(port)).unwrap();
    let config = format!("{{ mode: 'client', connect: {{ endpoints: ['tcp/127.0.0.1:{port}'] }} }}");
    let observer = Peer::start(domain, &config).unwrap();
    let hash = type_hash("autoware_vehicle_msgs/msg/TurnIndicatorsReport").unwrap();
    let key = format!(
        "{domain}/*/vehicle/status/turn_indicators_status/autoware_vehicle_msgs::msg::dds_::TurnIndicatorsReport_/{hash}"
    );
    observer.read("turn", "turn", &key, false);
    let before = cost(std::process::id());
    let vehicles: Vec<_> = (0..count).map(|number| vehicle(domain, port, number)).collect();
    for number in 0..count {
        observer.token(Mark::START, "put", &["/MP/", &format!("/%car{number}/"), "turn_indicators_status"]);
    }
    let processes = [std::process::id(), router.id(), observer.id()];
    let (start, costs) = (Instant::now(), processes.map(cost));
    let (mut pace, mut newest) = (Pace::every(PERIOD), Mark::START);
    for sec in 1..=REPORTS {
        newest = observer.mark();
        let step = Step::Publish(TurnIndicators::EnableLeft, WallStamp::from_nanos(sec * 1_000_000_000));
        let output = Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step));
        for vehicle in &vehicles {
            vehicle.send(&output);
        }
        pace.wait();
    }
    let took = start.elapsed();
    for number in 0..count {
        let car = format!("/car{number}/");
        observer.sample(newest, "turn", |line| {
            line["data"]["stamp"]["sec"] == REPORTS && line["key"].as_str().unwrap().contains(&car)
        });
    }
    let used = processes.map(cost);
    let samples = observer.samples(Mark::START, "turn");
    let distinct: BTreeSet<_> =
        samples.iter().map(|line| (line["key"].to_string(), line["data"]["stamp"]["sec"].as_i64())).collect();
    let nanos = |line: &Value, key: &str| line[key].as_u64().unwrap();
    let mut late: Vec<_> =
        samples.iter().map(|line| nanos(line, "at").saturating_sub(nanos(line, "sent"))).collect();
    late.sort_unstable();
    let percent =
        |at: usize| used[at].0.saturating_sub(costs[at].0).as_secs_f64() / took.as_secs_f64() * 100.0;
    let late_ms =
        |share: usize| Duration::from_nanos(late[(late.len() - 1) * share / 100]).as_secs_f64() * 1e3;
    let memory = |at: usize| used[at].1 / 1024;
    println!(
        "{count} vehicles: {} of {} reports in {:.1} s, late by {:.1} ms in the middle and {:.1} ms for 99 %; vehicles {:.2} % of a core each, \
         {} kB each; router {:.1} %, {} MB; observer {:.1} %, {} MB",
        distinct.len(),
        count * 100,
        took.as_secs_f64(),
        late_ms(50),
        late_ms(99),
        percent(0) / f64::from(count),
        used[0].1.saturating_sub(before.1) / u64::from(count),
        percent(1),
        memory(1),
        percent(2),
        memory(2),
    );
    let keys: BTreeSet<_> = samples.iter().map(|line| line["key"].to_string()).collect();
    assert_eq!(u32::try_from(keys.len()).unwrap(), count, "every vehicle is heard, and nobody else");
}

mod slow {
    use super::*;

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_hundred_vehicles_are_heard_by_one_observer() {
        let _peer = require!(crate::support::prerequisite::peer_python());
        [1, 10, 100].into_iter().for_each(drive);
    }
}
