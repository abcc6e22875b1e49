//! The services for parameters, as clients of `rmw_zenoh_cpp` use them.

use ros_messages::type_hash;
use serde_json::{Value, json};

use super::peer::{Peer, router, session};
use crate::session::{Gateway, Role};
use crate::support::json_process::Mark;
use crate::support::peer::domain;
use crate::support::ports::free_port;
use crate::support::prerequisite::require;
use crate::support::waiting::wait_until;

const NODE: &str = "vehicle/gateway_under_test";
const NAMES: [&str; 3] = ["ros.domain_id", "ros.only_networks", "use_sim_time"];
/// Names of the services, and their types.
const SERVICES: [(&str, &str, &str); 7] = [
    ("describe_parameters", "rcl_interfaces", "DescribeParameters"),
    ("get_parameter_types", "rcl_interfaces", "GetParameterTypes"),
    ("get_parameters", "rcl_interfaces", "GetParameters"),
    ("list_parameters", "rcl_interfaces", "ListParameters"),
    ("set_parameters", "rcl_interfaces", "SetParameters"),
    ("set_parameters_atomically", "rcl_interfaces", "SetParametersAtomically"),
    ("layout", "autoware_adapi_v1_msgs", "GetDoorLayout"),
];

/// The node or folder in which a service is.
fn folder(service: &str) -> &'static str {
    if service == "layout" { "vehicle/doors" } else { NODE }
}

/// A client that counts its requests.
struct Client {
    peer: Peer,
    domain: u16,
    /// What stands in keys for hashes; by default the hash itself.
    hash: Option<&'static str>,
    sent: u64,
}

impl Client {
    fn key(&self, service: &str) -> String {
        let (_, package, type_name) = SERVICES.into_iter().find(|(name, ..)| *name == service).unwrap();
        let hash = self.hash.unwrap_or_else(|| type_hash(&format!("{package}/srv/{type_name}")).unwrap());
        format!("{}/{}/{service}/{package}::srv::dds_::{type_name}_/{hash}", self.domain, folder(service))
    }

    /// Asks, with other keys of the request if any, and gives the only reply.
    fn ask(&mut self, service: &str, arguments: &[&str], other: &Value) -> Value {
        self.sent += 1;
        let mut request = json!({"ask": self.key(service), "service": service, "arguments": arguments, "number": self.sent});
        request.as_object_mut().unwrap().extend(other.as_object().unwrap().clone());
        let mark = self.peer.mark();
        self.peer.order(&request);
        let answers = self.peer.answers(mark);
        assert_eq!(answers.len(), 1, "{answers:?}");
        assert_eq!(answers[0]["number"], self.sent);
        answers[0].clone()
    }

    fn answer(&mut self, service: &str, arguments: &[&str]) -> Value {
        let answer = self.ask(service, arguments, &json!({}));
        assert_eq!((&answer["key"], &answer["is_ours"]), (&json!(self.key(service)), &json!(true)));
        answer["data"].clone()
    }
}

fn start(domain: u16, port: u16, change: impl FnOnce(Role) -> Role) -> Gateway {
    change(Role::new(domain).over_zenoh(&session(port)).isolated()).with_parameters().start()
}

#[test]
fn parameters_are_listed_read_described_and_not_set() {
    let (domain, port) = (domain(), free_port());
    let _router = require!(Peer::start(domain, &router(port)));
    let gateway = start(domain, port, |role| role);
    let peer = require!(Peer::start(domain, &session(port)));
    let mut client = Client { peer, domain, hash: None, sent: 0 };
    for (name, package, _) in SERVICES {
        let key = client.key(name);
        let type_and_hash = &key[key.find(package).unwrap()..];
        let folder = folder(name).replace('/', "%");
        let service = format!("/SS/%/%vehicle/gateway_under_test/%{folder}%{name}/{type_and_hash}/");
        client.peer.token(Mark::START, "put", &[&service]);
    }
    assert_eq!(client.answer("list_parameters", &["0"]), json!({"names": NAMES, "prefixes": ["ros"]}));
    let values =
        client.answer("get_parameters", &["ros.domain_id", "nothing", "ros.only_networks"])["values"].clone();
    assert_eq!((&values[0]["type"], &values[0]["integer_value"]), (&json!(2), &json!(domain)));
    assert_eq!(values[1]["type"], 0, "not set");
    assert_eq!(values[2]["string_array_value"], json!(["127.0.0.1"]));
    let types = client.answer("get_parameter_types", &["use_sim_time", "ros.only_networks"]);
    assert_eq!(types, json!({"types": [1, 9]}));
    let described = client.answer("describe_parameters", &["use_sim_time"])["descriptors"].clone();
    assert_eq!((&described[0]["name"], &described[0]["read_only"]), (&json!("use_sim_time"), &json!(true)));
    let set = client.answer("set_parameters", &["use_sim_time", "x"])["results"].clone();
    let atomically = client.answer("set_parameters_atomically", &["use_sim_time"]);
    for result in [&set[0], &set[1], &atomically] {
        assert_eq!(result["successful"], false);
        assert!(result["reason"].as_str().unwrap().contains("read-only"), "{result}");
    }

    let layout = client.answer("layout", &[]);
    assert_eq!(layout["status"], json!({"success": true, "code": 0, "message": ""}));
    assert_eq!(layout["doors"], json!([{"roles": [1, 2], "description": "front left"}]));

    // A malformed request is refused and counted, and the next one is answered.
    for other in [
        json!({"raw": ""}),
        json!({"raw": "0001"}),
        json!({"raw": "00010000ffffffff"}),
        json!({"attach": false}),
    ] {
        let refused = client.ask("get_parameters", &["use_sim_time"], &other);
        assert!(refused["error"].is_string(), "{refused}");
    }
    gateway.wait_until("four refusals", |status| status["unanswered"] == 4);
    assert_eq!(client.answer("get_parameters", &["use_sim_time"])["values"][0]["bool_value"], true);

    // Another configuration is published, and shows in the answers.
    let hash = type_hash("rcl_interfaces/msg/ParameterEvent").unwrap();
    let key = format!("{domain}/parameter_events/rcl_interfaces::msg::dds_::ParameterEvent_/{hash}");
    client.peer.read("events", "parameter_event", &key, false);
    // The request takes the way that the reader's announcement took, and so arrives after it.
    client.answer("get_parameters", &["use_sim_time"]);
    gateway.send("parameters");
    let event = client.peer.sample(Mark::START, "events", |_| true)["data"].clone();
    assert_eq!(event["node"], format!("/{NODE}"));
    assert_eq!(event["new_parameters"][0]["name"], "reports.rate_hz");
    assert_eq!(event["deleted_parameters"].as_array().unwrap().len(), NAMES.len());
    let others = json!({"names": ["reports.rate_hz"], "prefixes": ["reports"]});
    wait_until("the other parameters", || client.answer("list_parameters", &["0"]) == others);
}

#[test]
fn humble_has_its_word_in_the_place_of_hashes() {
    let (domain, port) = (domain(), free_port());
    let _router = require!(Peer::start(domain, &router(port)));
    let _gateway = start(domain, port, Role::with_keys_of_humble);
    let peer = require!(Peer::start(domain, &session(port)));
    let mut client = Client { peer, domain, hash: Some("TypeHashNotSupported"), sent: 0 };
    client.peer.token(Mark::START, "put", &["/SS/", "%list_parameters/"]);
    assert_eq!(client.answer("list_parameters", &["0"])["names"], json!(NAMES));
}
