//! Receives the network side's messages: converts samples to inputs, and its state to a status. No content is
//! trusted.

use std::sync::Arc;
use std::time::Instant;

use super::duplicate_filter::{DuplicateFilter, Receipt};
use super::inbox::{Arrival, Inbox};
use super::reading::read;
use super::topics::{Subscription, SubscriptionKind};
use crate::process_status::network::NetworkFailure;
use gateway_core::command::origin::{SampleId, WriterId};
use gateway_core::gateway::event::Input;
use ros_transport::link::{FromNetwork, Sample, Violation};
use traffic_lights::input::TrafficLightInput;

/// State and counts of a subscribed topic.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct IncomingStatus {
    /// Absolute name of the topic.
    pub name: Arc<str>,
    /// Number of currently matched writers.
    pub writers: u32,
    /// Number of samples passed to the inbox.
    pub received: u64,
    /// Number of samples that were not of the topic's type.
    pub undecodable: u64,
    /// Number of groups that were omitted because of an undefined number.
    pub rejected_groups: u64,
}

/// The subscriptions of a session, with their counts.
#[derive(Debug)]
pub struct TopicReception {
    pub(super) inbox: Arc<Inbox>,
    /// Number of published topics.
    written: usize,
    subscriptions: Vec<ReceivedTopic>,
    pub(super) taken_anew: TakenAnew,
}

/// Statistics of writers that continued far below a number received under their identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TakenAnew {
    /// Number of occurrences.
    pub count: u64,
    /// Time of the last occurrence.
    pub last: Option<Instant>,
}

#[derive(Debug)]
struct ReceivedTopic {
    kind: SubscriptionKind,
    duplicate_filter: DuplicateFilter,
    status: IncomingStatus,
}

impl TopicReception {
    /// Creates a reception into an inbox, for a session with `written` published topics.
    pub fn new(subscriptions: &[Subscription], written: usize, inbox: Arc<Inbox>) -> Self {
        let received = |subscription: &Subscription| ReceivedTopic {
            kind: subscription.kind,
            duplicate_filter: DuplicateFilter::default(),
            status: IncomingStatus { name: subscription.name.as_str().into(), ..IncomingStatus::default() },
        };
        Self {
            inbox,
            written,
            subscriptions: subscriptions.iter().map(received).collect(),
            taken_anew: TakenAnew::default(),
        }
    }

    /// Processes a message of the network side: a sample goes to the inbox, unless it was received before,
    /// and the counts of a status are recorded.
    pub fn take(&mut self, message: &FromNetwork<'_>, now: Instant) -> Result<(), Violation> {
        match message {
            FromNetwork::Sample(sample) => self.take_sample(sample, now),
            FromNetwork::Unreadable(subscription, reason) => {
                undecodable(&mut self.subscription(*subscription)?.status, reason);
                Ok(())
            }
            FromNetwork::Status(status) => {
                let counts = [&status.readers, &status.other_writers, &status.writers];
                for (counts, expected) in
                    counts.into_iter().zip([self.written, self.written, self.subscriptions.len()])
                {
                    if counts.len() != expected {
                        return Err(Violation::Topic(counts.len()));
                    }
                }
                for (received, writers) in self.subscriptions.iter_mut().zip(&status.writers) {
                    received.status.writers = *writers;
                }
                Ok(())
            }
            FromNetwork::Ready | FromNetwork::Failed(_) | FromNetwork::Pong { .. } => Ok(()),
        }
    }

    /// Sets the number of matched writers of all topics to 0, since the network side is gone.
    pub fn lose_writers(&mut self) {
        self.subscriptions.iter_mut().for_each(|received| received.status.writers = 0);
    }

    /// Returns state and counts of the subscribed topics, in the order of the settings.
    pub fn statuses(&self) -> impl Iterator<Item = &IncomingStatus> {
        self.subscriptions.iter().map(|received| &received.status)
    }

    /// Records that `count` writers restarted their numbers, and warns at the first.
    pub fn note_taken_anew(&mut self, count: u32, now: Instant) {
        if self.taken_anew.count == 0 {
            tracing::warn!(
                "numbers far ahead came under the identity of a writer, which goes on below them: it is taken anew; look \
                 for who sends in its name"
            );
        }
        let count = self.taken_anew.count.saturating_add(count.into());
        self.taken_anew = TakenAnew { count, last: Some(now) };
    }

    fn subscription(&mut self, index: u16) -> Result<&mut ReceivedTopic, Violation> {
        let index = usize::from(index);
        self.subscriptions.get_mut(index).ok_or(Violation::Topic(index))
    }

