//! Reads the CAN messages of an AUTOSAR system description (ARXML).
//!
//! One cluster becomes a [`Database`], like a DBC: its frame triggerings are the messages, and the signals of
//! their PDUs are the signals. Unread parts (containers of PDUs, end-to-end protection, update bits) are
//! reported as findings, never guessed.

mod signal;
mod tree;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;

use roxmltree::{Document, Error, Node, ParsingOptions};

use crate::config::reading::xml_text::{CrowdedElement, crowded_element};
use can_signal::can::{CanId, FrameFormat, MAX_DATA};
use can_signal::dbc::codec::{Layout, SignalCodec};
use can_signal::dbc::model::{
    Contradiction, Database, DbcFinding, DbcSeverity, MAX_ENTRIES, Message, Number, Signal,
};
use signal::{PlacedSignal, Scales, byte_order};
use tree::{NamedElements, Unread, descend, listed, number, text_of, whole_of};

/// Maximum number of nodes (elements, texts etc.) in a small file. The parser uses about 90 bytes for each.
const MIN_NODES: usize = 1_000_000;
/// Number of file bytes per further node; real files have one node in 21 bytes.
const BYTES_FOR_NODE: usize = 16;
const MAX_CLASSIC_DATA: usize = 8;
/// The namespace of AUTOSAR 4, up to its minor version.
const AUTOSAR_4: &str = "http://autosar.org/schema/r4";

/// Path from a PDU to its period in seconds.
const PERIOD: [&str; 7] = [
    "I-PDU-TIMING-SPECIFICATIONS",
    "I-PDU-TIMING",
    "TRANSMISSION-MODE-DECLARATION",
    "TRANSMISSION-MODE-TRUE-TIMING",
    "CYCLIC-TIMING",
    "TIME-PERIOD",
    "VALUE",
];

/// Path from a group of signals to its end-to-end protection.
const PROTECTION: [&str; 2] = ["TRANSFORMATION-I-SIGNAL-PROPSS", "END-TO-END-TRANSFORMATION-I-SIGNAL-PROPS"];
const UNREAD_PROTECTION: &str = "end-to-end protection is not read: give it with the key e2e of the message";

/// Reason why no messages can be read from a file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum ArxmlError {
    /// The file is not readable XML; contains the parser's reason.
    #[error("not XML that can be read: {0}")]
    Xml(String),
    /// The file is not AUTOSAR 4; contains the namespace of its root.
    #[error("{0:?} is not AUTOSAR 4, the only version that is read")]
    Version(String),
    /// The file has no CAN cluster, e.g. the extract of a single control unit.
    #[error(
        "it has no CAN cluster: only system descriptions with CAN-CLUSTER and CAN-FRAME-TRIGGERING are read"
    )]
    NoCluster,
    /// The file has several CAN clusters, and none of them is chosen; contains their names.
    #[error("its CAN clusters are {}", .0.join(", "))]
    Choose(Vec<String>),
}

