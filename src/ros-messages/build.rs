//! Generates Rust types, type hashes and the texts for recordings from the definitions in `ros/msg`.
//!
//! Supports the grammar of `.msg` and `.srv` files as far as the definitions use it: one field or constant
//! per line, `type name`, `type name default` or `type NAME=value`; a comment before a field becomes its
//! documentation.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

use sha2::{Digest as _, Sha256};

/// Maximum lengths of sequences whose definition has no bound; longer sequences are refused by readers:
/// message, field, elements.
const BOUNDS: [(&str, &str, u32); 13] = [
    ("autoware_internal_planning_msgs/PathPointWithLaneId", "lane_ids", 1_000),
    ("autoware_internal_planning_msgs/PathWithLaneId", "left_bound", 100_000),
    ("autoware_internal_planning_msgs/PathWithLaneId", "points", 20_000),
    ("autoware_internal_planning_msgs/PathWithLaneId", "right_bound", 100_000),
    ("autoware_internal_planning_msgs/PlanningFactor", "control_points", 1_000),
    ("autoware_internal_planning_msgs/PlanningFactorArray", "factors", 1_000),
    ("autoware_internal_planning_msgs/SafetyFactor", "points", 100_000),
    ("autoware_internal_planning_msgs/SafetyFactorArray", "factors", 10_000),
    ("autoware_internal_planning_msgs/Scenario", "activating_scenarios", 100),
    ("autoware_perception_msgs/PredictedPath", "path", 100_000),
    ("autoware_planning_msgs/LaneletRoute", "segments", 10_000),
    ("autoware_planning_msgs/LaneletSegment", "primitives", 1_000),
    ("autoware_planning_msgs/Trajectory", "points", 20_000),
];
/// serde implements its traits for arrays up to this length; a longer one becomes a square.
const MAX_ARRAY: u32 = 32;
/// Separates the definitions of two types in the text for recordings.
const SEPARATOR: &str = "================================================================================";

/// A primitive type: its name, its number in `type_description_interfaces/msg/FieldType`, and its Rust type.
const PRIMITIVES: [(&str, u32, &str); 14] = [
    ("bool", 15, "bool"),
    ("byte", 16, "u8"),
    ("char", 3, "u8"),
    ("float32", 10, "f32"),
    ("float64", 11, "f64"),
    ("int8", 2, "i8"),
    ("int16", 4, "i16"),
    ("int32", 6, "i32"),
    ("int64", 8, "i64"),
    ("string", 17, "std::string::String"),
    ("uint8", 3, "u8"),
    ("uint16", 5, "u16"),
    ("uint32", 7, "u32"),
    ("uint64", 9, "u64"),
];
/// Number of a nested type, and the offset added for an array or sequence.
const NESTED: u32 = 1;
const ARRAY: u32 = 48;
const BOUNDED_SEQUENCE: u32 = 96;
const SEQUENCE: u32 = 144;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// A definition. Its key among all [`Definitions`] is the full name, such as `std_msgs/msg/Header`.
#[derive(Debug, Default)]
struct Definition {
    /// Type, name and value as written.
    constants: Vec<(String, String, String)>,
    fields: Vec<Field>,
}

