//! From XML text to primitives, in one pass and without a tree.

use std::borrow::Cow;
use std::str;

use quick_xml::XmlVersion;
use quick_xml::events::attributes::Attribute;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use super::{Element, ElementRef, Kind, Layer, Member, Node, Osm, OsmError, Relation, Tags, Way};

/// Tags of nodes that are kept as text; most nodes have none.
const NODE_TAGS: [&str; 2] = ["color", "arrow"];

/// Reads a whole file. Memory is bounded by the size of the text.
///
/// # Errors
/// The first thing wrong, with its line; references are looked at last.
pub fn read(bytes: &[u8]) -> Result<Osm, OsmError> {
    let text = str::from_utf8(bytes)
        .map_err(|error| OsmError::NotUtf8 { line: line_of(bytes, error.valid_up_to()) })?;
    let mut reading =
        Reading { text, begin: 0, depth: 0, seen_root: false, open: None, found: Found::default() };
    let mut reader = Reader::from_str(text);
    reader.config_mut().expand_empty_elements = true;
    loop {
        reading.begin = usize::try_from(reader.buffer_position()).unwrap_or(usize::MAX);
        match reader.read_event() {
            Ok(Event::Start(tag)) => reading.open(&tag)?,
            Ok(Event::End(_)) => reading.close(),
            Ok(Event::Eof) => return reading.finish(),
            Ok(
                Event::Text(_)
                | Event::CData(_)
                | Event::Comment(_)
                | Event::Decl(_)
                | Event::PI(_)
                | Event::DocType(_)
                | Event::GeneralRef(_)
                | Event::Empty(_),
            ) => {}
            Err(quick_xml::Error::Syntax(_)) if reading.seen_root => return Err(reading.truncated()),
            Err(error) => return Err(reading.not_xml(&error)),
        }
    }
}

struct Reading<'a> {
    text: &'a str,
    /// Byte at which the current tag begins.
    begin: usize,
    depth: usize,
    seen_root: bool,
    /// The element whose content is being read.
    open: Option<Open>,
    found: Found,
}

/// Elements whose content was read.
#[derive(Default)]
struct Found {
    nodes: Placed<Node>,
    /// Ways with the ids of their nodes.
    ways: Placed<(Way, Vec<i64>)>,
    relations: Placed<Relation>,
}

/// Elements of one kind, and the byte that each begins at. Apart, since a map is mostly nodes: what is sorted out of them
/// would be there twice.
struct Placed<T> {
    items: Vec<T>,
    begins: Vec<usize>,
}

/// An element of which the tags and references are still to come.
struct Open {
    begin: usize,
    element: Element,
    /// Marked by an editor: to be left out.
    deleted: bool,
    geo_deg: Option<[f64; 2]>,
    local_x_m: Option<f64>,
    local_y_m: Option<f64>,
    ele_m: f64,
    nodes: Vec<i64>,
    members: Vec<Member>,
    tags: Vec<(Box<str>, Box<str>)>,
}