/// Reads the messages of the CAN cluster with this name, or of the only cluster.
pub(super) fn read(content: &[u8], cluster: Option<&str>) -> Result<Database, ArxmlError> {
    let text = str::from_utf8(content).map_err(|error| ArxmlError::Xml(format!("not UTF-8: {error}")))?;
    let text = text.trim_start_matches('\u{FEFF}');
    if let Some(crowd) = crowded_element(text) {
        let line = 1 + text.bytes().take(crowd.offset).filter(|byte| *byte == b'\n').count();
        return Err(ArxmlError::Xml(format!("line {line}: {}; {}", crowd.reason, CrowdedElement::REMEDY)));
    }
    let most = MIN_NODES + text.len() / BYTES_FOR_NODE;
    let nodes_limit = u32::try_from(most).unwrap_or(u32::MAX);
    let options = ParsingOptions { allow_dtd: false, nodes_limit, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        ArxmlError::Xml(if matches!(error, Error::NodesLimitReached) {
            let bytes = text.len();
            format!("more than {most} elements and texts, the most of a file with {bytes} bytes; export fewer clusters")
        } else {
            error.to_string()
        })
    })?;
    let namespace = document.root_element().tag_name().namespace().unwrap_or_default();
    if !namespace.starts_with(AUTOSAR_4) {
        return Err(ArxmlError::Version(namespace.to_owned()));
    }
    let mut clusters = BTreeMap::new();
    for element in document.descendants().filter(|node| node.tag_name().name() == "CAN-CLUSTER") {
        clusters.extend(text_of(element, "SHORT-NAME").map(|name| (name, element)));
    }
    let chosen = match (cluster, clusters.len()) {
        (_, 0) => return Err(ArxmlError::NoCluster),
        (None, 1) => clusters.values().next(),
        (None, _) => None,
        (Some(name), _) => clusters.get(name),
    };
    let names = || clusters.keys().map(|name| (*name).to_owned()).collect();
    let chosen = *chosen.ok_or_else(|| ArxmlError::Choose(names()))?;
    let reader = ClusterReader {
        elements: NamedElements::of(&document),
        scales: Scales::default(),
        database: Database::default(),
        ids: BTreeSet::new(),
        names: BTreeSet::new(),
        entries: 0,
    };
    Ok(reader.database(chosen))
}

#[derive(Default)]
struct FrameContent<'d> {
    signals: Vec<CollectedSignal<'d>>,
    selectors: Vec<Selector<'d>>,
    cycle_ms: Option<u32>,
}

/// A signal, with the selector of its part of a multiplexed PDU and the value that selects the part.
struct CollectedSignal<'d> {
    signal: PlacedSignal<'d>,
    selected_by: Option<(Layout, u64)>,
}

struct Selector<'d> {
    pdu: Node<'d, 'd>,
    layout: Layout,
    values: Vec<(i128, String)>,
}

struct ClusterReader<'d> {
    elements: NamedElements<'d>,
    scales: Scales,
    database: Database,
    ids: BTreeSet<CanId>,
    names: BTreeSet<String>,
    /// Number of elements that were read for frames so far; a small file can refer to one PDU many times.
    entries: usize,
}

impl<'d> ClusterReader<'d> {
    fn database(mut self, cluster: Node<'d, 'd>) -> Database {
        let conditionals = listed(cluster, "CAN-CLUSTER-VARIANTS", "CAN-CLUSTER-CONDITIONAL");
        let channels =
            conditionals.flat_map(|part| listed(part, "PHYSICAL-CHANNELS", "CAN-PHYSICAL-CHANNEL"));
        if let Some(protection) = self.elements.first("END-TO-END-PROTECTION") {
            self.find(protection, DbcSeverity::Partial, UNREAD_PROTECTION);
        }
        let triggerings = channels.flat_map(|part| listed(part, "FRAME-TRIGGERINGS", "CAN-FRAME-TRIGGERING"));
        for triggering in triggerings {
            if let Err(reason) = self.message(triggering) {
                self.find(triggering, DbcSeverity::Rejected, reason);
            }
            if self.is_full() {
                return Database { is_too_large: true, ..Database::default() };
            }
        }
        let has_fd = self.database.messages.iter().any(|message| message.format == Some(FrameFormat::Fd));
        if !has_fd {
            self.database.messages.iter_mut().for_each(|message| message.format = Some(FrameFormat::Classic));
        }
        self.database.findings.sort_by_key(|finding| finding.line);
        self.database
    }

    fn is_full(&self) -> bool {
        self.entries + self.scales.texts + self.database.findings.len() > MAX_ENTRIES
    }

    fn find(&mut self, element: Node<'_, '_>, severity: DbcSeverity, reason: impl Display) {
        let name = text_of(element, "SHORT-NAME").unwrap_or_else(|| element.tag_name().name());
        let excerpt = name.chars().filter(|char| !char.is_control()).take(60).collect();
        let line = self.elements.line(element);
        self.database.findings.push(DbcFinding { line, severity, excerpt, reason: reason.to_string() });
    }

