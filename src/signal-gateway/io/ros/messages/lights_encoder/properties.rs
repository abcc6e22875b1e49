//! Property tests: after any sequence of changes, patched bytes equal freshly encoded ones, and held bytes
//! stay unchanged.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use super::*;
use crate::io::ros::messages::LightsMessage;
use lanelet2_map::light_map::{LampColor, MapLamp};
use traffic_lights::bulb::{Bulb, BulbSet, BulbShape, BulbStatus, Color};
use traffic_lights::emission::{GroupElement, GroupState, LampMarker, LightState, LightsTopic, Prediction};

const IDS: Range<i64> = 0..12;

#[derive(Debug, Clone)]
enum ListStep {
    /// Only the stamp changes.
    Nothing,
    /// Lights change or appear.
    Set(Vec<LightLook>),
    /// Lights disappear from the list.
    Remove(Vec<i64>),
    /// The list is replaced by an equal list at another address, as happens to unaffected groups after
    /// faults.
    Copy,
}

/// A light with the properties that any kind of message may show.
#[derive(Debug, Clone)]
struct LightLook {
    id: i64,
    bulbs: Vec<Bulb>,
    quarters: u8,
    /// Number of bulbs and source of each prediction.
    predictions: Vec<(usize, &'static str)>,
}

fn bulb() -> impl Strategy<Value = Bulb> {
    (select(&Color::ALL[..]), select(&BulbStatus::ALL[..]), select(&BulbShape::ALL[..]))
        .prop_map(|(color, status, shape)| Bulb { color, status, shape })
}

fn look() -> impl Strategy<Value = LightLook> {
    let predictions = vec((0..3_usize, select(vec!["", "V2I", "SIMULATION"])), 0..4);
    (IDS, vec(bulb(), 0..4), 0..=4_u8, predictions).prop_map(|(id, bulbs, quarters, predictions)| LightLook {
        id,
        bulbs,
        quarters,
        predictions,
    })
}

fn step() -> impl Strategy<Value = ListStep> {
    prop_oneof![
        3 => Just(ListStep::Nothing),
        4 => vec(look(), 1..4).prop_map(ListStep::Set),
        1 => vec(IDS, 1..3).prop_map(ListStep::Remove),
        1 => Just(ListStep::Copy),
    ]
}

/// Returns an id. Some do not fit 32 bits, so the markers of some lights have longer names.
fn id(of: i64) -> i64 {
    if of % 3 == 0 { of + (1 << 40) } else { of }
}

impl LightLook {
    fn light(&self) -> LightState {
        LightState { way_id: id(self.id), bulbs: self.bulb_set(), confidence: self.confidence() }
    }

    fn group(&self) -> Arc<GroupState> {
        let confidence = self.confidence();
        let elements: Vec<_> = self.bulb_set().iter().map(|bulb| GroupElement { bulb, confidence }).collect();
        let predictions = (0..).zip(&self.predictions).map(|(number, (bulbs, source))| Prediction {
            at: WallStamp::from_nanos(number * 1_500_000_000),
            elements: elements.iter().take(*bulbs).copied().collect(),
            reliability: confidence,
            source: (*source).into(),
        });
        let predictions = predictions.collect();
        Arc::new(GroupState { relation_id: id(self.id), elements, predictions })
    }

    fn markers(&self) -> Vec<LampMarker> {
        let lamp = |(index, color)| LampMarker {
            way_id: id(self.id),
            lamp: MapLamp { color, position_m: [1.0, -2.0, 0.5] },
            is_on: self.bulbs.len() > index,
        };
        LampColor::ALL.into_iter().enumerate().map(lamp).collect()
    }

    fn bulb_set(&self) -> BulbSet {
        self.bulbs.iter().copied().collect()
    }

