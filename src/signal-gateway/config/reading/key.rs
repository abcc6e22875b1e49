//! Properties of a key of a file, for all uses except reading: documents, schemas, differences, parameters.

use std::fmt;

/// The step that puts a changed key into effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyEffect {
    /// A reload, while the gateway runs.
    Reload,
    /// A restart; a reload refuses the change.
    Restart,
}

/// The values that a key accepts, for documents, editors and ROS 2 tools.
#[derive(Debug, Clone)]
pub enum ValueShape {
    /// Whole numbers of a range, with the unit.
    Whole(i64, i64, &'static str),
    /// Numbers of a range, with the unit.
    Number(f64, f64, &'static str),
    /// `true` or `false`.
    Flag,
    /// One of several texts.
    Keyword(Vec<&'static str>),
    /// Any text.
    Text,
    /// A path, relative to the file.
    Path,
    /// A list of texts.
    Texts,
    /// A table whose keys are names, with values of any kind.
    Names,
    /// A list of tables with these keys.
    Tables(Vec<&'static dyn KeyRow>),
}

/// A row of any type, for everything except reading.
pub trait KeyRow: Sync {
    /// Returns the name of the key within its section.
    fn name(&self) -> &'static str;
    /// Returns the values that the key accepts.
    fn shape(&self) -> ValueShape;
    /// Returns the default value in TOML; `None` without a default.
    fn default_toml(&self) -> Option<String>;
    /// Returns an example value in TOML for a key without a default; empty if there is none.
    fn example(&self) -> &'static str {
        ""
    }
    /// Returns the meaning of the key; `{range}` stands for the range with its unit.
    fn doc(&self) -> &'static str;
    /// Returns the step that puts a changed value into effect.
    fn effect(&self) -> KeyEffect {
        KeyEffect::Reload
    }
}

/// Returns the meaning of a key with the range of its values.
pub fn description(row: &dyn KeyRow) -> String {
    let range = match row.shape() {
        ValueShape::Whole(min, max, unit) if min > i64::MIN && max < i64::MAX => {
            format!("{min} to {max} {unit}")
        }
        ValueShape::Number(min, max, unit) if max < f64::MAX => format!("{min} to {max} {unit}"),
        ValueShape::Keyword(words) => {
            let words: Vec<_> = words.iter().map(|word| format!("{word:?}")).collect();
            match words.split_last() {
                Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
                _ => words.concat(),
            }
        }
        ValueShape::Flag => "true or false".to_owned(),
        ValueShape::Whole(..)
        | ValueShape::Number(..)
        | ValueShape::Text
        | ValueShape::Path
        | ValueShape::Texts
        | ValueShape::Names
        | ValueShape::Tables(_) => String::new(),
    };
    let (doc, range) = (row.doc(), range.trim_end());
    let is_number = matches!(row.shape(), ValueShape::Whole(..) | ValueShape::Number(..));
    if doc.contains("{range}") {
        doc.replace("{range}", range)
    } else if is_number && !range.is_empty() {
        format!("{doc}, {range}")
    } else {
        doc.to_owned()
    }
}

impl fmt::Debug for dyn KeyRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
