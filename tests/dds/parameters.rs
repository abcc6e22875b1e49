//! The services for parameters, as clients of both middlewares of ROS 2 use them.

use std::time::Duration;

use serde_json::{Value, json};

use super::fast_dds::client;
use super::session::Role;
use crate::support::json_process::{JsonProcess, Mark};
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::waiting::wait_until;

const NODE: &str = "vehicle/gateway_under_test";
const NAMES: [&str; 3] = ["ros.domain_id", "ros.only_networks", "use_sim_time"];

/// A client that counts its requests.
struct Client {
    process: JsonProcess,
    sent: u64,
}

impl Client {
    /// A client that is known to the node as well: the node leaves requests unanswered whose sender it does
    /// not know within 2 s.
    fn start(cyclone: &Cyclone, domain: u16) -> Self {
        let process = cyclone.start("parameter_client.py", domain, &[NODE]);
        let mut sent = 0;
        let send = || {
            process.send("list_parameters 0");
            sent += 1;
        };
        let is_answer = |line: &Value| line["event"] == "answer";
        process.wait_while_doing(Mark::START, "an answer", Duration::from_secs(1), send, is_answer);
        Self { process, sent }
    }

    fn send(&mut self, request: &str) {
        self.process.send(request);
        self.sent += 1;
    }

    fn answer(&mut self, request: &str) -> Value {
        self.send(request);
        let number = self.sent;
        let is_it = |line: &Value| line["event"] == "answer" && line["number"] == number;
        let answer = self.process.next(&format!("the answer to {request}"), is_it);
        assert!(request.starts_with(answer["service"].as_str().unwrap()), "{answer}");
        answer["data"].clone()
    }
}

#[test]
fn parameters_are_listed_read_described_and_not_set() {
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let gateway = Role::new(domain).only_on("127.0.0.1").with_parameters().start();
    let mut client = Client::start(&cyclone, domain);
    assert_eq!(client.answer("list_parameters 0"), json!({"names": NAMES, "prefixes": ["ros"]}));
    let values = client.answer("get_parameters ros.domain_id nothing ros.only_networks")["values"].clone();
    assert_eq!((&values[0]["type"], &values[0]["integer_value"]), (&json!(2), &json!(domain)));
    assert_eq!(values[1]["type"], 0, "not set");
    assert_eq!(values[2]["string_array_value"], json!(["127.0.0.1"]));
    let types = client.answer("get_parameter_types use_sim_time ros.only_networks");
    assert_eq!(types, json!({"types": [1, 9]}));
    let described = client.answer("describe_parameters use_sim_time")["descriptors"].clone();
    assert_eq!((&described[0]["name"], &described[0]["read_only"]), (&json!("use_sim_time"), &json!(true)));
    let set = client.answer("set_parameters use_sim_time x")["results"].clone();
    let atomically = client.answer("set_parameters_atomically use_sim_time");
    for result in [&set[0], &set[1], &atomically] {
        assert_eq!(result["successful"], false);
        assert!(result["reason"].as_str().unwrap().contains("read-only"), "{result}");
    }

    let layout = client.answer("layout");
    assert_eq!(layout["status"], json!({"success": true, "code": 0, "message": ""}));
    assert_eq!(layout["doors"], json!([{"roles": [1, 2], "description": "front left"}]));

    // What is no request is counted, and the next one is answered.
    let before = gateway.status()["unanswered"].as_u64().unwrap();
    for length in [5, 9, 70_000] {
        client.send(&format!("nonsense {length}"));
    }
    let unanswered = |status: &Value| status["unanswered"].as_u64().unwrap() - before;
    let status = gateway.wait_until("three refusals", |status| unanswered(status) >= 3);
    assert!(unanswered(&status) == 3 || !gateway.is_undisturbed(), "{status}");
    let again = client.answer("get_parameters use_sim_time");
    assert_eq!(again["values"][0]["bool_value"], true);

    // Another configuration is told, and shows in the answers; nobody knows which of them is the first.
    gateway.send("parameters");
    let event = client.process.next("the event", |line| line["event"] == "changed")["data"].clone();
    let names = |list: &str| {
        let list = event[list].as_array().unwrap();
        list.iter().map(|one| one["name"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(names("new_parameters"), ["reports.rate_hz"]);
    assert_eq!(names("deleted_parameters"), NAMES);
    assert_eq!(event["new_parameters"][0]["value"]["integer_value"], 20);
    assert!(
        names("changed_parameters").is_empty() && event["stamp"]["sec"].as_i64().unwrap() > 1_700_000_000
    );
    let others = json!({"names": ["reports.rate_hz"], "prefixes": ["reports"]});
    wait_until("the other parameters", || client.answer("list_parameters 0") == others);
}

#[test]
fn a_client_of_fast_dds_knows_the_answer_to_its_request() {
    let program = require!(client());
    let domain = domain();
    let _gateway = Role::new(domain).only_on("127.0.0.1").with_parameters().start();
    let mut command = std::process::Command::new(program);
    let client = JsonProcess::start("fastdds_client", command.arg(domain.to_string()).arg(NODE));
    let answer = client.next("an answer", |line| line["event"] == "answer");
    assert_eq!((&answer["is_ours"], &answer["names"]), (&json!(true), &json!(NAMES)));
}

#[test]
fn the_graph_lists_the_services_with_the_node() {
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let kind = if cfg!(feature = "humble") { "gid24" } else { "gid16" };
    let reader = cyclone.topic_reader(domain, kind, "ros_discovery_info", "transient_local");
    let node = |line: &Value| {
        let node = line["data"]["node_entities_info_seq"][0].clone();
        (line["event"] == "sample" && node["node_name"] == "gateway_under_test").then_some(node)
    };
    let counts = |node: &Value| {
        [&node["reader_gid_seq"], &node["writer_gid_seq"]].map(|gids| gids.as_array().unwrap().len())
    };
    let gateway = Role::new(domain).only_on("127.0.0.1").start();
    let [readers, writers] = counts(&reader.find(Mark::START, "the node", |(_, line)| node(line)));
    drop(gateway);
    let _gateway = Role::new(domain).with_parameters().only_on("127.0.0.1").start();
    reader.find(Mark::START, "the node with seven services, and events", |(_, line)| {
        node(line).filter(|node| counts(node) == [readers + 7, writers + 8])
    });
}
