//! The calls of the gateway as messages of a recording.

use super::signal_gateway_msgs::GatewayCall as Message;
use can_signal::can::{BusIndex, LogNote};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::command::origin::{SampleId, WriterId};
use gateway_core::command::sender::SendFailure;
use gateway_core::gateway::call::{GatewayCall, TimedCall};

impl From<&TimedCall> for Message {
    fn from(timed: &TimedCall) -> Self {
        let message = Self {
            number: timed.number,
            monotonic_ns: timed.at.mono.as_nanos(),
            wall_ns: timed.at.wall.as_nanos(),
            ..Self::default()
        };
        match &timed.call {
            GatewayCall::Start(links) => {
                let notes = links.iter().map(|link| LogNote::Link(*link).to_string()).collect();
                Self { kind: Self::START, notes, ..message }
            }
            GatewayCall::Read(inputs) => Self { kind: Self::READ, value: (*inputs).into(), ..message },
            GatewayCall::Note(bus, note) => {
                Self { kind: Self::NOTE, bus: bus.0, notes: vec![note.to_string()], ..message }
            }
            GatewayCall::Sample(SampleId { writer, sequence }) => {
                Self { kind: Self::SAMPLE, value: *sequence, writer: writer.0.to_vec(), ..message }
            }
            GatewayCall::Look => Self { kind: Self::LOOK, ..message },
            GatewayCall::Sent => Self { kind: Self::SENT, ..message },
            GatewayCall::SendFailed(SendFailure::QueueFull) => {
                Self { kind: Self::SEND_QUEUE_FULL, ..message }
            }
            GatewayCall::SendFailed(SendFailure::Refused(errno)) => {
                Self { kind: Self::SEND_REFUSED, value: (*errno).into(), ..message }
            }
            GatewayCall::Reconfigure => Self { kind: Self::RECONFIGURE, ..message },
            GatewayCall::Stop => Self { kind: Self::STOP, ..message },
        }
    }
}

impl Message {
    /// Returns the call; `None` for a kind that is not known, or with contents that it does not have.
    pub fn call(&self) -> Option<TimedCall> {
        let mut notes = self.notes.iter().map(|note| LogNote::parse(note.split(' ')));
        let call = match self.kind {
            Self::START => {
                let links = notes.by_ref().map(|note| match note? {
                    LogNote::Link(link) => Some(link),
                    LogNote::Controller(_) | LogNote::Drops(_) | LogNote::Mark(_) => None,
                });
                GatewayCall::Start(links.collect::<Option<_>>()?)
            }
            Self::READ => GatewayCall::Read(self.value.try_into().ok()?),
            Self::NOTE => GatewayCall::Note(BusIndex(self.bus), notes.next()??),
            Self::SAMPLE => {
                let writer = WriterId(self.writer.as_slice().try_into().ok()?);
                GatewayCall::Sample(SampleId { writer, sequence: self.value })
            }
            Self::LOOK => GatewayCall::Look,
            Self::SENT => GatewayCall::Sent,
            Self::SEND_QUEUE_FULL => GatewayCall::SendFailed(SendFailure::QueueFull),
            Self::SEND_REFUSED => GatewayCall::SendFailed(SendFailure::Refused(self.value.try_into().ok()?)),
            Self::RECONFIGURE => GatewayCall::Reconfigure,
            Self::STOP => GatewayCall::Stop,
            _ => return None,
        };
        let (mono, wall) = (MonoTime::from_nanos(self.monotonic_ns), WallStamp::from_nanos(self.wall_ns));
        Some(TimedCall { number: self.number, at: Now { mono, wall }, call })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::ros::messages::CdrBytes;
    use crate::io::ros::reading::{Endian, read_message};
    use can_signal::can::LinkState;

    #[test]
    fn each_call_is_read_back() {
        let calls = [
            GatewayCall::Start(vec![LinkState::Up, LinkState::Failed(19), LinkState::Missing]),
            GatewayCall::Start(Vec::new()),
            GatewayCall::Read(12),
            GatewayCall::Note(BusIndex(2), LogNote::Drops(7)),
            GatewayCall::Sample(SampleId { writer: WriterId([9; 16]), sequence: -5 }),
            GatewayCall::Look,
            GatewayCall::Sent,
            GatewayCall::SendFailed(SendFailure::QueueFull),
            GatewayCall::SendFailed(SendFailure::Refused(100)),
            GatewayCall::Reconfigure,
            GatewayCall::Stop,
        ];
        let at = Now { mono: MonoTime::from_nanos(123), wall: WallStamp::from_nanos(-4) };
        for (number, call) in (1..).zip(calls) {
            let timed = TimedCall { number, at, call };
            let bytes = CdrBytes::encode(&Message::from(&timed)).unwrap();
            let message: Message = read_message(bytes.as_ref(), Endian::Little).unwrap();
            assert_eq!(message.call(), Some(timed));
        }
    }

    #[test]
    fn what_is_no_call_is_refused() {
        let wrong = [
            Message { kind: 0, ..Message::default() },
            Message { kind: Message::READ, value: -1, ..Message::default() },
            Message { kind: Message::NOTE, ..Message::default() },
            Message { kind: Message::SAMPLE, writer: vec![0; 15], ..Message::default() },
            Message { kind: Message::START, notes: vec!["drops 1".to_owned()], ..Message::default() },
            Message { kind: Message::SEND_REFUSED, value: 1 << 40, ..Message::default() },
        ];
        assert!(wrong.iter().all(|message| message.call().is_none()));
    }
}
