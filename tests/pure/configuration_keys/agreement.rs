//! The schemas that are kept by hand against the readers: each table of each shipped file gets a key that
//! does not exist, and each of its values is replaced by one that cannot be right. The readers then name the
//! keys, the ranges and the keywords that they accept. `schemas` and `tests/editor` ask validators that are
//! not ours.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde_json::Value;
use signal_gateway::config::{Overrides, Problem, Refused, drive, load, load_profile, scenario};
use traffic_lights::compat::Compat;

use super::project;
use super::schemas::{files, shipped};
use crate::support::files::MemoryFiles;

const WRONG_KEY: &str = "zz_zz";

/// Reads a file of a kind; `None` when it is accepted.
fn problems(kind: &str, path: &Path, file: &Value) -> Vec<Problem> {
    let text = toml::to_string(file).unwrap();
    let name = path.to_str().unwrap();
    let files = MemoryFiles::new([(name, text)]).or_disk();
    let refused = match kind {
        "profile" => load_profile(&files, path).err(),
        "drive" => drive::read(&files, path).err(),
        "gateway" => load(&files, path, &Overrides::default()).err(),
        _ => scenario::read(&files, path, Compat::Improved).err(),
    };
    refused.map_or_else(Vec::new, |Refused(problems)| problems)
}

/// The keys of each table of a schema that a reader has named, by the table's path in the schema.
type NamedKeys = BTreeMap<String, (BTreeSet<String>, BTreeSet<String>)>;

struct Comparison {
    kind: &'static str,
    schema: Value,
    named: NamedKeys,
    seen: BTreeSet<String>,
    differences: BTreeSet<String>,
}

impl Comparison {
    fn of(kind: &'static str) -> Self {
        let (named, seen, differences) = Default::default();
        Self { kind, schema: shipped(kind), named, seen, differences }
    }

    /// The schema that a node stands for, with its path: references are followed, and of several the one of
    /// the value's type counts.
    fn resolved(&self, node: &Value, at: String, value: &Value) -> (Value, String) {
        if let Some(reference) = node["$ref"].as_str() {
            let target = self.schema.pointer(reference.trim_start_matches('#')).unwrap().clone();
            return self.resolved(&target, reference.to_owned(), value);
        }
        let Some(options) = node["anyOf"].as_array() else { return (node.clone(), at) };
        let options = options
            .iter()
            .enumerate()
            .map(|(index, option)| self.resolved(option, format!("{at}/{index}"), value));
        let fits = |option: &(Value, String)| {
            let is = |name: &str| option.0["type"] == name;
            let has = |key: &Value| value.get(key.as_str().unwrap()).is_some();
            let has_required = option.0["required"].as_array().is_none_or(|keys| keys.iter().all(has));
            value.is_object() && is("object") && has_required || value.is_array() && is("array")
        };
        let mut options: Vec<_> = options.collect();
        let at = options.iter().position(fits).unwrap_or(0);
        options.swap_remove(at)
    }

    fn walk(&mut self, path: &Path, file: &Value, (node, at): (&Value, String), pointer: &str) {
        let value = file.pointer(pointer).unwrap();
        let (node, at) = self.resolved(node, at, value);
        match value {
            Value::Object(entries) => {
                if node["properties"].is_object() {
                    self.table(path, file, (&node, &at), pointer);
                }
                for key in entries.keys() {
                    let below = &node["properties"][key];
                    let (below, step) = if below.is_null() {
                        (&node["additionalProperties"], "*")
                    } else {
                        (below, key.as_str())
                    };
                    if *below == false {
                        self.differences
                            .insert(format!("{}: {at}/{key} is not in the schema", path.display()));
                        continue;
                    }
                    self.value(path, file, (below, &format!("{at}/{step}")), (pointer, key));
                    let pointer = format!("{pointer}/{}", key.replace('/', "~1"));
                    self.walk(path, file, (below, format!("{at}/{step}")), &pointer);
                }
            }
            Value::Array(items) => {
                for index in 0..items.len() {
                    self.walk(
                        path,
                        file,
                        (&node["items"], format!("{at}/[]")),
                        &format!("{pointer}/{index}"),
                    );
                }
            }
            Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
        }
    }