    fn message(&mut self, triggering: Node<'d, 'd>) -> Result<(), Unread> {
        self.entries += 1;
        let frame = self.elements.follow(triggering, "FRAME-REF").ok_or("FRAME-REF leads nowhere")?;
        let name = text_of(frame, "SHORT-NAME").ok_or("its frame has no SHORT-NAME")?;
        let id = whole_of::<u32>(triggering, "IDENTIFIER").ok_or("without an IDENTIFIER")?;
        let is_extended = text_of(triggering, "CAN-ADDRESSING-MODE") == Some("EXTENDED");
        let id = if is_extended { CanId::extended(id) } else { CanId::standard(id) };
        let id = id.ok_or("IDENTIFIER has more bits than CAN-ADDRESSING-MODE says")?;
        let length = whole_of::<usize>(frame, "FRAME-LENGTH").filter(|length| *length <= MAX_DATA);
        let length =
            length.ok_or_else(|| format!("its frame has no FRAME-LENGTH of 0 to {MAX_DATA} bytes"))?;
        let (has_id, has_name) = (self.ids.contains(&id), self.names.contains(name));
        if has_id || has_name {
            let line = self.elements.line(triggering);
            let others = self.database.messages.iter();
            let others = others.filter(|known| (known.id == id) != (known.name == name));
            self.database.contradictions.extend(others.map(|known| Contradiction {
                message: known.name.clone(),
                signal: None,
                lines: [known.line, line],
            }));
            let taken = if has_id { format!("identifier {id}") } else { format!("the name {name}") };
            return Err(format!("{taken} is taken by a message above").into());
        }
        self.ids.insert(id);
        self.names.insert(name.to_owned());
        let mut content = FrameContent::default();
        for mapping in listed(frame, "PDU-TO-FRAME-MAPPINGS", "PDU-TO-FRAME-MAPPING") {
            // A PDU begins with a byte: at its bit 0, or in the big-endian order at its bit 7.
            let offset = whole_of::<u16>(mapping, "START-POSITION").unwrap_or(0) / 8;
            match self.elements.follow(mapping, "PDU-REF") {
                Some(pdu) => self.pdu(pdu, offset, false, &mut content),
                None => self.find(mapping, DbcSeverity::Rejected, "PDU-REF leads nowhere"),
            }
        }
        let behaviours =
            ["CAN-FRAME-TX-BEHAVIOR", "CAN-FRAME-RX-BEHAVIOR"].map(|key| text_of(triggering, key));
        let format = if length > MAX_CLASSIC_DATA || behaviours.contains(&Some("CAN-FD")) {
            Some(FrameFormat::Fd)
        } else {
            behaviours.contains(&Some("CAN-20")).then_some(FrameFormat::Classic)
        };
        let (cycle_ms, line) = (content.cycle_ms, self.elements.line(triggering));
        let signals = self.signals(name, length, content);
        let (name, other_name) = (name.to_owned(), None);
        let message = Message { name, other_name, id, length, format, cycle_ms, line, signals };
        self.database.messages.push(message);
        Ok(())
    }

    /// Collects the signals of a PDU that begins `offset` bytes into its frame, and `is_part` of a
    /// multiplexed one or not.
    fn pdu(&mut self, pdu: Node<'d, 'd>, offset: u16, is_part: bool, content: &mut FrameContent<'d>) {
        let period = descend(pdu, &PERIOD).and_then(|value| number(value.text()?.trim()));
        content.cycle_ms = [content.cycle_ms, period.and_then(milliseconds)].into_iter().flatten().min();
        let read = match pdu.tag_name().name() {
            "CONTAINER-I-PDU" => Err("containers of PDUs are not read".into()),
            "MULTIPLEXED-I-PDU" if is_part => Err("a multiplexed PDU within another one is not read".into()),
            "MULTIPLEXED-I-PDU" => self.multiplexed(pdu, offset, content),
            "SECURED-I-PDU" => self.secured(pdu, offset, is_part, content),
            _ => {
                self.mappings(pdu, offset, content);
                Ok(())
            }
        };
        if let Err(reason) = read {
            self.find(pdu, DbcSeverity::Rejected, reason);
        }
    }

