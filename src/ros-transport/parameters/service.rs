//! The services of the node, and their responses: six for parameters, and one for the layout of the doors.

use serde::{Deserialize, Serialize};

use super::parameter_set::Parameters;
use super::value::ParameterValue;
#[cfg(feature = "ros")]
use crate::error::TransportError;
use ros_messages::TypeName;
use ros_messages::autoware_adapi_v1_msgs::{DoorLayout, GetDoorLayoutResponse, ResponseStatus};
#[cfg(feature = "ros")]
use ros_messages::builtin_interfaces::Time;
use ros_messages::cdr::{CdrBytes, Endian, Unreadable, read_message};
use ros_messages::rcl_interfaces::{
    GetParametersRequest, ListParametersRequest, ListParametersResult, Parameter, ParameterDescriptor,
    SetParametersRequest, SetParametersResult,
};

/// Maximum length of a request, bytes.
pub const MAX_REQUEST: usize = 64 * 1024;
/// Maximum length of a response, bytes. A request may name a parameter many times.
pub const MAX_RESPONSE: usize = 1024 * 1024;
/// Maximum number of names or parameters in a request.
const MAX_NAMES: usize = 1000;
/// The reason why a parameter is not set.
const READ_ONLY: &str = "read-only: change the configuration file and reload";

/// A service of the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeService {
    /// The service `describe_parameters`.
    Describe,
    /// The service `get_parameter_types`.
    GetTypes,
    /// The service `get_parameters`.
    Get,
    /// The service `list_parameters`.
    List,
    /// The service `set_parameters`.
    Set,
    /// The service `set_parameters_atomically`.
    SetAtomically,
    /// The layout of the doors.
    DoorLayout,
}

/// A message with one field.
#[derive(Serialize)]
struct ListMessage<T> {
    field: T,
}

impl NodeService {
    /// The services for parameters, each with its name below the node.
    const FOR_PARAMETERS: [(Self, &'static str); 6] = [
        (Self::Describe, "describe_parameters"),
        (Self::GetTypes, "get_parameter_types"),
        (Self::Get, "get_parameters"),
        (Self::List, "list_parameters"),
        (Self::Set, "set_parameters"),
        (Self::SetAtomically, "set_parameters_atomically"),
    ];

    /// Returns the full name of its type.
    pub const fn type_name(self) -> TypeName {
        match self {
            Self::Describe => "rcl_interfaces/srv/DescribeParameters",
            Self::GetTypes => "rcl_interfaces/srv/GetParameterTypes",
            Self::Get => "rcl_interfaces/srv/GetParameters",
            Self::List => "rcl_interfaces/srv/ListParameters",
            Self::Set => "rcl_interfaces/srv/SetParameters",
            Self::SetAtomically => "rcl_interfaces/srv/SetParametersAtomically",
            Self::DoorLayout => "autoware_adapi_v1_msgs/srv/GetDoorLayout",
        }
    }

    /// Returns the response to a request. Safe for any bytes.
    ///
    /// # Errors
    /// Fails if the request has another layout, is too long, or would have too long a response.
    pub fn answer(
        self,
        contents: &ServiceContents,
        request: &[u8],
        endian: Endian,
    ) -> Result<CdrBytes, Unreadable> {
        within(request.len(), MAX_REQUEST)?;
        let ServiceContents { parameters, doors } = contents;
        match self {
            Self::Describe => encode(names(request, endian)?.iter().map(|name| descriptor(name, parameters))),
            Self::GetTypes => {
                let number = |name: &String| parameters.get(name).map_or(0, ParameterValue::type_number);
                encode(names(request, endian)?.iter().map(number))
            }
            Self::Get => {
                let value = |name: &String| parameters.get(name).map(ParameterValue::message);
                encode(names(request, endian)?.iter().map(|name| value(name).unwrap_or_default()))
            }
            Self::List => {
                let ListParametersRequest { prefixes, depth } = read_message(request, endian)?;
                within(prefixes.len(), MAX_NAMES)?;
                finish(&list(parameters, &prefixes, depth))
            }
            Self::Set => {
                let SetParametersRequest { parameters } = read_message(request, endian)?;
                within(parameters.len(), MAX_NAMES)?;
                encode(parameters.iter().map(|_: &Parameter| refusal()))
            }
            Self::SetAtomically => {
                let SetParametersRequest { parameters } = read_message(request, endian)?;
                within(parameters.len(), MAX_NAMES)?;
                finish(&refusal())
            }
            Self::DoorLayout => {
                let status = ResponseStatus { success: true, ..ResponseStatus::default() };
                let doors = doors.iter().flat_map(|layout| layout.doors.clone()).collect();
                finish(&GetDoorLayoutResponse { status, doors })
            }
        }
    }
}

/// The doors of the vehicle, as returned by a service.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct DoorLayouts {
    /// Absolute name of the service.
    pub service: String,
    /// The doors in the order of their states.
    pub doors: Vec<DoorLayout>,
}