    fn take_sample(&mut self, sample: &Sample<'_>, now: Instant) -> Result<(), Violation> {
        let ReceivedTopic { kind, duplicate_filter, status } = self.subscription(sample.subscription)?;
        let endian = sample.endian;
        let id = SampleId { writer: WriterId(sample.writer), sequence: sample.number };
        match read(*kind, id, sample.bytes, endian) {
            Ok(input) => {
                let receipt = duplicate_filter.take(sample.writer, sample.number, now);
                if receipt == Receipt::Again {
                    return Ok(());
                }
                status.received += 1;
                status.rejected_groups += rejected(&input);
                let (subscription, bytes) = (usize::from(sample.subscription), sample.bytes.to_vec().into());
                self.inbox.put(Arrival { subscription, input, bytes, endian });
                if receipt == Receipt::TakenAnew {
                    self.note_taken_anew(1, now);
                }
            }
            Err(error) => undecodable(status, &error.to_string()),
        }
        Ok(())
    }
}

fn undecodable(status: &mut IncomingStatus, reason: &str) {
    if status.undecodable == 0 {
        let (name, reason) = (&*status.name, printable(reason));
        tracing::warn!(log.subject = name, "{name}: a sample is not of the topic's type: {reason}");
    }
    status.undecodable += 1;
}

/// Returns the failure of a network side that gives this reason.
pub(super) fn not_started(reason: &str) -> NetworkFailure {
    NetworkFailure::NotStarted(printable(reason))
}

/// Replaces control characters, so that a text of the network side fits on one log line.
fn printable(text: &str) -> String {
    text.chars().map(|character| if character.is_control() { ' ' } else { character }).collect()
}

/// Returns the number of groups of the input that could not be read.
fn rejected(input: &Input) -> u64 {
    match input {
        Input::TrafficLight(
            TrafficLightInput::States { rejected, .. } | TrafficLightInput::Camera { rejected, .. },
        ) => u64::from(*rejected),
        Input::TrafficLight(_) | Input::Can(_) | Input::Planner(_) | Input::Command(_) | Input::Tick => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ros_messages::cdr::Endian;
    use ros_transport::link::NetworkStatus;

    fn reception() -> TopicReception {
        let subscriptions = [Subscription::new("/c", SubscriptionKind::Command)];
        TopicReception::new(&subscriptions, 2, Arc::default())
    }

    fn text(number: i64, bytes: &[u8]) -> FromNetwork<'_> {
        let endian = Endian::Little;
        FromNetwork::Sample(Sample { subscription: 0, writer: [1; 16], number, endian, bytes })
    }

    #[test]
    fn a_sample_is_handed_on_once_and_an_undecodable_one_is_counted() {
        let mut reception = reception();
        let hello = [3, 0, 0, 0, b'a', b'b', 0];
        for sample in [text(1, &hello), text(1, &hello), text(2, &hello), text(3, &[1])] {
            assert_eq!(reception.take(&sample, Instant::now()), Ok(()));
        }
        assert_eq!(reception.take(&FromNetwork::Unreadable(0, "line\nbreak"), Instant::now()), Ok(()));
        let status = reception.statuses().next().unwrap();
        assert_eq!((status.received, status.undecodable), (2, 2));
        assert_eq!(std::iter::from_fn(|| reception.inbox.try_take()).count(), 2);
    }

    #[test]
    fn topics_that_do_not_exist_are_violations() {
        let mut reception = reception();
        let unknown = FromNetwork::Unreadable(1, "");
        assert_eq!(reception.take(&unknown, Instant::now()), Err(Violation::Topic(1)));
        let mut status = |readers: &[u32], other_writers: &[u32], writers: &[u32]| {
            let [readers, other_writers, writers] = [readers, other_writers, writers].map(<[u32]>::to_vec);
            let status = NetworkStatus { readers, writers, other_writers, ..NetworkStatus::default() };
            reception.take(&FromNetwork::Status(status), Instant::now())
        };
        assert_eq!(status(&[1, 2], &[0, 1], &[3]), Ok(()));
        assert_eq!(status(&[1], &[0, 1], &[3]), Err(Violation::Topic(1)));
        assert_eq!(status(&[1, 2], &[0, 1, 2], &[3]), Err(Violation::Topic(3)));
        assert_eq!(status(&[1, 2], &[0, 1], &[]), Err(Violation::Topic(0)));
        assert_eq!(reception.statuses().next().unwrap().writers, 3);
        reception.lose_writers();
        assert_eq!(reception.statuses().next().unwrap().writers, 0);
    }

    #[test]
    fn a_text_stays_on_its_line() {
        assert_eq!(not_started("a\nb"), NetworkFailure::NotStarted("a b".to_owned()));
    }
}
