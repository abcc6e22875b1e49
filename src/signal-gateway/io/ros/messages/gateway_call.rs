//! Calls of the gateway as messages of a recording.

use can_signal::can::{BusIndex, LogNote};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::command::origin::{SampleId, WriterId};
use gateway_core::command::sender::SendFailure;
use gateway_core::gateway::call::{GatewayCall, TimedCall};
use ros_messages::signal_gateway_msgs::GatewayCall as Message;

/// Creates the message of a call.
pub fn call_message(timed: &TimedCall) -> Message {
    let message = Message {
        number: timed.number,
        monotonic_ns: timed.at.mono.as_nanos(),
        wall_ns: timed.at.wall.as_nanos(),
        ..Message::default()
    };
    match &timed.call {
        GatewayCall::Start(links) => {
            let notes = links.iter().map(|link| LogNote::Link(*link).to_string()).collect();
            Message { kind: Message::START, notes, ..message }
        }
        GatewayCall::Read(inputs) => Message { kind: Message::READ, value: (*inputs).into(), ..message },
        GatewayCall::Note(bus, note) => {
            Message { kind: Message::NOTE, bus: bus.0, notes: vec![note.to_string()], ..message }
        }
        GatewayCall::Sample(SampleId { writer, sequence }) => {
            Message { kind: Message::SAMPLE, value: *sequence, writer: writer.0.to_vec(), ..message }
        }
        GatewayCall::Look => Message { kind: Message::LOOK, ..message },
        GatewayCall::Sent => Message { kind: Message::SENT, ..message },
        GatewayCall::SendFailed(SendFailure::QueueFull) => {
            Message { kind: Message::SEND_QUEUE_FULL, ..message }
        }
        GatewayCall::SendFailed(SendFailure::Refused(errno)) => {
            Message { kind: Message::SEND_REFUSED, value: (*errno).into(), ..message }
        }
        GatewayCall::Reconfigure => Message { kind: Message::RECONFIGURE, ..message },
        GatewayCall::Stop => Message { kind: Message::STOP, ..message },
    }
}

/// Returns the call of a message; `None` if the kind is unknown or the contents do not fit it.
pub fn timed_call(message: &Message) -> Option<TimedCall> {
    let mut notes = message.notes.iter().map(|note| LogNote::parse(note.split(' ')));
    let call = match message.kind {
        Message::START => {
            let links = notes.by_ref().map(|note| match note? {
                LogNote::Link(link) => Some(link),
                LogNote::Controller(_) | LogNote::Drops(_) | LogNote::Mark(_) => None,
            });
            GatewayCall::Start(links.collect::<Option<_>>()?)
        }
        Message::READ => GatewayCall::Read(message.value.try_into().ok()?),
        Message::NOTE => GatewayCall::Note(BusIndex(message.bus), notes.next()??),
        Message::SAMPLE => {
            let writer = WriterId(message.writer.as_slice().try_into().ok()?);
            GatewayCall::Sample(SampleId { writer, sequence: message.value })
        }
        Message::LOOK => GatewayCall::Look,
        Message::SENT => GatewayCall::Sent,
        Message::SEND_QUEUE_FULL => GatewayCall::SendFailed(SendFailure::QueueFull),
        Message::SEND_REFUSED => {
            GatewayCall::SendFailed(SendFailure::Refused(message.value.try_into().ok()?))
        }
        Message::RECONFIGURE => GatewayCall::Reconfigure,
        Message::STOP => GatewayCall::Stop,
        _ => return None,
    };
    let (mono, wall) = (MonoTime::from_nanos(message.monotonic_ns), WallStamp::from_nanos(message.wall_ns));
    Some(TimedCall { number: message.number, at: Now { mono, wall }, call })
}

#[cfg(test)]
mod tests {
    use super::*;
    use can_signal::can::LinkState;
    use ros_messages::cdr::{CdrBytes, Endian, read_message};

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
            let bytes = CdrBytes::encode(&call_message(&timed)).unwrap();
            let message: Message = read_message(bytes.as_ref(), Endian::Little).unwrap();
            assert_eq!(timed_call(&message), Some(timed));
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
        assert!(wrong.iter().all(|message| timed_call(message).is_none()));
    }
}