#[derive(Debug)]
struct Field {
    name: String,
    /// Name of the type as written, without array or sequence.
    base: String,
    size: Size,
    default: Option<String>,
    comments: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Size {
    One,
    Array(u32),
    Sequence,
    BoundedSequence(u32),
}

type Definitions = BTreeMap<String, Definition>;

fn main() -> Result<()> {
    let output = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(output.join("ros_messages.rs"), generate(Path::new("../../ros/msg"))?)?;
    Ok(())
}

/// Reads all definitions below `folder` and returns the generated Rust code.
fn generate(folder: &Path) -> Result<String> {
    println!("cargo::rerun-if-changed={}", folder.display());
    let (mut definitions, mut services) = (Definitions::new(), Vec::new());
    for package in sorted(folder)?.iter().filter(|path| path.is_dir()) {
        for path in sorted(&package.join("msg"))? {
            let name = format!("{}/msg/{}", file_stem(package), file_stem(&path));
            definitions.insert(name, read(&path, &fs::read_to_string(&path)?)?);
        }
        for path in sorted(&package.join("srv"))? {
            let name = format!("{}/srv/{}", file_stem(package), file_stem(&path));
            let text = fs::read_to_string(&path)?;
            let (request, response) = text.split_once("---\n").ok_or("a service without `---`")?;
            definitions.insert(format!("{name}_Request"), not_empty(read(&path, request)?));
            definitions.insert(format!("{name}_Response"), not_empty(read(&path, response)?));
            services.push(name);
        }
    }
    let mut code = String::new();
    for (package, messages) in packages(&definitions) {
        writeln!(code, "/// Messages of `{package}`.\npub mod {package} {{")?;
        for name in messages {
            code += &rust_type(&definitions, name)?;
        }
        code += "}\n";
    }
    code += "/// Texts that define each message and all messages in it, by full name.\n";
    code += "const SCHEMAS: &[(TypeName, &str)] = &[\n";
    for name in definitions.keys().filter(|name| name.contains("/msg/")) {
        writeln!(code, "({name:?}, {:?}),", schema(&definitions, name)?)?;
    }
    code += "];\n/// Hashes of all messages and services, by full name.\n";
    code += "pub const TYPE_HASHES: &[(TypeName, &str)] = &[\n";
    add_service_types(&mut definitions, &services);
    let hashed = definitions.keys().filter(|name| name.contains("/msg/") || services.contains(name));
    for name in hashed {
        writeln!(code, "({name:?}, {:?}),", hash(&definitions, name)?)?;
    }
    code += "];\n";
    Ok(code)
}

/// Returns the entries of a folder in order of their names; none if the folder does not exist.
fn sorted(folder: &Path) -> Result<Vec<PathBuf>> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let mut paths = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    paths.sort_unstable();
    Ok(paths)
}

fn file_stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Splits a full name into package and name.
fn type_name(full: &str) -> (&str, &str) {
    let package = full.split('/').next().unwrap_or_default();
    (package, full.rsplit('/').next().unwrap_or_default())
}

fn packages(definitions: &Definitions) -> BTreeMap<&str, Vec<&String>> {
    let mut packages: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for name in definitions.keys() {
        packages.entry(type_name(name).0).or_default().push(name);
    }
    packages
}

fn read(path: &Path, text: &str) -> Result<Definition> {
    let (mut definition, mut comments) = (Definition::default(), Vec::new());
    for line in text.lines() {
        if let Some(comment) = line.strip_prefix('#') {
            comments.push(comment.trim().to_owned());
        } else if let Some((base, rest)) = line.trim().split_once(' ') {
            match rest.split_once('=') {
                Some((name, value)) => {
                    let [name, value] = [name, value].map(|part| part.trim().to_owned());
                    definition.constants.push((base.to_owned(), name, value));
                }
                None => definition.fields.push(field(base, rest, std::mem::take(&mut comments))?),
            }
        } else if !line.trim().is_empty() {
            return Err(format!("{}: expected a type and a name, found {line:?}", path.display()).into());
        }
    }
    Ok(definition)
}

/// Adds to an empty request or response the field that ROS 2 gives it, since IDL has no empty structures.
fn not_empty(mut definition: Definition) -> Definition {
    if definition.fields.is_empty() {
        definition.fields.push(Field::new("uint8", Size::One, "structure_needs_at_least_one_member"));
    }
    definition
}

fn field(type_text: &str, rest: &str, comments: Vec<String>) -> Result<Field> {
    let (base, size) = type_text.split_once('[').unwrap_or((type_text, ""));
    let size = match size.strip_suffix(']') {
        None => Size::One,
        Some("") => Size::Sequence,
        Some(bound) => match bound.strip_prefix("<=") {
            Some(bound) => Size::BoundedSequence(bound.parse()?),
            None => Size::Array(bound.parse()?),
        },
    };
    let (name, default) = match rest.trim().split_once(' ') {
        Some((name, default)) => (name, Some(default.trim().to_owned())),
        None => (rest.trim(), None),
    };
    Ok(Field { default, comments, ..Field::new(base, size, name) })
}

fn primitive(base: &str) -> Option<(u32, &'static str)> {
    PRIMITIVES.iter().find(|(known, ..)| *known == base).map(|(_, number, rust)| (*number, *rust))
}

impl Field {
    fn new(base: &str, size: Size, name: &str) -> Self {
        Self { name: name.to_owned(), base: base.to_owned(), size, default: None, comments: Vec::new() }
    }