    fn secured(
        &mut self,
        pdu: Node<'d, 'd>,
        offset: u16,
        is_part: bool,
        content: &mut FrameContent<'d>,
    ) -> Result<(), Unread> {
        let triggering = self.elements.follow(pdu, "PAYLOAD-REF");
        let payload = triggering.and_then(|triggering| self.elements.follow(triggering, "I-PDU-REF"));
        let payload = payload.filter(|payload| payload.tag_name().name() != "SECURED-I-PDU");
        let payload = payload.ok_or("its payload is not found")?;
        self.find(pdu, DbcSeverity::Partial, "its authentication (SecOC) is not checked");
        self.pdu(payload, offset, is_part, content);
        Ok(())
    }

    fn mappings(&mut self, pdu: Node<'d, 'd>, offset: u16, content: &mut FrameContent<'d>) {
        let lists = ["I-SIGNAL-TO-PDU-MAPPINGS", "I-SIGNAL-TO-I-PDU-MAPPINGS"];
        for mapping in lists.into_iter().flat_map(|list| listed(pdu, list, "I-SIGNAL-TO-I-PDU-MAPPING")) {
            self.entries += 1;
            if self.is_full() {
                return;
            }
            match PlacedSignal::of_mapping(&self.elements, mapping, offset, &mut self.scales) {
                Ok(Some((signal, omissions))) => {
                    for omission in omissions {
                        self.find(signal.element, DbcSeverity::Partial, omission);
                    }
                    content.signals.push(CollectedSignal { signal, selected_by: None });
                }
                Ok(None) => {
                    let group = self.elements.follow(mapping, "I-SIGNAL-GROUP-REF");
                    if let Some(group) = group.filter(|group| descend(*group, &PROTECTION).is_some()) {
                        self.find(group, DbcSeverity::Partial, UNREAD_PROTECTION);
                    }
                }
                Err(reason) => self.find(mapping, DbcSeverity::Rejected, reason),
            }
        }
    }

    /// Collects the parts of a multiplexed PDU. Each dynamic part has the selector among its signals; it is
    /// one signal of the message.
    fn multiplexed(
        &mut self,
        pdu: Node<'d, 'd>,
        offset: u16,
        content: &mut FrameContent<'d>,
    ) -> Result<(), Unread> {
        let field = |key| whole_of::<u16>(pdu, key).ok_or_else(|| format!("without a {key}"));
        let start = field("SELECTOR-FIELD-START-POSITION")?.checked_add(8 * offset);
        let start = start.ok_or("the selector lies beyond every frame")?;
        let order = byte_order(pdu, "SELECTOR-FIELD-BYTE-ORDER")?;
        let layout = Layout { start, length: field("SELECTOR-FIELD-LENGTH")?, order, signed: false };
        let mut values = Vec::new();
        let alternatives = listed(pdu, "DYNAMIC-PARTS", "DYNAMIC-PART")
            .flat_map(|part| listed(part, "DYNAMIC-PART-ALTERNATIVES", "DYNAMIC-PART-ALTERNATIVE"));
        for alternative in alternatives {
            self.entries += 1;
            if self.is_full() {
                break;
            }
            let code = whole_of::<u64>(alternative, "SELECTOR-FIELD-CODE");
            let Some((code, part)) = code.zip(self.elements.follow(alternative, "I-PDU-REF")) else {
                self.find(alternative, DbcSeverity::Rejected, "without a SELECTOR-FIELD-CODE or a PDU");
                continue;
            };
            let mut dynamic = FrameContent::default();
            self.pdu(part, offset, true, &mut dynamic);
            content.cycle_ms = [content.cycle_ms, dynamic.cycle_ms].into_iter().flatten().min();
            for CollectedSignal { signal, .. } in dynamic.signals {
                if (signal.layout.start, signal.layout.length) == (layout.start, layout.length) {
                    let is_new = |raw: i128| values.iter().all(|(known, _)| *known != raw);
                    let new = signal.values().iter().filter(|(raw, _)| is_new(*raw)).cloned();
                    let new: Vec<_> = new.collect();
                    self.entries += new.len();
                    values.extend(new);
                } else {
                    content.signals.push(CollectedSignal { signal, selected_by: Some((layout, code)) });
                }
            }
        }
        content.selectors.push(Selector { pdu, layout, values });
        for part in listed(pdu, "STATIC-PARTS", "STATIC-PART") {
            match self.elements.follow(part, "I-PDU-REF") {
                Some(part) => self.mappings(part, offset, content),
                None => self.find(part, DbcSeverity::Rejected, "I-PDU-REF leads nowhere"),
            }
        }
        Ok(())
    }

