//! `[traffic_lights.faults.<channel>]`: injected faults; each is off by default.

use std::time::Duration;

use crate::config::reading::{
    ConfigKey, Fields, KeyRow, ValueShape, any_count, any_whole, collection, key_rows, millis, number, other,
};
use traffic_lights::bulb::Color;
use traffic_lights::faults::{ChannelFaults, Confusion, FaultSettings, Spells};

key_rows! {
    SEED: u64 = any_count("seed").or(0).doc("the same seed, the same faults");
    LATENCY_MS: Duration = millis("latency_ms", 0, MAX_LATENCY_MS).or(0).doc("mean latency");
    JITTER_MS: Duration = millis("jitter_ms", 0, MAX_LATENCY_MS).or(0).doc("the latency varies by plus or minus this, at most by all of it");
    LOSS: f64 = share("loss").doc("probability that a message is lost");
    FREEZE: f64 = share("freeze").doc("probability that the sender repeats its last message");
    FREEZE_MESSAGES: f64 = length("freeze_messages").doc("mean length of a freeze, in messages");
    STAMP_OFFSET_MS: i64 = any_whole("stamp_offset_ms").or(0).doc("added to the stamp");
    MISS: f64 = share("miss").doc("probability that a group is missing");
    MISS_MESSAGES: f64 = length("miss_messages").doc("mean length of a gap, in messages");
    UNKNOWN: f64 = share("unknown").doc("probability that a group is unknown in a message");
    CONFUSION: Vec<Confusion> = collection("confusion", || ValueShape::Tables(confusion_keys()), confusions)
        .example("[{ from = \"green\", to = \"red\", probability = 0.0 }]").doc("colours taken for others");
    CONFIDENCE: f64 = number("confidence", 0.0, 1.0, "").example("0.9").doc("mean, {range}; default: the scenario's");
    CONFIDENCE_SPREAD: f64 = number("confidence_spread", 0.0, f64::MAX, "").or_number(0.0).doc("standard deviation");
}

const MAX_LATENCY_MS: i64 = 60_000;

static FROM: ConfigKey<Color> = color("from").doc("the colour that is shown");
static TO: ConfigKey<Color> = color("to").doc("the colour that it is taken for");
static PROBABILITY: ConfigKey<f64> =
    number("probability", 0.0, 1.0, "").doc("probability that it is taken for the other");

fn confusion_keys() -> Vec<&'static dyn KeyRow> {
    vec![&FROM, &TO, &PROBABILITY]
}

const fn share(name: &'static str) -> ConfigKey<f64> {
    number(name, 0.0, 1.0, "").or_number(0.0)
}

const fn length(name: &'static str) -> ConfigKey<f64> {
    number(name, 1.0, f64::MAX, "messages").or_number(1.0)
}

const fn color(name: &'static str) -> ConfigKey<Color> {
    let read = |fields: &Fields<'_>, name| {
        let given = fields.string(name)?;
        fields.checker.accept(&given.location, given.text.parse::<Color>(), "")
    };
    other(name, || ValueShape::Text, read, |_| None)
}

pub(super) fn faults(fields: &Fields<'_>) -> Option<ChannelFaults> {
    let spells = |probability, length| Spells {
        probability: fields.read(probability),
        mean_length: fields.read(length),
    };
    let settings = FaultSettings {
        seed: fields.read(&SEED),
        latency: fields.read(&LATENCY_MS),
        jitter: fields.read(&JITTER_MS),
        loss: fields.read(&LOSS),
        freeze: spells(&FREEZE, &FREEZE_MESSAGES),
        stamp_offset_ns: fields.read(&STAMP_OFFSET_MS).saturating_mul(1_000_000),
        miss: spells(&MISS, &MISS_MESSAGES),
        unknown: fields.read(&UNKNOWN),
        confusions: fields.read(&CONFUSION),
        confidence_mean: fields.given(&CONFIDENCE),
        confidence_spread: fields.read(&CONFIDENCE_SPREAD),
    };
    fields.checker.accept(fields.location(), ChannelFaults::new(settings), "")
}

fn confusions(fields: &Fields<'_>, key: &'static str) -> Vec<Confusion> {
    fields.read_tables(key, |fields| {
        fields.require(&[FROM.name, TO.name, PROBABILITY.name], "");
        let (from, to, probability) = (fields.given(&FROM), fields.given(&TO), fields.given(&PROBABILITY));
        Some(Confusion { from: from?, to: to?, probability: probability? })
    })
}
