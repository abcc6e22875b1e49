//! What the network side sends to the gateway, which trusts nothing of it: a stream of any bytes, cut
//! anywhere.
#![no_main]

use std::sync::Arc;
use std::time::Instant;

use libfuzzer_sys::fuzz_target;
use traffic_lights::target::{LightChannel, StoreLayer, StoreId};
use signal_gateway::io::ros::inbox::Inbox;
use ros_transport::link::{FrameBuffer, FromNetwork};
use signal_gateway::io::ros::reception::TopicReception;
use signal_gateway::io::ros::topics::{Subscription, SubscriptionKind};

/// Topics that are written.
const WRITTEN: usize = 3;

fuzz_target!(|data: &[u8]| {
    let Some((size, stream)) = data.split_first() else { return };
    let store = StoreId { channel: LightChannel::V2i, layer: StoreLayer::GroundTruth };
    let kinds = [
        SubscriptionKind::Command,
        SubscriptionKind::Groups(store),
        SubscriptionKind::Route,
        SubscriptionKind::TurnCommand,
        SubscriptionKind::ControlMode,
    ];
    let subscriptions = kinds.map(|kind| Subscription::new("/topic", kind));
    let inbox = Arc::new(Inbox::default());
    let mut reception = TopicReception::new(&subscriptions, WRITTEN, Arc::clone(&inbox));
    let mut frames = FrameBuffer::default();
    let mut take = |frame: &[u8]| reception.take(&FromNetwork::decode(frame)?, Instant::now());
    for piece in stream.chunks(usize::from(*size).max(1)) {
        frames.extend(piece);
        loop {
            match frames.next_frame() {
                Ok(Some(frame)) if take(frame).is_ok() => {}
                Ok(None) => break,
                // The network side is killed.
                Ok(Some(_)) | Err(_) => return,
            }
        }
    }
    let received: u64 = reception.statuses().map(|status| status.received).sum();
    let waiting = std::iter::from_fn(|| inbox.try_take()).count();
    assert!(u64::try_from(waiting).unwrap() <= received && received <= stream.len() as u64 / 28);
});
