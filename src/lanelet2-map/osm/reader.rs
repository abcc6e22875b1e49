//! Converts XML text to primitives in one pass, without a tree and without holding the whole text.

use std::borrow::Cow;
use std::str;

use quick_xml::errors::SyntaxError;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;
use quick_xml::{Error, XmlVersion};

use super::primitives::{
    ElementPlace, ElementRef, Member, Node, Osm, OsmElement, OsmError, OsmFault, OsmKind, OsmLayer, Relation,
    Tags, Way,
};

/// Tags of nodes kept as text; most nodes have none.
const NODE_TAGS: [&str; 2] = ["color", "arrow"];

/// Reads a whole file.
///
/// # Errors
/// Fails like [`read_events`].
pub fn read(bytes: &[u8]) -> Result<Osm, OsmError> {
    let mut reader = Reader::from_reader(bytes);
    read_events(|text| reader.read_event_into(text))
}

/// Reads a file from its XML events, so that its text need not be in memory. `next` returns the next event
/// and stores its text in the empty buffer, like [`Reader::read_event_into`].
///
/// Memory is bounded by the size of the text.
///
/// # Errors
/// Returns the first fault, with its line; references are checked last.
pub fn read_events(
    mut next: impl for<'t> FnMut(&'t mut Vec<u8>) -> Result<Event<'t>, Error>,
) -> Result<Osm, OsmError> {
    let mut reading = OsmReading { line: 1, ..OsmReading::default() };
    let mut text = Vec::new();
    loop {
        match next(&mut text) {
            Ok(Event::Start(tag)) => reading.open(&tag)?,
            Ok(Event::Empty(tag)) => {
                reading.open(&tag)?;
                reading.close();
            }
            Ok(Event::End(_)) => reading.close(),
            Ok(Event::Eof) => return reading.finish(),
            Ok(
                Event::Text(_)
                | Event::CData(_)
                | Event::Comment(_)
                | Event::Decl(_)
                | Event::PI(_)
                | Event::DocType(_)
                | Event::GeneralRef(_),
            ) => {}
            Err(error) => return Err(reading.failed(&error, &text)),
        }
        reading.line += line_ends(&text);
        text.clear();
    }
}

#[derive(Default)]
struct OsmReading {
    /// Line on which the current event begins, from 1.
    line: usize,
    depth: usize,
    seen_root: bool,
    /// The element whose content is being read.
    open: Option<OpenElement>,
    osm: Osm,
    way_nodes: Vec<Box<[i64]>>,
}

/// An element whose tags and references are not read yet.
struct OpenElement {
    line: usize,
    element: OsmElement,
    /// True if an editor has marked it as deleted.
    deleted: bool,
    geo_deg: Option<[f64; 2]>,
    local_x_m: Option<f64>,
    local_y_m: Option<f64>,
    ele_m: f64,
    nodes: Vec<i64>,
    members: Vec<Member>,
    /// Keys and values in the format of [`Tags`].
    tags: Vec<u8>,
}