    /// Compares the keys of a table.
    fn table(&mut self, path: &Path, file: &Value, (node, at): (&Value, &str), pointer: &str) {
        let keys: BTreeSet<_> = file.pointer(pointer).unwrap().as_object().unwrap().keys().cloned().collect();
        let forms: Vec<_> = ["kind", "from", "profile", "sent"]
            .iter()
            .map(|key| &file.pointer(pointer).unwrap()[*key])
            .collect();
        if !self.seen.insert(format!("{at} {keys:?} {forms:?}")) {
            return;
        }
        let mut wrong = file.clone();
        wrong.pointer_mut(pointer).unwrap()[WRONG_KEY] = 1.into();
        let problems = problems(self.kind, path, &wrong);
        let refused =
            problems.iter().find(|problem| problem.reason.contains(&format!("unknown key {WRONG_KEY:?}")));
        let Some(refused) = refused else { return };
        let properties = node["properties"].as_object().unwrap().keys().cloned().collect();
        let valid = refused.remedy.strip_prefix("valid keys: ").unwrap_or_default();
        let (_, named) = self.named.entry(at.to_owned()).or_insert((properties, BTreeSet::new()));
        named.extend(valid.split(", ").filter(|key| !key.is_empty()).map(str::to_owned));
    }

    /// Compares the range or the keywords of a value.
    fn value(&mut self, path: &Path, file: &Value, (node, at): (&Value, &str), (pointer, key): (&str, &str)) {
        let (wrong_value, expected) = match (&node["enum"], &node["minimum"], &node["maximum"]) {
            (Value::Array(words), ..) => {
                let words: Vec<_> = words.iter().map(|word| word.as_str().unwrap()).collect();
                (Value::from(WRONG_KEY), format!("give one of {}", words.join(", ")))
            }
            (_, min, max) if !min.is_null() && !max.is_null() => {
                let number = |value: &Value| value.as_f64().unwrap();
                (wrong_number(&node["type"], max), format!("give {} to {}", number(min), number(max)))
            }
            _ => return,
        };
        // Drives have the decider's parameters by the same rows as the gateway.
        if at.starts_with("#/parameters/") || !self.seen.insert(format!("{at} value")) {
            return;
        }
        let mut wrong = file.clone();
        wrong.pointer_mut(pointer).unwrap()[key] = wrong_value;
        let remedies: Vec<_> =
            problems(self.kind, path, &wrong).into_iter().map(|problem| problem.remedy).collect();
        let fits = |remedy: &String| *remedy == expected || remedy.starts_with(&format!("{expected} "));
        // Which range it is depends on other keys.
        let varies =
            ["crossing_m", "mps", "burst_gap_ms", "min_send_interval_ms", "press_ms", "wait_ms", "start"]
                .contains(&key);
        if !varies && !remedies.iter().any(fits) {
            self.differences.insert(format!("{at}: the schema has {expected:?}, the reader {remedies:?}"));
        }
    }

    fn finish(mut self) {
        for (at, (properties, named)) in self.named {
            if properties != named {
                let only = |one: &BTreeSet<String>, other| {
                    one.difference(other).cloned().collect::<Vec<_>>().join(", ")
                };
                let (schema, reader) = (only(&properties, &named), only(&named, &properties));
                self.differences
                    .insert(format!("{at}: only the schema has [{schema}], only the reader has [{reader}]"));
            }
        }
        let differences: Vec<_> = self.differences.into_iter().collect();
        assert!(differences.is_empty(), "{}:\n{}", self.kind, differences.join("\n"));
    }
}

/// A number above a maximum, of the type that the schema wants.
fn wrong_number(kind: &Value, max: &Value) -> Value {
    match max.as_i64() {
        Some(max) if kind == "integer" => (max + 1).into(),
        Some(_) | None => (max.as_f64().unwrap() + 1.0).into(),
    }
}

/// Compares a schema with the reader on the files of a folder, and on `more`.
fn compare(kind: &'static str, folder: &str, more: &[&str]) {
    let mut comparison = Comparison::of(kind);
    let schema = comparison.schema.clone();
    for (path, file) in files(folder) {
        comparison.walk(&path, &file, (&schema, "#".to_owned()), "");
    }
    for text in more {
        let table: toml::Table = text.parse().unwrap();
        let file = serde_json::to_value(table).unwrap();
        let path = project(folder).join("of_the_test.toml");
        comparison.walk(&path, &file, (&schema, "#".to_owned()), "");
    }
    comparison.finish();
}

