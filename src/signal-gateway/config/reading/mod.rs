//! The common layer between text files and settings: TOML, YAML and XML become values with locations, and
//! reading them records every problem of a file instead of stopping at the first one.
//!
//! | file | contents |
//! |---|---|
//! | `problem` | a reason to refuse a configuration: file, line, column, key, reason, remedy |
//! | `location` | the text of a file, and locations in it |
//! | `value` | keys, lists and scalars of any notation; `toml_text` and `yaml_text` make them |
//! | `checker` | collects the problems of one file; reads single values |
//! | `fields` | reads a table key by key, and refuses the keys that were not read |
//! | `key`, `row` | what is known of a key, once: its row; `row` reads a key through it |
//! | `element` | elements of OpenSCENARIO; `xml_text` makes them |

pub(super) mod checker;
pub(super) mod element;
pub(super) mod fields;
pub(super) mod key;
pub(super) mod location;
pub(super) mod problem;
pub(super) mod row;
pub(super) mod toml_text;
pub(super) mod value;
pub(super) mod xml_text;
pub(super) mod yaml_text;

pub(in crate::config) use checker::{Checker, Keywords, LocatedText, RecordedKey};
pub(in crate::config) use element::{Attribute, Element};
pub(in crate::config) use fields::{Fields, MAX_LIMIT_MS};
pub(in crate::config) use key::{KeyEffect, KeyRow, ValueShape, description};
pub(in crate::config) use location::{KeyPath, Location, MAX_BYTES, SourceLocation, Text, line};
pub(in crate::config) use problem::{
    MissingTimeout, Position, Problem, Refusal, Refused, cannot_read, joined, remedy_of,
};
pub(in crate::config) use row::{
    ConfigKey, WrittenKey, any_count, any_whole, collection, flag, flattened, key_rows, keyword, limit,
    millis, number, number_as, optional_topic, other, path, read_topic, seconds, text, topic, whole,
};
pub(in crate::config) use toml_text::from_toml;
pub(in crate::config) use value::{Entry, Kind, Value, items};
pub(in crate::config) use xml_text::from_xml;
pub(in crate::config) use yaml_text::from_yaml;