/// Content of the node's services.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ServiceContents {
    /// The parameters of the node.
    pub parameters: Parameters,
    /// The layout of the doors; `None` without a service for it.
    pub doors: Option<DoorLayouts>,
}

impl ServiceContents {
    /// Returns the services of a node, each with its absolute name.
    pub fn services(&self, node: &str) -> Vec<(NodeService, String)> {
        let for_parameters = NodeService::FOR_PARAMETERS.map(|(one, name)| (one, format!("{node}/{name}")));
        let doors = self.doors.iter().map(|layout| (NodeService::DoorLayout, layout.service.clone()));
        for_parameters.into_iter().chain(doors).collect()
    }

    /// Replaces the parameters of this node, and publishes the differences as an event with this stamp.
    #[cfg(feature = "ros")]
    pub(crate) fn set_parameters(
        &mut self,
        parameters: Parameters,
        node: &str,
        stamp: Time,
        publish: impl FnOnce(CdrBytes) -> Result<(), TransportError>,
    ) {
        let event = parameters.event_after(&self.parameters, node, stamp);
        self.parameters = parameters;
        let published = event.map(|event| publish(CdrBytes::encode(&event)?));
        if let Some(Err(reason)) = published {
            tracing::warn!("the change of the parameters is not on /parameter_events: {reason}");
        }
    }
}

fn names(request: &[u8], endian: Endian) -> Result<Vec<String>, Unreadable> {
    let GetParametersRequest { names } = read_message(request, endian)?;
    within(names.len(), MAX_NAMES)?;
    Ok(names)
}

fn within(length: usize, limit: usize) -> Result<(), Unreadable> {
    if length <= limit { Ok(()) } else { Err(Unreadable::TooMuch { length, limit }) }
}

/// Encodes a response whose only field is a list; stops at the limit.
fn encode<T: Serialize>(elements: impl Iterator<Item = T>) -> Result<CdrBytes, Unreadable> {
    let (mut list, mut length) = (Vec::new(), 0);
    for element in elements {
        length += finish(&element)?.as_ref().len();
        within(length, MAX_RESPONSE)?;
        list.push(element);
    }
    finish(&ListMessage { field: list })
}

fn finish(response: &impl Serialize) -> Result<CdrBytes, Unreadable> {
    CdrBytes::encode(response).map_err(|error| Unreadable::Layout(error.to_string()))
}

fn refusal() -> SetParametersResult {
    SetParametersResult { successful: false, reason: READ_ONLY.to_owned() }
}

fn descriptor(name: &str, parameters: &Parameters) -> ParameterDescriptor {
    let value = parameters.get(name);
    ParameterDescriptor {
        name: name.to_owned(),
        description: parameters.description(name).to_owned(),
        r#type: value.map_or(0, ParameterValue::type_number),
        additional_constraints: if value.is_some() { READ_ONLY.to_owned() } else { String::new() },
        read_only: true,
        ..ParameterDescriptor::default()
    }
}