/// Forms that no shipped profile has.
const PROFILES: &[&str] = &[
    "name = \"x\"\nbus.body.dbc = \"../../dbc/demo_vehicle.dbc\"\n\
     turn = { kind = \"stalk\", signal = \"EPS_Steering.Counter\", idle = [0], left_full = [1], right_full = [2], stalk = {} }\n\
     hazard = { from = \"button\", signal = \"EPS_Steering.Counter\", on = [1], off = [0] }\n\
     [message.EPS_Steering]\nchecksum = { kind = \"crc8\", signal = \"Checksum\", poly = 1, init = 0, xorout = 0, bytes = [0] }\n\
     [[command.message]]\nname = \"EPS_Steering\"\nchecksum = { kind = \"crc8\", signal = \"Checksum\", poly = 1, init = 0, xorout = 0, bytes = [0] }\n",
    "name = \"x\"\nbus.body.dbc = \"../../dbc/demo_vehicle.dbc\"\n\
     [[turn.source]]\nname = \"a\"\nsignal = \"EPS_Steering.Counter\"\noff = [0]\nleft = [1]\nright = [2]\n\
     [[turn.source]]\nname = \"b\"\nkind = \"stalk\"\nsignal = \"EPS_Steering.Counter\"\nidle = [0]\nleft_full = [1]\nright_full = [2]\n\
     [[hazard.source]]\nname = \"a\"\nfrom = \"button\"\nsignal = \"EPS_Steering.Counter\"\non = [1]\noff = [0]\n\
     [message.EPS_Steering]\nchecksum = { kind = \"vw\", signal = \"Checksum\", constants = [0] }\n\
     [[command.message]]\nname = \"EPS_Steering\"\nchecksum = { kind = \"vw\", signal = \"Checksum\", constants = [0] }\n",
    "name = \"x\"\nbus.body.dbc = \"../../dbc/demo_vehicle.dbc\"\nturn.signal = \"EPS_Steering.Counter\"\n\
     [[hazard.source]]\nname = \"a\"\nfrom = \"reason\"\nsignal = \"EPS_Steering.Counter\"\noff = [0]\nreasons = { crash = [5] }\n\
     [message.EPS_Steering]\nchecksum = { kind = \"sum8\", signal = \"Checksum\", start = 0, bytes = [0], identifier = true }\n\
     [[command.message]]\nname = \"EPS_Steering\"\nchecksum = { kind = \"sum8\", signal = \"Checksum\", start = 0, bytes = [0], identifier = true }\n",
    "name = \"x\"\nbus.body.dbc = \"../../dbc/demo_vehicle.dbc\"\n\
     [[requires]]\nsignal = \"EPS_Steering.Counter\"\nvalues = [1]\nnot_available = [15]\notherwise = \"a van\"\n",
    "name = \"x\"\nbus.body.dbc = \"../../dbc/demo_vehicle.dbc\"\n\
     control_mode = { signal = \"EPS_Steering.Counter\", autonomous = [1], manual = [0] }\n",
];

const DRIVES: &[&str] =
    &["map = \"../maps/crossing/lanelet2_map.osm\"\nroute.segments = [[101], [111], [402]]\n\
     [drive]\nspeed = [{ at_m = 0, mps = 10 }]\npoints = [[0.0, 1.5], [50.0, 1.5]]\n\
     [[disturbance]]\nkind = \"time_jump\"\nat_s = 1\nby_s = 1\n"];

const SCENARIOS: &[&str] = &["init = [{ ground_truth_rate_hz = 10 }, { v2i_rate_hz = 10 }]\n\
     [[event]]\nwhen = { before_s = 5 }\ndo = [{ clear = \"21\" }]\n"];

#[test]
fn the_gateways_schema_has_every_key_of_the_documented_files() {
    let mut comparison = Comparison::of("gateway");
    let schema = comparison.schema.clone();
    for (path, file) in files("config").into_iter().chain(files("packaging/debian")) {
        comparison.walk(&path, &file, (&schema, "#".to_owned()), "");
    }
    comparison.finish();
}

#[test]
fn profiles() {
    compare("profile", "config/vehicles", PROFILES);
}

#[test]
fn drives() {
    compare("drive", "config/drives", DRIVES);
}

#[test]
fn scenarios() {
    compare("scenario", "config/scenarios", SCENARIOS);
}
