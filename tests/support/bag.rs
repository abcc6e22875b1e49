//! The messages of a bag as the gateway reads them, to compare two bags byte by byte.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use can_log::file_budget::FileBudget;
use can_log::{Choose, RecordedTopic, open_messages};
use ros_messages::cdr::{CdrBytes, encapsulated, read_message};
use ros_messages::diagnostic_msgs::DiagnosticArray;
use signal_gateway::process_status::PROCESS_TASKS;

/// The messages of each topic, in the order of the file.
pub(crate) type Messages = BTreeMap<String, Vec<Vec<u8>>>;

/// Reads all messages of a file, but what tells of the process itself: its statuses, and its log.
pub(crate) fn messages(file: &Path) -> Messages {
    let choose: Choose<String> = Arc::new(|topic: &RecordedTopic<'_>| Some(topic.name.to_owned()));
    let mut reader = open_messages(file, &choose, &FileBudget::default()).unwrap();
    let mut messages = Messages::new();
    while let Some(read) = reader.advance().unwrap() {
        read.unwrap();
        let message = reader.message().unwrap();
        let bytes = match message.topic.as_str() {
            "/rosout" => None,
            "/diagnostics" => of_gateway(message.bytes),
            _ => Some(message.bytes.to_vec()),
        };
        messages.entry(message.topic.clone()).or_default().extend(bytes);
    }
    messages
}

/// Leaves out the statuses of the process; `None` if nothing else is left.
fn of_gateway(bytes: &[u8]) -> Option<Vec<u8>> {
    let (endian, bytes) = encapsulated(bytes).unwrap();
    let mut array: DiagnosticArray = read_message(bytes, endian).unwrap();
    let is_of_process = |name: &str| PROCESS_TASKS.iter().any(|task| name.ends_with(&format!(": {task}")));
    array.status.retain(|status| !is_of_process(&status.name));
    (!array.status.is_empty()).then(|| CdrBytes::encode(&array).unwrap().as_ref().to_vec())
}

/// Asserts that two bags have the same messages on each topic, and returns how many there are.
pub(crate) fn assert_same(recorded: &Messages, replayed: &Messages) -> BTreeMap<String, usize> {
    let topics: Vec<_> = recorded.keys().collect();
    assert_eq!(topics, replayed.keys().collect::<Vec<_>>());
    for (topic, messages) in recorded {
        let again = &replayed[topic];
        let differing = messages.iter().zip(again).position(|(message, again)| message != again);
        let place = differing.unwrap_or(messages.len().min(again.len()));
        assert!(
            messages == again,
            "{topic}: {} recorded, {} replayed, message {place} differs:\n{:02X?}\n{:02X?}",
            messages.len(),
            again.len(),
            messages.get(place),
            again.get(place)
        );
    }
    recorded.iter().map(|(topic, messages)| (topic.clone(), messages.len())).collect()
}