/// Returns the parameters below the prefixes, at most `depth` levels below, and the prefixes of these levels.
fn list(parameters: &Parameters, prefixes: &[String], depth: u64) -> ListParametersResult {
    let is_within = |rest: &str| depth == 0 || rest.split('.').count() as u64 <= depth;
    let is_listed = |name: &str| {
        let below = |prefix: &String| match name.strip_prefix(prefix.as_str()) {
            Some("") => true,
            Some(rest) => rest.strip_prefix('.').is_some_and(is_within),
            None => false,
        };
        if prefixes.is_empty() { is_within(name) } else { prefixes.iter().any(below) }
    };
    let names: Vec<_> = parameters.names().filter(|name| is_listed(name)).map(str::to_owned).collect();
    let mut levels: Vec<_> =
        names.iter().filter_map(|name| Some(name.rsplit_once('.')?.0.to_owned())).collect();
    levels.dedup();
    ListParametersResult { names, prefixes: levels }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use ros_messages::rcl_interfaces::ParameterValue as ValueMessage;

    fn contents() -> ServiceContents {
        let mut parameters = Parameters::default();
        parameters.set("use_sim_time", false);
        parameters.set("ros.domain_id", 7);
        parameters.set("ros.topics.diagnostics", "/diagnostics");
        parameters.set("ros.only_networks", vec!["127.0.0.1".to_owned()]);
        parameters.set("reports.rate_hz", ParameterValue::Double(12.5));
        let door = |description: &str, roles: &[u8]| DoorLayout {
            roles: roles.to_vec(),
            description: description.to_owned(),
        };
        let doors = vec![door("front left", &[DoorLayout::GET_OFF]), door("rear", &[])];
        let doors = Some(DoorLayouts { service: "/vehicle/doors/layout".to_owned(), doors });
        ServiceContents { parameters, doors }
    }

    fn request(message: &impl Serialize) -> CdrBytes {
        CdrBytes::encode(message).unwrap()
    }

    fn answer<T: serde::de::DeserializeOwned>(service: NodeService, request: &CdrBytes) -> T {
        let answer = service.answer(&contents(), request.as_ref(), Endian::Little).unwrap();
        read_message(answer.as_ref(), Endian::Little).unwrap()
    }

    fn named(names: &[&str]) -> CdrBytes {
        request(&GetParametersRequest { names: names.iter().map(|name| (*name).to_owned()).collect() })
    }

    #[test]
    fn values_types_and_descriptions_are_those_of_the_names_and_what_is_not_there_is_not_set() {
        let names =
            named(&["use_sim_time", "ros.domain_id", "reports.rate_hz", "nothing", "ros.only_networks"]);
        let values: Vec<ValueMessage> = answer(NodeService::Get, &names);
        let types: Vec<u8> = answer(NodeService::GetTypes, &names);
        let described: Vec<ParameterDescriptor> = answer(NodeService::Describe, &names);
        assert_eq!(types, [1, 2, 3, 0, 9]);
        assert_eq!(values.iter().map(|value| value.r#type).collect::<Vec<_>>(), types);
        assert_eq!(described.iter().map(|one| one.r#type).collect::<Vec<_>>(), types);
        assert_eq!((values[0].bool_value, values[1].integer_value), (false, 7));
        assert!((values[2].double_value - 12.5).abs() < f64::EPSILON);
        assert_eq!(
            (&values[3], &values[4].string_array_value[..]),
            (&ValueMessage::default(), &["127.0.0.1".to_owned()][..])
        );
        assert!(described.iter().all(|one| one.read_only && !one.dynamic_typing));
    }

    #[test]
    fn parameters_are_listed_by_prefix_and_depth() {
        let list = |prefixes: &[&str], depth| {
            let prefixes = prefixes.iter().map(|prefix| (*prefix).to_owned()).collect();
            let list: ListParametersResult =
                answer(NodeService::List, &request(&ListParametersRequest { prefixes, depth }));
            (list.names.join(" "), list.prefixes.join(" "))
        };
        let all = "reports.rate_hz ros.domain_id ros.only_networks ros.topics.diagnostics use_sim_time";
        let expect = |names: &str, levels: &str| (names.to_owned(), levels.to_owned());
        assert_eq!(list(&[], 0), expect(all, "reports ros ros.topics"));
        assert_eq!(list(&[], 1), expect("use_sim_time", ""));
        assert_eq!(list(&["ros"], 1), expect("ros.domain_id ros.only_networks", "ros"));
        assert_eq!(
            list(&["ros.topics", "use_sim_time"], 0),
            expect("ros.topics.diagnostics use_sim_time", "ros.topics")
        );
        assert_eq!(list(&["r", "ros.domain", ""], 0), expect("", ""));
    }

    #[test]
    fn nothing_is_set_and_the_reason_says_what_to_do() {
        let value = Parameter { name: "use_sim_time".to_owned(), value: ValueMessage::default() };
        let two = request(&SetParametersRequest { parameters: vec![value.clone(), value] });
        let each: Vec<SetParametersResult> = answer(NodeService::Set, &two);
        assert_eq!(each, [refusal(), refusal()]);
        assert!(!each[0].successful && each[0].reason.contains("configuration file"));
        let together: SetParametersResult = answer(NodeService::SetAtomically, &two);
        assert_eq!(together, refusal());
    }

    #[test]
    fn the_doors_are_told_in_their_order_whatever_the_request_has() {
        for request in [&[0][..], &[], &[1, 2, 3]] {
            let answer = NodeService::DoorLayout.answer(&contents(), request, Endian::Little).unwrap();
            let told: GetDoorLayoutResponse = read_message(answer.as_ref(), Endian::Little).unwrap();
            assert_eq!(Some(told.doors), contents().doors.map(|layout| layout.doors));
            assert_eq!((told.status.success, told.status.code), (true, 0));
        }
    }

    #[test]
    fn the_service_for_doors_is_there_only_with_doors() {
        let names = |contents: ServiceContents| {
            contents.services("/car/gateway").into_iter().map(|(_, name)| name).collect::<Vec<_>>()
        };
        let all = names(contents());
        assert_eq!(
            (all[0].as_str(), all[6].as_str()),
            ("/car/gateway/describe_parameters", "/vehicle/doors/layout")
        );
        assert_eq!(names(ServiceContents { doors: None, ..contents() }), all[..6]);
    }

    #[test]
    fn what_is_too_long_or_makes_too_much_is_refused() {
        let many = |count| {
            NodeService::Get.answer(&contents(), named(&vec!["use_sim_time"; count]).as_ref(), Endian::Little)
        };
        assert!(many(MAX_NAMES).is_ok());
        assert_eq!(many(MAX_NAMES + 1), Err(Unreadable::TooMuch { length: 1001, limit: MAX_NAMES }));
        let bytes = vec![0; MAX_REQUEST + 4];
        for (service, _) in contents().services("/gateway") {
            let refused = service.answer(&contents(), &bytes, Endian::Little);
            assert_eq!(refused, Err(Unreadable::TooMuch { length: MAX_REQUEST + 4, limit: MAX_REQUEST }));
        }
        let mut large = ServiceContents::default();
        large.parameters.set("a", "x".repeat(4096).as_str());
        let refused = NodeService::Get.answer(&large, named(&["a"; 300]).as_ref(), Endian::Little);
        assert!(matches!(refused, Err(Unreadable::TooMuch { limit: MAX_RESPONSE, .. })), "{refused:?}");
    }

    proptest! {
        #[test]
        fn any_request_is_answered_within_bounds_or_refused(
            bytes in prop::collection::vec(any::<u8>(), 0..200),
            small in prop::collection::vec(0..4_u8, 0..200),
            is_little in any::<bool>(),
        ) {
            let endian = if is_little { Endian::Little } else { Endian::Big };
            for request in [&bytes, &small] {
                for (service, _) in contents().services("/gateway") {
                    if let Ok(answer) = service.answer(&contents(), request, endian) {
                        prop_assert!(answer.as_ref().len() <= MAX_RESPONSE + 8);
                    }
                }
            }
        }
    }
}