    /// Returns the full name of the nested type; `None` for a primitive.
    fn nested(&self) -> Option<String> {
        primitive(&self.base).is_none().then(|| match self.base.matches('/').count() {
            1 => self.base.replace('/', "/msg/"),
            _ => self.base.clone(),
        })
    }

    /// Returns the maximum number of elements that a reader accepts; `None` without a bound.
    fn bound(&self, message: &str) -> Option<u32> {
        let of_table = BOUNDS.iter().find(|(known, field, _)| *known == message && *field == self.name);
        match self.size {
            Size::BoundedSequence(bound) => Some(bound),
            Size::Sequence => of_table.map(|(.., bound)| *bound),
            Size::One | Size::Array(_) => None,
        }
    }

    fn rust_type(&self) -> Result<String> {
        let one = match primitive(&self.base) {
            Some((_, rust)) => rust.to_owned(),
            None => {
                let (package, name) = self.base.split_once('/').ok_or("a type without its package")?;
                format!("super::{package}::{name}")
            }
        };
        Ok(match self.size {
            Size::One => one,
            Size::Array(length) if length <= MAX_ARRAY => format!("[{one}; {length}]"),
            Size::Array(length) => {
                let side = (2..=MAX_ARRAY).find(|side| side * side == length);
                let side = side.ok_or("a long array whose length is not a square")?;
                format!("[[{one}; {side}]; {side}]")
            }
            Size::Sequence | Size::BoundedSequence(_) => format!("Vec<{one}>"),
        })
    }
}

/// Returns true if `has` holds for all primitives in a message.
fn all_primitives(definitions: &Definitions, name: &str, has: &dyn Fn(&Field) -> bool) -> bool {
    definitions.get(name).is_none_or(|definition| {
        definition.fields.iter().all(|field| {
            has(field) && field.nested().is_none_or(|nested| all_primitives(definitions, &nested, has))
        })
    })
}

/// Returns the struct of a message, with its constants.
fn rust_type(definitions: &Definitions, full: &str) -> Result<String> {
    let definition = &definitions[full];
    let (package, name) = type_name(full);
    let rust_name = name.replace('_', "");
    let is_copy = all_primitives(definitions, full, &|field| {
        field.base != "string" && matches!(field.size, Size::One | Size::Array(_))
    });
    let is_eq = all_primitives(definitions, full, &|field| !field.base.starts_with("float"));
    let has_defaults = definition.fields.iter().any(|field| field.default.is_some());
    let derives = [
        Some("Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize"),
        is_copy.then_some("Copy"),
        is_eq.then_some("Eq"),
        (!has_defaults).then_some("Default"),
    ];
    let derives = derives.into_iter().flatten().collect::<Vec<_>>().join(", ");
    let mut code = format!("/// `{full}`.\n#[derive({derives})]\npub struct {rust_name} {{\n");
    let (mut consts, mut defaults) = (String::new(), String::new());
    for field in &definition.fields {
        for comment in &field.comments {
            writeln!(code, "/// {comment}")?;
        }
        let ident = if field.name == "type" { "r#type" } else { &field.name };
        if let Some(bound) = field.bound(&format!("{package}/{name}")) {
            let max = format!("MAX_{}", field.name.to_uppercase());
            writeln!(consts, "pub const {max}: usize = {bound};")?;
            writeln!(code, "#[serde(deserialize_with = \"super::at_most::<_, _, {bound}>\")]")?;
        }
        writeln!(code, "pub {ident}: {},", field.rust_type()?)?;
        let suffix = if field.base.starts_with("float") { "_" } else { "" };
        match &field.default {
            Some(value) if suffix.is_empty() => writeln!(defaults, "{ident}: {value},")?,
            Some(value) => writeln!(defaults, "{ident}: {value}_{},", field.rust_type()?)?,
            None => writeln!(defaults, "{ident}: Default::default(),")?,
        }
    }
    code += "}\n";
    if has_defaults {
        writeln!(
            code,
            "impl Default for {rust_name} {{ fn default() -> Self {{ Self {{ {defaults} }} }} }}"
        )?;
    }
    for (base, constant, value) in &definition.constants {
        match primitive(base).ok_or("a constant that is not a primitive")?.1 {
            "std::string::String" => {
                writeln!(consts, "pub const {constant}: &str = {:?};", value.trim_matches(['"', '\'']))?;
            }
            rust => writeln!(consts, "pub const {constant}: {rust} = {value};")?,
        }
    }
    writeln!(code, "impl {rust_name} {{ pub const TYPE_NAME: super::TypeName = {full:?}; {consts} }}")?;
    Ok(code)
}

