//! The one layer between text files and settings: TOML, YAML and XML as values that keep their places,
//! checks that note every problem, and the words for a problem.
//!
//! | file | what it is |
//! |---|---|
//! | `problem` | why a configuration is refused: file, line, column, key, reason, remedy |
//! | `document` | a TOML text that becomes Rust types, and the places of its keys |
//! | `checker` | notes the problems of one document: ranges, limits, topics |
//! | `keyword` | values that TOML has words for |
//! | `location` | where something stands in a scenario or drive file |
//! | `value` | keys, lists and scalars, whatever they were written in; `toml_text` and `yaml_text` make them |
//! | `fields` | the keys of one table, taken one by one |
//! | `element` | elements of OpenSCENARIO; `xml_text` makes them |

pub(super) mod checker;
pub(super) mod document;
pub(super) mod element;
pub(super) mod fields;
pub(super) mod keyword;
pub(super) mod location;
pub(super) mod problem;
pub(super) mod toml_text;
pub(super) mod value;
pub(super) mod xml_text;
pub(super) mod yaml_text;
