//! The platform of a bus: which lists the profiles name, invented cars that none fits, and cars that only
//! have a message in common with a profile.

use std::collections::BTreeSet;

use can_log::EntryContent;
use can_log::Log;
use can_signal::can::frame::{CanId, Frame};
use can_signal::can::link::BusIndex;
use gateway_base::time::WallStamp;
use signal_gateway::check;
use signal_gateway::check::identify::Identifier;
use signal_gateway::config::fingerprints;
use signal_gateway::replay::{Replay, Routes};
use vehicle_bringup::plausibility::evidence::ProfileEvidence;
use vehicle_bringup::plausibility::fingerprint::PlatformList;
use vehicle_bringup::plausibility::fit::FitVerdict;

use crate::pure::discovery::random::Random;
use crate::pure::vehicles::{profile, profile_names};
use crate::support::prerequisite::{require, shared_data};
use crate::support::vehicle_facts::VEHICLES;

/// A message of an invented car.
#[derive(Debug, Clone)]
struct Message {
    id: CanId,
    data: Vec<u8>,
    period_ms: u64,
    /// A byte that changes, and after how many frames.
    changes: Option<(usize, u64)>,
}

impl Message {
    fn random(random: &mut Random, id: CanId) -> Self {
        let length = random.choose(&[8, 8, 8, 8, 7, 6, 5, 4, 3, 2, 1]);
        let data: Vec<_> =
            (0..length).map(|_| random.choose(&[0, 0, 0, 1, 2, 3, 0x40, 0x80, 0xFF])).collect();
        let changes = random.percent(50).then(|| (random.below(length), random.choose(&[1, 2, 5, 20, 60])));
        let changes = changes.map(|(byte, after)| (usize::try_from(byte).unwrap(), after));
        Self { id, data, period_ms: random.choose(&[20, 40, 50, 100, 100, 200, 500, 1_000]), changes }
    }

    fn at_rest(id: CanId, length: usize, period_ms: u64) -> Self {
        Self { id, data: vec![0; length], period_ms, changes: None }
    }

    fn frame(&self, number: u64) -> Frame {
        let mut data = self.data.clone();
        if let Some((byte, after)) = self.changes {
            data[byte] = data[byte].wrapping_add(u8::try_from(number / after % 256).unwrap());
        }
        Frame::with_format(self.id, None, &data).unwrap()
    }
}

/// Length of a drive, ms.
const DRIVE_MS: u64 = 4_000;

/// Cars that drive one after the other, each on an interface of its own.
struct Drives {
    identifier: Identifier,
    start_ms: u64,
}

impl Drives {
    fn new() -> Self {
        Self { identifier: Identifier::new().unwrap(), start_ms: 0 }
    }

    fn drive(&mut self, interface: &str, messages: &[Message]) {
        for ms in 0..DRIVE_MS {
            for message in messages.iter().filter(|message| ms % message.period_ms == 0) {
                let stamp = WallStamp::from_nanos(i64::try_from(self.start_ms + ms).unwrap() * 1_000_000);
                self.identifier.frame(interface, &message.frame(ms / message.period_ms), stamp);
            }
        }
        self.start_ms += DRIVE_MS;
    }
}

/// Names of the profiles that fit on an interface.
fn fitting(identifier: &Identifier) -> BTreeSet<(String, &'static str)> {
    let candidates = identifier.candidates();
    let fitting = candidates.iter().filter(|found| found.fit.verdict == FitVerdict::Fits);
    fitting.map(|found| (found.interface.to_owned(), found.profile)).collect()
}

fn random_ids(random: &mut Random, count: u64) -> BTreeSet<CanId> {
    (0..count).map(|_| CanId::Standard(u16::try_from(random.below(0x800)).unwrap())).collect()
}

#[test]
fn no_profile_fits_an_invented_car_and_no_platform_is_named() {
    let mut drives = Drives::new();
    let mut received = 0;
    for car in 0..120 {
        let mut random = Random::new(car);
        let count = random.between(4, 90);
        let ids = random_ids(&mut random, count);
        let messages: Vec<_> = ids.into_iter().map(|id| Message::random(&mut random, id)).collect();
        drives.drive(&format!("car{car}"), &messages);
        received += messages.len();
    }
    let identifier = drives.identifier;
    assert!(received > 4_000, "{received} messages");
    assert!(identifier.candidates().len() > 20, "messages of many profiles were received by chance");
    assert_eq!(fitting(&identifier), BTreeSet::new());
    let named: Vec<_> = identifier.platforms().filter(|(_, found)| !found.is_empty()).collect();
    assert!(named.is_empty(), "{named:?}");
}