    /// Compiles the collected signals of a message of `length` bytes.
    fn signals(&mut self, message: &str, length: usize, content: FrameContent<'d>) -> Vec<Signal> {
        let codec_of = |layout| SignalCodec::new(layout, length).map_err(|error| error.to_string());
        let (mut compiled, mut names) = (Vec::new(), BTreeMap::new());
        for (number, Selector { pdu, layout, values }) in (1..).zip(content.selectors) {
            // The element has no name of its own; cantools uses this one.
            let (name, line) = (format!("{message}_selector{number}"), self.elements.line(pdu));
            names.insert(name.clone(), (layout, line));
            match codec_of(layout) {
                Ok(codec) => compiled.push(Signal {
                    name,
                    other_name: None,
                    line,
                    codec,
                    number: Number::Integer,
                    factor: 1.0,
                    offset: 0.0,
                    unit: String::new(),
                    values: values.into(),
                }),
                Err(reason) => self.find(pdu, DbcSeverity::Rejected, reason),
            }
        }
        for CollectedSignal { signal, selected_by } in content.signals {
            let (element, line) = (signal.element, self.elements.line(signal.element));
            let codec = codec_of(signal.layout).and_then(|codec| match selected_by {
                None => Ok(codec),
                Some((selector, code)) => {
                    let codec = codec.multiplexed(&codec_of(selector)?, &[code..=code]);
                    let is_reachable = codec.select(&mut [0; MAX_DATA]).is_ok();
                    is_reachable.then_some(codec).ok_or_else(|| format!("the selector cannot be {code}"))
                }
            });
            let first = *names.entry(signal.name.to_owned()).or_insert((signal.layout, line));
            let taken = first.1 != line;
            match codec {
                Ok(_) if taken => {
                    // One signal may be in several alternatives of a multiplexed PDU.
                    if first.0 != signal.layout {
                        self.database.contradictions.push(Contradiction {
                            message: message.to_owned(),
                            signal: Some(signal.name.to_owned()),
                            lines: [first.1, line],
                        });
                    }
                    self.find(element, DbcSeverity::Rejected, "a signal above has the same name");
                }
                Ok(codec) => compiled.push(signal.compiled(line, codec)),
                Err(reason) => self.find(element, DbcSeverity::Rejected, reason),
            }
        }
        compiled
    }
}

/// Returns a period in whole milliseconds; `None` for zero or an invalid time.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // within the range of the filter
fn milliseconds(seconds: f64) -> Option<u32> {
    let millis = (seconds * 1000.0).round();
    (1.0..=f64::from(u32::MAX)).contains(&millis).then_some(millis as u32)
}

#[cfg(test)]
mod tests;