    fn confidence(&self) -> f64 {
        f64::from(self.quarters) / 4.0
    }
}

/// Changes a list as the core does: in place unless it is shared, and only if there is a difference.
fn take<T: Clone>(
    list: &mut Arc<Vec<T>>,
    step: &ListStep,
    make: impl Fn(&LightLook) -> Vec<T>,
    id_of: impl Fn(&T) -> i64,
) {
    match step {
        ListStep::Nothing => {}
        ListStep::Set(looks) => {
            for look in looks {
                let (list, made) = (Arc::make_mut(list), make(look));
                let first = list.partition_point(|item| id_of(item) < id(look.id));
                let end = list.partition_point(|item| id_of(item) <= id(look.id));
                list.splice(first..end, made);
            }
        }
        ListStep::Remove(ids) => {
            Arc::make_mut(list).retain(|item| !ids.iter().any(|of| id(*of) == id_of(item)));
        }
        ListStep::Copy => *list = Arc::new((**list).clone()),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn patched_bytes_are_freshly_encoded_ones(
        steps in vec((step(), any::<i64>(), 0..4_usize), 1..24),
        compat in select(vec![Compat::Improved, Compat::Upstream]),
    ) {
        let (mut lights, mut groups, mut markers) = Default::default();
        let types =
            [LightsType::ArrayV1, LightsType::SignalArray, LightsType::GroupArray, LightsType::MarkerArray];
        let mut encoders = types.map(|lights| (lights, LightsEncoder::new(lights, compat)));
        // As writers do: some keep the last messages, some none.
        let mut held: Vec<(CdrBytes, Vec<u8>)> = Vec::new();
        for (step, nanos, keep) in steps {
            take(&mut lights, &step, |look| vec![look.light()], |light| light.way_id);
            take(&mut groups, &step, |look| vec![look.group()], |group| group.relation_id);
            take(&mut markers, &step, LightLook::markers, |marker| marker.way_id);
            for (lights_type, encoder) in &mut encoders {
                let content = match lights_type {
                    LightsType::ArrayV1 => LightsContent::Lights(Arc::clone(&lights)),
                    LightsType::SignalArray | LightsType::GroupArray => LightsContent::Groups(Arc::clone(&groups)),
                    LightsType::MarkerArray => LightsContent::Markers(Arc::clone(&markers)),
                    LightsType::Clock => LightsContent::Clock,
                };
                let stamp = WallStamp::from_nanos(nanos);
                let emission = Emission { topic: LightsTopic::V2i, stamp, content };
                let encoded = encoder.encode(&emission).unwrap();
                let fresh = LightsMessage::of(&emission, *lights_type, compat);
                let fresh: Vec<_> = fresh.iter().map(|message| CdrBytes::encode(message).unwrap()).collect();
                prop_assert_eq!(&encoded, &fresh, "{:?}", lights_type);
                held.extend(encoded.into_iter().map(|bytes| (bytes.clone(), bytes.as_ref().to_vec())));
            }
            for (shared, then) in &held {
                prop_assert_eq!(shared.as_ref(), &then[..], "what was sent stays as it was sent");
            }
            held.drain(..held.len().saturating_sub(keep * 4));
        }
    }
}

/// Returns the address of a message's bytes, after the message was dropped.
fn address(encoder: &mut LightsEncoder, content: &LightsContent, nanos: i64) -> *const u8 {
    let stamp = WallStamp::from_nanos(nanos);
    let emission = Emission { topic: LightsTopic::V2i, stamp, content: content.clone() };
    encoder.encode(&emission).unwrap()[0].as_ref().as_ptr()
}

#[test]
fn bytes_that_are_not_held_are_patched_in_place() {
    let look = LightLook { id: 1, bulbs: vec![], quarters: 2, predictions: vec![] };
    let content = LightsContent::groups([(*look.group()).clone()]);
    let mut encoder = LightsEncoder::new(LightsType::GroupArray, Compat::Improved);
    let first = address(&mut encoder, &content, 1);
    assert_eq!(address(&mut encoder, &content, 2), first);
    let emission =
        Emission { topic: LightsTopic::V2i, stamp: WallStamp::from_nanos(3), content: content.clone() };
    let held = encoder.encode(&emission).unwrap();
    assert_ne!(address(&mut encoder, &content, 4), first, "a writer holds these");
    drop(held);
    assert_ne!(address(&mut encoder, &content, 5), first, "the newest free ones are taken");
}

#[test]
fn a_message_without_stamp_is_shared_while_nothing_changes() {
    let content = LightsContent::lights([]);
    let mut encoder = LightsEncoder::new(LightsType::ArrayV1, Compat::Improved);
    let mut encode = |nanos| {
        let stamp = WallStamp::from_nanos(nanos);
        encoder
            .encode(&Emission { topic: LightsTopic::GroundTruth, stamp, content: content.clone() })
            .unwrap()
    };
    let held = encode(1);
    assert!(std::ptr::eq(held[0].as_ref(), encode(2)[0].as_ref()));
}