/// Returns the definition of a message, then the definitions of all messages in it, each once.
fn schema(definitions: &Definitions, name: &str) -> Result<String> {
    let (mut names, mut text, mut next) = (vec![name.to_owned()], String::new(), 0);
    while let Some(name) = names.get(next).cloned() {
        let definition = definitions.get(&name).ok_or_else(|| format!("{name} is not defined"))?;
        let constants = definition.constants.iter();
        let mut lines: Vec<_> =
            constants.map(|(base, name, value)| format!("{base} {name}={value}")).collect();
        lines.extend(definition.fields.iter().map(|field| {
            let size = match field.size {
                Size::One => String::new(),
                Size::Array(length) => format!("[{length}]"),
                Size::Sequence => "[]".to_owned(),
                Size::BoundedSequence(bound) => format!("[<={bound}]"),
            };
            format!("{}{size} {}", field.base, field.name)
        }));
        if next > 0 {
            write!(text, "\n{SEPARATOR}\nMSG: {}\n", name.replace("/msg/", "/"))?;
        }
        text += &lines.join("\n");
        for nested in definition.fields.iter().filter_map(Field::nested) {
            if !names.contains(&nested) {
                names.push(nested);
            }
        }
        next += 1;
    }
    Ok(text)
}

/// Adds the messages that ROS 2 derives from each service.
fn add_service_types(definitions: &mut Definitions, services: &[String]) {
    for name in services {
        let [request, response, event] =
            ["Request", "Response", "Event"].map(|suffix| format!("{name}_{suffix}"));
        let one = Size::BoundedSequence(1);
        let event_fields = vec![
            Field::new("service_msgs/ServiceEventInfo", Size::One, "info"),
            Field::new(&request, one, "request"),
            Field::new(&response, one, "response"),
        ];
        let service_fields = vec![
            Field::new(&request, Size::One, "request_message"),
            Field::new(&response, Size::One, "response_message"),
            Field::new(&event, Size::One, "event_message"),
        ];
        for (name, fields) in [(event, event_fields), (name.clone(), service_fields)] {
            definitions.insert(name, Definition { constants: Vec::new(), fields });
        }
    }
}

/// Returns `RIHS01_` and the SHA-256 of the JSON that REP-2016 prescribes: the fields of the type and of all
/// types in it.
fn hash(definitions: &Definitions, name: &str) -> Result<String> {
    let mut used = BTreeSet::new();
    add_used(definitions, name, &mut used)?;
    let referenced: Vec<_> = used.iter().map(|name| described(definitions, name)).collect();
    let description = format!(
        r#"{{"type_description": {}, "referenced_type_descriptions": [{}]}}"#,
        described(definitions, name),
        referenced.join(", ")
    );
    let mut text = "RIHS01_".to_owned();
    for byte in Sha256::digest(description) {
        write!(text, "{byte:02x}")?;
    }
    Ok(text)
}

fn described(definitions: &Definitions, name: &str) -> String {
    let fields = definitions[name].fields.iter().map(|field| {
        let (offset, capacity) = match field.size {
            Size::One => (0, 0),
            Size::Array(length) => (ARRAY, length),
            Size::Sequence => (SEQUENCE, 0),
            Size::BoundedSequence(bound) => (BOUNDED_SEQUENCE, bound),
        };
        let id = primitive(&field.base).map_or(NESTED, |(number, _)| number) + offset;
        format!(
            r#"{{"name": "{}", "type": {{"type_id": {id}, "capacity": {capacity}, "string_capacity": 0, "nested_type_name": "{}"}}}}"#,
            field.name,
            field.nested().unwrap_or_default()
        )
    });
    let fields: Vec<_> = fields.collect();
    format!(r#"{{"type_name": "{name}", "fields": [{}]}}"#, fields.join(", "))
}

fn add_used(definitions: &Definitions, name: &str, used: &mut BTreeSet<String>) -> Result<()> {
    let definition = definitions.get(name).ok_or_else(|| format!("{name} is not defined"))?;
    for nested in definition.fields.iter().filter_map(Field::nested) {
        if used.insert(nested.clone()) {
            add_used(definitions, &nested, used)?;
        }
    }
    Ok(())
}