impl OsmReading {
    fn open(&mut self, tag: &BytesStart<'_>) -> Result<(), OsmError> {
        self.depth += 1;
        let name = tag.name();
        match (self.depth, name.0) {
            (1, "osm") if !self.seen_root => self.seen_root = true,
            (1, other) => {
                return Err(self.error(OsmFault::NotOsm(Some(other.to_owned()))));
            }
            (2, "node") => self.open = Some(self.element(tag, OsmKind::Node)?),
            (2, "way") => self.open = Some(self.element(tag, OsmKind::Way)?),
            (2, "relation") => self.open = Some(self.element(tag, OsmKind::Relation)?),
            (3, inner) => {
                if let Some(mut open) = self.open.take() {
                    match (inner, open.element.kind) {
                        ("tag", _) => self.tag(tag, &mut open)?,
                        ("nd", OsmKind::Way) => {
                            let [id] = self.attributes(tag, ["ref"])?;
                            open.nodes.push(self.id("ref", id, ElementRef::Known(open.element))?);
                        }
                        ("member", OsmKind::Relation) => open.members.push(self.member(tag, open.element)?),
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
            self.add(open);
        }
        self.depth = self.depth.saturating_sub(1);
    }

    fn add(&mut self, open: OpenElement) {
        let OsmElement { kind, id } = open.element;
        let tags = Tags(open.tags.into());
        match kind {
            OsmKind::Node => {
                let local_m = open.local_x_m.zip(open.local_y_m).map(|(x, y)| [x, y]);
                let node = Node { id, geo_deg: open.geo_deg, local_m, ele_m: open.ele_m, tags };
                self.osm.nodes.push(id, open.line, node);
            }
            OsmKind::Way => {
                self.osm.ways.push(id, open.line, Way { id, nodes: Vec::new(), tags });
                self.way_nodes.push(open.nodes.into());
            }
            OsmKind::Relation => {
                self.osm.relations.push(id, open.line, Relation { id, members: open.members, tags });
            }
        }
    }

    fn element(&self, tag: &BytesStart<'_>, kind: OsmKind) -> Result<OpenElement, OsmError> {
        let keys = ["id", "action", "deleted", "visible", "lat", "lon"];
        let [id, action, deleted, visible, lat, lon] = self.attributes(tag, keys)?;
        let element = OsmElement { kind, id: self.id("id", id, ElementRef::Unknown(kind))? };
        let owner = ElementRef::Known(element);
        let deleted = action.is_some_and(|action| action == "delete")
            || deleted.is_some_and(|deleted| deleted == "true")
            || visible.is_some_and(|visible| visible == "false");
        let geo_deg = match kind {
            OsmKind::Node if !deleted => {
                let lat = self.degrees("lat", lat, owner)?;
                lat.zip(self.degrees("lon", lon, owner)?).map(|(lat, lon)| [lat, lon])
            }
            OsmKind::Node | OsmKind::Way | OsmKind::Relation => None,
        };
        Ok(OpenElement {
            line: self.line,
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

    fn tag(&self, tag: &BytesStart<'_>, open: &mut OpenElement) -> Result<(), OsmError> {
        let owner = ElementRef::Known(open.element);
        let [key, value] = self.attributes(tag, ["k", "v"])?;
        let (key, value) = (self.required("k", key, owner)?, self.required("v", value, owner)?);
        match (open.element.kind, key.as_ref()) {
            (OsmKind::Node, "local_x") => open.local_x_m = Some(self.number("local_x", &value, owner)?),
            (OsmKind::Node, "local_y") => open.local_y_m = Some(self.number("local_y", &value, owner)?),
            (OsmKind::Node, "ele") => open.ele_m = self.number("ele", &value, owner)?,
            (OsmKind::Node, other) if !NODE_TAGS.contains(&other) => {}
            (OsmKind::Node | OsmKind::Way | OsmKind::Relation, _) => {
                for text in [key, value] {
                    open.tags.extend(text.bytes().chain([Tags::END]));
                }
            }
        }
        Ok(())
    }

    fn member(&self, tag: &BytesStart<'_>, of: OsmElement) -> Result<Member, OsmError> {
        let owner = ElementRef::Known(of);
        let [kind, id, role] = self.attributes(tag, ["type", "ref", "role"])?;
        let kind = self.required("type", kind, owner)?;
        let kind = match kind.as_ref() {
            "node" => OsmKind::Node,
            "way" => OsmKind::Way,
            "relation" => OsmKind::Relation,
            _ => return Err(self.bad_value("type", &kind, owner, "node, way or relation")),
        };
        let element = OsmElement { kind, id: self.id("ref", id, owner)? };
        Ok(Member { role: role.unwrap_or_default().into(), element })
    }

    fn finish(self) -> Result<Osm, OsmError> {
        let Self { line, mut osm, .. } = self;
        if !self.seen_root {
            return Err(OsmError { line, fault: OsmFault::NotOsm(None) });
        }
        if self.depth > 0 {
            return Err(OsmError { line, fault: OsmFault::Truncated });
        }
        osm.nodes.index(OsmKind::Node)?;
        osm.ways.index(OsmKind::Way)?;
        osm.relations.index(OsmKind::Relation)?;
        for (way, ids) in osm.ways.items.iter_mut().zip(self.way_nodes) {
            let positions = ids.into_iter().map(|id| osm.nodes.position(id).ok_or(id));
            way.nodes = match positions.collect() {
                Ok(nodes) => nodes,
                Err(id) => {
                    let from = OsmElement { kind: OsmKind::Way, id: way.id };
                    return Err(osm.missing(from, OsmElement { kind: OsmKind::Node, id }));
                }
            };
        }
        for relation in osm.relations.all() {
            if let Some(to) = osm.missing_member(relation) {
                return Err(osm.missing(OsmElement { kind: OsmKind::Relation, id: relation.id }, to));
            }
        }
        Ok(osm)
    }

    /// Returns the values of these attributes; of a repeated attribute, the first.
    fn attributes<'t, const N: usize>(
        &self,
        tag: &'t BytesStart<'_>,
        keys: [&str; N],
    ) -> Result<[Option<Cow<'t, str>>; N], OsmError> {
        let mut values = [const { None }; N];
        let mut attributes = tag.attributes();
        // Searching for duplicates takes quadratic time.
        for attribute in attributes.with_checks(false) {
            let attribute = attribute.map_err(|error| self.not_xml(&error))?;
            let wanted = keys.iter().zip(&mut values).find(|(key, _)| **key == attribute.key.0);
            if let Some((_, value @ None)) = wanted {
                let text = attribute.normalized_value(XmlVersion::Implicit1_0);
                *value = Some(text.map_err(|error| self.not_xml(&error))?);
                if values.iter().all(Option::is_some) {
                    break;
                }
            }
        }
        Ok(values)
    }

    fn required<'t>(
        &self,
        key: &'static str,
        value: Option<Cow<'t, str>>,
        owner: ElementRef,
    ) -> Result<Cow<'t, str>, OsmError> {
        value.ok_or_else(|| self.error(OsmFault::MissingAttribute { element: owner, key }))
    }

    fn id(&self, key: &'static str, value: Option<Cow<'_, str>>, owner: ElementRef) -> Result<i64, OsmError> {
        let text = self.required(key, value, owner)?;
        text.trim().parse().map_err(|_| self.bad_value(key, &text, owner, "a whole number of 64 bits"))
    }

    /// Reads degrees; maps with only local coordinates leave these empty.
    fn degrees(
        &self,
        key: &'static str,
        value: Option<Cow<'_, str>>,
        owner: ElementRef,
    ) -> Result<Option<f64>, OsmError> {
        let text = value.filter(|text| !text.trim().is_empty());
        text.map(|text| self.number(key, &text, owner)).transpose()
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
        self.error(OsmFault::BadValue { element: owner, key, value: shown, expected })
    }

    fn error(&self, fault: OsmFault) -> OsmError {
        OsmError { line: self.line, fault }
    }

    fn not_xml(&self, error: &dyn std::error::Error) -> OsmError {
        self.error(OsmFault::NotXml(error.to_string()))
    }

    /// Converts an error of the parser; `text` is the text that it could not parse.
    fn failed(&self, error: &Error, text: &[u8]) -> OsmError {
        let line = self.line + line_ends(text);
        match (error, str::from_utf8(text)) {
            (Error::Io(error), _) => OsmError { line, fault: OsmFault::NotRead(error.to_string()) },
            (_, Err(error)) => {
                let valid = text.get(..error.valid_up_to()).unwrap_or_default();
                OsmError { line: self.line + line_ends(valid), fault: OsmFault::NotUtf8 }
            }
            // The other errors mean that an end was searched up to the end of the file.
            (Error::Syntax(reason), Ok(_)) if self.seen_root && *reason != SyntaxError::InvalidBangMarkup => {
                OsmError { line, fault: OsmFault::Truncated }
            }
            (error, Ok(_)) => self.not_xml(error),
        }
    }
}

fn line_ends(text: &[u8]) -> usize {
    text.iter().map(|byte| usize::from(*byte == b'\n')).sum()
}

impl<T> OsmLayer<T> {
    fn push(&mut self, id: i64, line: usize, item: T) {
        let [position, line] = [self.items.len(), line].map(|at| u32::try_from(at).unwrap_or(u32::MAX));
        self.places.push(ElementPlace { id, position, line });
        self.items.push(item);
    }

    /// Sorts the elements by id, which must be unique, for lookup.
    fn index(&mut self, kind: OsmKind) -> Result<(), OsmError> {
        self.places.sort_unstable(); // of two with one id, the first in the file stays first
        let twice = self.places.windows(2).find_map(|pair| match *pair {
            [first, second] if first.id == second.id => Some([first, second]),
            _ => None,
        });
        let Some([first, second]) = twice else { return Ok(()) };
        let [first_line, line] = [first, second].map(|place| place.line as usize);
        let element = OsmElement { kind, id: first.id };
        Err(OsmError { line, fault: OsmFault::Duplicate { element, first_line } })
    }
}

impl Osm {
    fn missing(&self, from: OsmElement, to: OsmElement) -> OsmError {
        OsmError { line: self.line(from).unwrap_or(1), fault: OsmFault::Missing { from, to } }
    }

    /// Returns a member that a lanelet or regulatory element needs and that the file does not have. Other
    /// relations may be incomplete, as downloaded by editors.
    fn missing_member(&self, relation: &Relation) -> Option<OsmElement> {
        if !relation.is_lanelet() && !relation.tags.is("type", "regulatory_element") {
            return None;
        }
        relation.members.iter().map(|member| member.element).find(|element| self.line(*element).is_none())
    }
}
