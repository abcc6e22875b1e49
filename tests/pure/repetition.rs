//! A frame that shows again what is known changes nothing: the gateway may leave its work to the next
//! deadline.
//!
//! The same day is driven twice, once with a tick after each frame, which makes the gateway look at
//! everything. Both give the same outputs at the same times.

use std::path::{Path, PathBuf};
use std::time::Duration;

use can_signal::can::frame::{CanId, Frame, FrameFormat};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::time::MonoTime;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::gateway::{Gateway, GatewaySettings};
use proptest::prelude::*;
use proptest::sample::Index;
use signal_gateway::config::files::{Embedded, Files};
use signal_gateway::config::{Overrides, load, load_profile};

use crate::support::clock::at;
use crate::support::property::for_all;

/// Contents of frames: few, so that most are repetitions.
const CONTENTS: [u8; 3] = [0, 0b0000_0010, 0b0101_0101];

/// What happens next, after a pause.
#[derive(Debug, Clone)]
enum Event {
    /// A frame of a relevant message with one of [`CONTENTS`].
    Frame(Index, usize),
    /// The link of a bus is lost and comes back.
    Relink(Index),
}

fn any_event() -> impl Strategy<Value = (u64, Event)> {
    let frame = (any::<Index>(), 0..CONTENTS.len()).prop_map(|(id, content)| Event::Frame(id, content));
    let event = prop_oneof![60 => frame, 1 => any::<Index>().prop_map(Event::Relink)];
    let pause_ns = prop_oneof![20 => 1..20_000_000_u64, 1 => 20_000_000..900_000_000_u64];
    (pause_ns, event)
}

/// Gateways of all kinds: each profile that is built in, as it is, and without checks of frames on buses that
/// may sleep; and the demos.
fn vehicles() -> Vec<GatewaySettings> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/vehicles");
    let mut profiles: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| Path::new("config/vehicles").join(entry.unwrap().file_name()))
        .collect();
    profiles.sort();
    let checked = profiles.iter().map(|profile| load_profile(&Embedded, profile).unwrap().gateway);
    let bare = checked.clone().map(|mut settings| {
        let tables = [&mut settings.lights.table, &mut settings.v2i.table];
        for message in tables.into_iter().flat_map(|table| &mut table.messages) {
            message.integrity = None;
        }
        for bus in &mut settings.buses {
            bus.may_sleep = true;
        }
        settings
    });
    let demos = ["config/demo.toml", "config/demo_commands.toml"].map(|path| {
        assert!(Embedded.read(Path::new(path)).is_ok(), "{path}");
        load(&Embedded, Path::new(path), &Overrides::default()).unwrap().gateway
    });
    checked.chain(bare).chain(demos).collect()
}

/// The identifiers that matter, with the format that their frames have.
fn messages(settings: &GatewaySettings) -> Vec<(BusIndex, CanId, Option<FrameFormat>)> {
    let buses = (0..=u8::MAX).map(BusIndex).take(settings.buses.len());
    let ids =
        buses.flat_map(|bus| settings.relevant_ids(bus).into_iter().map(move |ids| (bus, ids.described())));
    let bound = settings.lights.table.messages.iter().chain(&settings.v2i.table.messages);
    let bound: Vec<_> = bound.map(|message| (message.bus, message.ids.described(), message.format)).collect();
    let format =
        |bus, id| bound.iter().find(|known| (known.0, known.1) == (bus, id)).and_then(|known| known.2);
    ids.map(|(bus, id)| (bus, id, format(bus, id))).collect()
}

/// Everything that is given out, each with its time.
fn outputs(settings: &GatewaySettings, day: &[(u64, Event)], ticks: bool) -> Vec<(MonoTime, Output)> {
    let messages = messages(settings);
    let mut gateway = Gateway::new(settings.clone(), LinkState::Up, at(MonoTime::ZERO));
    let (mut outputs, mut now) = (Vec::new(), MonoTime::ZERO);
    let mut take = |gateway: &mut Gateway, input: Input, now: MonoTime| {
        gateway.handle(input, at(now));
        outputs.extend(std::iter::from_fn(|| gateway.poll_output()).map(|output| (now, output)));
    };
    for (pause_ns, event) in day {
        now = now.after(Duration::from_nanos(*pause_ns));
        while gateway.next_deadline() <= now {
            let due = gateway.next_deadline();
            take(&mut gateway, Input::Tick, due);
        }
        let links = |bus| [LinkState::Down, LinkState::Up].map(|state| CanInput::Link { bus, state });
        let inputs = match event {
            Event::Frame(index, content) => {
                let (bus, id, format) = *index.get(&messages);
                let length = if format == Some(FrameFormat::Fd) { 64 } else { 8 };
                let frame = Frame::with_format(id, format, &[CONTENTS[*content]; 64][..length]).unwrap();
                vec![CanInput::Frame { bus, frame, stamp: at(now).wall }]
            }
            Event::Relink(index) => links(index.get(&messages).0).into(),
        };
        for input in inputs {
            take(&mut gateway, input.into(), now);
            if ticks {
                take(&mut gateway, Input::Tick, now);
            }
        }
    }
    outputs
}

fn a_tick_after_each_frame_changes_nothing_over(days: u32) {
    let vehicles = vehicles();
    let day = proptest::collection::vec(any_event(), 1..150);
    for_all(days, (any::<Index>(), day), |(vehicle, day)| {
        let settings = vehicle.get(&vehicles);
        prop_assert_eq!(outputs(settings, &day, false), outputs(settings, &day, true));
        Ok(())
    });
}

#[test]
fn a_tick_after_each_frame_changes_nothing() {
    a_tick_after_each_frame_changes_nothing_over(300);
}

mod slow {
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_tick_after_each_frame_changes_nothing() {
        super::a_tick_after_each_frame_changes_nothing_over(3_000);
    }
}