impl Reading<'_> {
    fn open(&mut self, tag: &BytesStart<'_>) -> Result<(), OsmError> {
        self.depth += 1;
        let name = tag.name();
        match (self.depth, name.0) {
            (1, "osm") if !self.seen_root => self.seen_root = true,
            (1, other) => {
                return Err(OsmError::NotOsm { line: self.line(), found: Some(other.to_owned()) });
            }
            (2, "node") => self.open = Some(self.element(tag, Kind::Node)?),
            (2, "way") => self.open = Some(self.element(tag, Kind::Way)?),
            (2, "relation") => self.open = Some(self.element(tag, Kind::Relation)?),
            (3, inner) => {
                if let Some(mut open) = self.open.take() {
                    match (inner, open.element.kind) {
                        ("tag", _) => self.tag(tag, &mut open)?,
                        ("nd", Kind::Way) => {
                            open.nodes.push(self.id(tag, "ref", ElementRef::Known(open.element))?);
                        }
                        ("member", Kind::Relation) => open.members.push(self.member(tag, open.element)?),
                        _ => {}
                    }
                    self.open = Some(open);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn close(&mut self) {
        if self.depth == 2
            && let Some(open) = self.open.take()
            && !open.deleted
        {
            self.found.add(open);
        }
        self.depth = self.depth.saturating_sub(1);
    }

    fn element(&self, tag: &BytesStart<'_>, kind: Kind) -> Result<Open, OsmError> {
        let element = Element { kind, id: self.id(tag, "id", ElementRef::Unknown(kind))? };
        let owner = ElementRef::Known(element);
        let deleted = self.attribute(tag, "action")?.is_some_and(|action| action == "delete")
            || self.attribute(tag, "deleted")?.is_some_and(|deleted| deleted == "true")
            || self.attribute(tag, "visible")?.is_some_and(|visible| visible == "false");
        let geo_deg = match kind {
            Kind::Node if !deleted => {
                let lat = self.degrees(tag, "lat", owner)?;
                lat.zip(self.degrees(tag, "lon", owner)?).map(|(lat, lon)| [lat, lon])
            }
            Kind::Node | Kind::Way | Kind::Relation => None,
        };
        Ok(Open {
            begin: self.begin,
            element,
            deleted,
            geo_deg,
            local_x_m: None,
            local_y_m: None,
            ele_m: 0.0,
            nodes: Vec::new(),
            members: Vec::new(),
            tags: Vec::new(),
        })
    }

    fn tag(&self, tag: &BytesStart<'_>, open: &mut Open) -> Result<(), OsmError> {
        let owner = ElementRef::Known(open.element);
        let key = self.required(tag, "k", owner)?;
        let value = self.required(tag, "v", owner)?;
        match (open.element.kind, key.as_ref()) {
            (Kind::Node, "local_x") => open.local_x_m = Some(self.number("local_x", &value, owner)?),
            (Kind::Node, "local_y") => open.local_y_m = Some(self.number("local_y", &value, owner)?),
            (Kind::Node, "ele") => open.ele_m = self.number("ele", &value, owner)?,
            (Kind::Node, other) if !NODE_TAGS.contains(&other) => {}
            (Kind::Node | Kind::Way | Kind::Relation, _) => open.tags.push((key.into(), value.into())),
        }
        Ok(())
    }

    fn member(&self, tag: &BytesStart<'_>, of: Element) -> Result<Member, OsmError> {
        let owner = ElementRef::Known(of);
        let kind = self.required(tag, "type", owner)?;
        let kind = match kind.as_ref() {
            "node" => Kind::Node,
            "way" => Kind::Way,
            "relation" => Kind::Relation,
            _ => return Err(self.bad_value("type", &kind, owner, "node, way or relation")),
        };
        let id = self.id(tag, "ref", owner)?;
        let role = self.attribute(tag, "role")?.unwrap_or_default();
        Ok(Member { role: role.into(), element: Element { kind, id } })
    }

    fn finish(mut self) -> Result<Osm, OsmError> {
        if !self.seen_root {
            return Err(OsmError::NotOsm { line: self.line(), found: None });
        }
        if self.depth > 0 {
            return Err(self.truncated());
        }
        let Found { nodes, ways, relations } = std::mem::take(&mut self.found);
        let nodes = self.layer(nodes, Kind::Node, |node| node.id)?;
        let resolved = ways.items.into_iter().zip(&ways.begins).map(|((mut way, ids), begin)| {
            let from = Element { kind: Kind::Way, id: way.id };
            way.nodes = ids
                .into_iter()
                .map(|id| {
                    let to = Element { kind: Kind::Node, id };
                    let line = || line_of(self.text.as_bytes(), *begin);
                    nodes.position(id).ok_or_else(|| OsmError::Missing { line: line(), from, to })
                })
                .collect::<Result<_, _>>()?;
            Ok(way)
        });
        let ways = Placed { items: resolved.collect::<Result<_, _>>()?, begins: ways.begins };
        let ways = self.layer(ways, Kind::Way, |way| way.id)?;
        let begins = relations.begins.clone();
        let osm =
            Osm { nodes, ways, relations: self.layer(relations, Kind::Relation, |relation| relation.id)? };
        for (relation, begin) in osm.relations.all().iter().zip(begins) {
            if let Some(to) = osm.missing_member(relation) {
                let from = Element { kind: Kind::Relation, id: relation.id };
                return Err(OsmError::Missing { line: line_of(self.text.as_bytes(), begin), from, to });
            }
        }
        Ok(osm)
    }

    /// Indexes elements of a kind by id, which must be unique.
    fn layer<T>(&self, found: Placed<T>, kind: Kind, id: impl Fn(&T) -> i64) -> Result<Layer<T>, OsmError> {
        let Placed { items, begins } = found;
        let mut by_id: Vec<(i64, usize)> = items.iter().map(id).zip(0..).collect();
        by_id.sort_unstable(); // of two with one id, the first in the file stays first
        for pair in by_id.windows(2) {
            if let [(id, first), (other, second)] = *pair
                && id == other
            {
                let [first_line, line] = [first, second]
                    .map(|at| line_of(self.text.as_bytes(), begins.get(at).copied().unwrap_or_default()));
                return Err(OsmError::Duplicate { line, element: Element { kind, id }, first_line });
            }
        }
        Ok(Layer { items, by_id })
    }

    fn attribute<'t>(&self, tag: &'t BytesStart<'_>, key: &str) -> Result<Option<Cow<'t, str>>, OsmError> {
        let mut attributes = tag.attributes();
        // Looking for doubles takes time in the square of their number; the first one counts.
        for attribute in attributes.with_checks(false) {
            let attribute = attribute.map_err(|error| self.not_xml(&error))?;
            if attribute.key.0 == key {
                let value = attribute.normalized_value(XmlVersion::Implicit1_0);
                return value.map(Some).map_err(|error| self.not_xml(&error));
            }
        }
        Ok(None)
    }

    fn required<'t>(
        &self,
        tag: &'t BytesStart<'_>,
        key: &'static str,
        owner: ElementRef,
    ) -> Result<Cow<'t, str>, OsmError> {
        let value = self.attribute(tag, key)?;
        value.ok_or_else(|| OsmError::MissingAttribute { line: self.line(), element: owner, key })
    }

    fn id(&self, tag: &BytesStart<'_>, key: &'static str, owner: ElementRef) -> Result<i64, OsmError> {
        let text = self.required(tag, key, owner)?;
        text.trim().parse().map_err(|_| self.bad_value(key, &text, owner, "a whole number of 64 bits"))
    }

    /// Maps that are only local leave these empty.
    fn degrees(
        &self,
        tag: &BytesStart<'_>,
        key: &'static str,
        owner: ElementRef,
    ) -> Result<Option<f64>, OsmError> {
        match self.attribute(tag, key)? {
            Some(text) if !text.trim().is_empty() => self.number(key, &text, owner).map(Some),
            Some(_) | None => Ok(None),
        }
    }

    fn number(&self, key: &'static str, text: &str, owner: ElementRef) -> Result<f64, OsmError> {
        let number = text.trim().parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| self.bad_value(key, text, owner, "a number"))
    }

    fn bad_value(
        &self,
        key: &'static str,
        value: &str,
        owner: ElementRef,
        expected: &'static str,
    ) -> OsmError {
        let shown = value.chars().take(80).collect();
        OsmError::BadValue { line: self.line(), element: owner, key, value: shown, expected }
    }

    fn not_xml(&self, error: &dyn std::error::Error) -> OsmError {
        OsmError::NotXml { line: self.line(), reason: error.to_string() }
    }

    fn truncated(&self) -> OsmError {
        OsmError::Truncated { line: line_of(self.text.as_bytes(), self.text.len()) }
    }

    fn line(&self) -> usize {
        line_of(self.text.as_bytes(), self.begin)
    }
}