/// The messages of a profile with its periods, at rest, and the lists that it names.
fn messages_of(name: &str) -> (Vec<Message>, Vec<&'static PlatformList>) {
    let settings = profile(name);
    let databases: Vec<_> = settings.dbcs.iter().map(|dbc| &dbc.database).collect();
    let gateway = &settings.gateway;
    let evidence = ProfileEvidence::new(&gateway.lights, &gateway.v2i.table, &databases);
    let messages = evidence.messages.iter().map(|own| {
        let period = own.cycle.or(own.bound.timing.timeout().map(|timeout| timeout / 5));
        let period_ms = period.map_or(100, |period| u64::try_from(period.as_millis()).unwrap().max(1));
        Message::at_rest(own.bound.ids.described(), own.length, period_ms)
    });
    let lists = settings.dbcs.iter().flat_map(|dbc| dbc.identifier_lists.iter().copied()).collect();
    (messages.collect(), lists)
}

#[test]
fn messages_of_a_profile_fit_on_the_bus_of_its_platform_alone() {
    let (mut on_own, mut on_others) = (Drives::new(), Drives::new());
    for name in profile_names() {
        let (own, lists) = messages_of(&name);
        let Some(list) = lists.first() else { continue };
        let mut random = Random::new(7);
        let is_other = |id: &CanId| own.iter().all(|own| own.id != *id);
        let foreign = random_ids(&mut random, 60).into_iter().filter(is_other);
        let foreign: Vec<_> = foreign.map(|id| Message::random(&mut random, id)).collect();
        on_others.drive(&name, &[own.clone(), foreign].concat());
        let of_platform = list.messages.iter().filter(|(id, _)| is_other(id));
        let of_platform: Vec<_> =
            of_platform.map(|(id, length)| Message::at_rest(*id, *length, 100)).collect();
        on_own.drive(&name, &[own, of_platform].concat());
    }
    assert_eq!(fitting(&on_others.identifier), BTreeSet::new(), "a bus of another platform");
    let fits: BTreeSet<_> = fitting(&on_own.identifier).into_iter().map(|(_, profile)| profile).collect();
    for name in ["chrysler_pacifica_2017", "ford_lincoln", "hyundai_kia", "subaru_outback_2015", "vw_pq"] {
        assert!(fits.contains(name), "{name} does not fit its own platform: {fits:?}");
    }
}

/// Without the other identifiers the same frames fit.
#[test]
fn an_indicator_that_looks_right_does_not_fit_on_another_platform() {
    let (mut own, _) = messages_of("chrysler_pacifica_2017");
    let [lever] = own.as_mut_slice() else { panic!("{own:?}") };
    // Off, left and right for 1.2 s each, in the first bits.
    lever.changes = Some((0, 1_200 / lever.period_ms));
    let mut random = Random::new(3);
    let foreign = random_ids(&mut random, 60).into_iter().filter(|id| *id != lever.id);
    let foreign: Vec<_> = foreign.map(|id| Message::random(&mut random, id)).collect();
    for (others, expected) in [(Vec::new(), true), (foreign, false)] {
        let mut drives = Drives::new();
        drives.drive("can0", &[own.clone(), others].concat());
        let fits = fitting(&drives.identifier);
        assert_eq!(fits.contains(&("can0".to_owned(), "chrysler_pacifica_2017")), expected, "{fits:?}");
    }
}

#[test]
fn a_profile_names_the_list_of_each_dbc_that_it_stands_for() {
    let known: BTreeSet<_> = fingerprints::lists().unwrap().iter().map(|list| list.name.as_str()).collect();
    let mut named = 0;
    for (name, vehicle) in &*VEHICLES {
        let lists = messages_of(name).1;
        let lists: BTreeSet<_> = lists.iter().map(|list| list.name.as_str()).collect();
        let cars = vehicle.opendbc.iter().flat_map(|counterpart| &counterpart.cars);
        let dbcs = cars.filter_map(|car| car.split(' ').next());
        for dbc in dbcs.filter(|dbc| known.contains(dbc)) {
            assert!(lists.contains(dbc), "{name}: identifier_lists lacks {dbc}");
        }
        named += lists.len();
    }
    assert!(named > 50, "{named} lists");
}

#[test]
fn a_mitsubishi_is_not_a_chrysler() {
    let path = require!(shared_data()).join("can-logs/eld-evox-5000rev-asc.trc.gz");
    let (mut log, mut identifier) = (Log::open(&path).unwrap(), Identifier::new().unwrap());
    while let Some(record) = log.next_record().unwrap() {
        if let EntryContent::Data(frame) = record.content {
            identifier.frame(&log.interfaces()[record.interface.0], &frame, record.stamp);
        }
    }
    assert_eq!(fitting(&identifier), BTreeSet::new());
    let interface = log.interfaces()[0].clone();
    for (name, expected) in [
        (
            "chrysler_pacifica_2017",
            "warning    the bus is that of another platform: 2 of 39 identifiers (5 %) are in the list of ",
        ),
        ("bmw_e9x", "none of the profile's messages was received"),
    ] {
        let settings = profile(name);
        let routes = Routes(vec![(interface.clone(), BusIndex(0))]);
        let replay = Replay::surveying(settings.gateway.clone(), Log::open(&path).unwrap(), routes).unwrap();
        let (report, outcome) = check::recording(settings, replay);
        outcome.unwrap();
        let text = report.text(check::Layout::default());
        assert!(text.contains(expected), "{name}\n{text}");
    }
}