impl Found {
    fn add(&mut self, open: Open) {
        let Element { kind, id } = open.element;
        let tags = Tags(open.tags.into());
        match kind {
            Kind::Node => {
                let local_m = open.local_x_m.zip(open.local_y_m).map(|(x, y)| [x, y]);
                let node = Node { id, geo_deg: open.geo_deg, local_m, ele_m: open.ele_m, tags };
                self.nodes.push(node, open.begin);
            }
            Kind::Way => self.ways.push((Way { id, nodes: Vec::new(), tags }, open.nodes), open.begin),
            Kind::Relation => {
                self.relations.push(Relation { id, members: open.members, tags }, open.begin);
            }
        }
    }
}

impl<T> Placed<T> {
    fn push(&mut self, item: T, begin: usize) {
        self.items.push(item);
        self.begins.push(begin);
    }
}

impl<T> Default for Placed<T> {
    fn default() -> Self {
        Self { items: Vec::new(), begins: Vec::new() }
    }
}

impl Osm {
    /// A member that a lanelet or regulatory element needs and the file does not have. Other relations
    /// may be incomplete, as editors download them.
    fn missing_member(&self, relation: &Relation) -> Option<Element> {
        if !relation.is_lanelet() && !relation.tags.is("type", "regulatory_element") {
            return None;
        }
        relation.members.iter().map(|member| member.element).find(|element| {
            let found = match element.kind {
                Kind::Node => self.nodes.position(element.id),
                Kind::Way => self.ways.position(element.id),
                Kind::Relation => self.relations.position(element.id),
            };
            found.is_none()
        })
    }
}

/// The line on which an element begins, from 1; `None` if it is not in the file.
pub fn line_of_element(bytes: &[u8], element: Element) -> Option<usize> {
    let mut reader = Reader::from_str(str::from_utf8(bytes).ok()?);
    loop {
        let begin = usize::try_from(reader.buffer_position()).ok()?;
        let event = reader.read_event().ok()?;
        if let Event::Start(tag) | Event::Empty(tag) = &event
            && tag.name().0 == element.kind.to_string()
        {
            let mut attributes = tag.attributes();
            let is_id = |attribute: Attribute<'_>| {
                attribute.key.0 == "id" && attribute.value.trim().parse() == Ok(element.id)
            };
            if attributes.with_checks(false).flatten().any(is_id) {
                return Some(line_of(bytes, begin));
            }
        }
        if matches!(event, Event::Eof) {
            return None;
        }
    }
}

/// Line of a byte, from 1. Counted only when something is wrong.
fn line_of(text: &[u8], at: usize) -> usize {
    let before = text.get(..at).unwrap_or(text);
    before.split(|byte| *byte == b'\n').count()
}
