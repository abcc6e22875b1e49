//! Signals of a PDU: their layout, number format, scaling and texts.

use std::collections::HashMap;
use std::sync::Arc;

use roxmltree::{Node, NodeId};

use super::tree::{NamedElements, Unread, child, descend, listed, number, text_of, whole, whole_of};
use can_signal::dbc::codec::{ByteOrder, Layout, SignalCodec};
use can_signal::dbc::model::{Number, Signal};

/// Path from the properties of a signal to the properties of its data.
const DATA_PROPERTIES: [&str; 2] = ["SW-DATA-DEF-PROPS-VARIANTS", "SW-DATA-DEF-PROPS-CONDITIONAL"];

/// A signal with its position in a frame, before compilation.
pub(super) struct PlacedSignal<'d> {
    pub(super) element: Node<'d, 'd>,
    pub(super) name: &'d str,
    pub(super) layout: Layout,
    number: Number,
    scale: Scale,
    unit: String,
}

#[derive(Debug, Clone)]
struct Scale {
    factor: f64,
    offset: f64,
    values: Arc<[(i128, String)]>,
    /// Unit of the method itself.
    unit: Option<String>,
}

#[derive(Default)]
pub(super) struct Scales {
    known: HashMap<NodeId, Scale>,
    /// Number of texts of all methods.
    pub(super) texts: usize,
}

/// An unread property of a signal that is used nevertheless.
pub(super) type Omission = &'static str;

impl<'d> PlacedSignal<'d> {
    /// Reads the signal of a mapping, which begins `offset` bytes into the frame; `None` for a group of
    /// signals.
    pub(super) fn of_mapping(
        elements: &NamedElements<'d>,
        mapping: Node<'d, 'd>,
        offset: u16,
        scales: &mut Scales,
    ) -> Result<Option<(Self, Vec<Omission>)>, Unread> {
        if child(mapping, "I-SIGNAL-REF").is_none() {
            return Ok(None);
        }
        let element = elements.follow(mapping, "I-SIGNAL-REF").ok_or("I-SIGNAL-REF leads nowhere")?;
        let name = text_of(element, "SHORT-NAME").ok_or("without a SHORT-NAME")?;
        let start = whole_of::<u16>(mapping, "START-POSITION").ok_or("without a fixed START-POSITION")?;
        let length = whole_of::<u16>(element, "LENGTH").ok_or("without a LENGTH")?;
        let order = byte_order(mapping, "PACKING-BYTE-ORDER")?;
        let representation = descend(element, &["NETWORK-REPRESENTATION-PROPS"]);
        let representation = representation.and_then(|properties| descend(properties, &DATA_PROPERTIES));
        let base_type = representation.and_then(|properties| elements.follow(properties, "BASE-TYPE-REF"));
        let (signed, number) = number_format(base_type, length)?;
        let start = start.checked_add(8 * offset).ok_or("the start bit lies beyond every frame")?;
        let layout = Layout { start, length, order, signed };

        let system = elements.follow(element, "SYSTEM-SIGNAL-REF");
        let physical = system.and_then(|signal| child(signal, "PHYSICAL-PROPS"));
        let physical = physical.and_then(|properties| descend(properties, &DATA_PROPERTIES));
        let mut methods = [physical, representation].into_iter().flatten();
        let method = methods.find_map(|properties| elements.follow(properties, "COMPU-METHOD-REF"));
        let mut omissions = Vec::new();
        let scale =
            method.map_or_else(Scale::default, |method| scales.read(elements, method, &mut omissions));
        let own_unit = physical.and_then(|properties| unit(elements, properties));
        let unit = own_unit.or_else(|| scale.unit.clone()).unwrap_or_default();
        if child(mapping, "UPDATE-INDICATION-BIT-POSITION").is_some() {
            omissions.push("its update bit is not read");
        }
        Ok(Some((Self { element, name, layout, number, scale, unit }, omissions)))
    }

    pub(super) fn compiled(self, line: usize, codec: SignalCodec) -> Signal {
        let Scale { factor, offset, values, .. } = self.scale;
        let (name, number, unit) = (self.name.to_owned(), self.number, self.unit);
        Signal { name, other_name: None, line, codec, number, factor, offset, unit, values }
    }

    pub(super) fn values(&self) -> &[(i128, String)] {
        &self.scale.values
    }
}

/// Reads a byte order; the start of a big-endian signal is its most significant bit, as in a DBC.
pub(super) fn byte_order(element: Node<'_, '_>, key: &str) -> Result<ByteOrder, Unread> {
    match text_of(element, key) {
        Some("MOST-SIGNIFICANT-BYTE-FIRST") => Ok(ByteOrder::Motorola),
        Some("MOST-SIGNIFICANT-BYTE-LAST") | None => Ok(ByteOrder::Intel),
        Some(other) => Err(format!("{key} {other} cannot be read").into()),
    }
}

/// Returns for this base type and length whether the signal is signed, and its number format.
fn number_format(base_type: Option<Node<'_, '_>>, length: u16) -> Result<(bool, Number), Unread> {
    let encoding = base_type.map(|base_type| text_of(base_type, "BASE-TYPE-ENCODING"));
    match (encoding.flatten(), length) {
        (Some("2C"), _) => Ok((true, Number::Integer)),
        (Some("IEEE754"), 32) => Ok((false, Number::Float32)),
        (Some("IEEE754"), 64) => Ok((false, Number::Float64)),
        (Some("IEEE754"), bits) => {
            Err(format!("a floating-point number of {bits} bits cannot be read").into())
        }
        (Some(encoding @ ("1C" | "SM")), _) => {
            Err(format!("encoding {encoding} cannot be read, only two's complement").into())
        }
        (Some(_) | None, _) => Ok((false, Number::Integer)),
    }
}

/// Returns the unit below these properties or this method.
fn unit(elements: &NamedElements<'_>, referring: Node<'_, '_>) -> Option<String> {
    let unit = elements.at(text_of(referring, "UNIT-REF")?)?;
    text_of(unit, "DISPLAY-NAME").filter(|name| *name != "NoUnit").map(str::to_owned)
}

impl Default for Scale {
    fn default() -> Self {
        Self { factor: 1.0, offset: 0.0, values: Arc::default(), unit: None }
    }
}

impl Scales {
    fn read<'d>(
        &mut self,
        elements: &NamedElements<'d>,
        method: Node<'d, 'd>,
        omissions: &mut Vec<Omission>,
    ) -> Scale {
        if let Some(known) = self.known.get(&method.id()) {
            return known.clone();
        }
        let mut scale = Scale { unit: unit(elements, method), ..Scale::default() };
        let category = text_of(method, "CATEGORY").unwrap_or("IDENTICAL");
        let has_texts = matches!(category, "TEXTTABLE" | "SCALE_LINEAR_AND_TEXTTABLE");
        let is_linear = matches!(category, "LINEAR" | "SCALE_LINEAR_AND_TEXTTABLE");
        if !has_texts && !is_linear && category != "IDENTICAL" {
            omissions.push("only linear scaling and texts are read of its computation method");
        }
        let (mut values, mut segments) = (Vec::new(), 0);
        let scales =
            child(method, "COMPU-INTERNAL-TO-PHYS").map(|to| listed(to, "COMPU-SCALES", "COMPU-SCALE"));
        for part in scales.into_iter().flatten().filter(|_| has_texts || is_linear) {
            let text = descend(part, &["COMPU-CONST"]).and_then(|constant| text_of(constant, "VT"));
            if let Some(text) = text.filter(|_| has_texts) {
                let [lower, upper] =
                    ["LOWER-LIMIT", "UPPER-LIMIT"].map(|limit| text_of(part, limit).and_then(whole));
                match (lower.or(upper), upper.or(lower)) {
                    (Some(lower), Some(upper)) if lower == upper => values.push((lower, text.to_owned())),
                    _ => omissions.push("the text of a range of values is not read"),
                }
            } else if text.is_none() && is_linear {
                segments += 1;
                match linear(part) {
                    Some((factor, offset)) if segments == 1 => {
                        (scale.factor, scale.offset) = (factor, offset);
                    }
                    _ => omissions.push("scaling in several segments is not read"),
                }
            }
        }
        self.texts += values.len();
        scale.values = values.into();
        self.known.insert(method.id(), scale.clone());
        scale
    }
}

/// Returns factor and offset of a linear scale; `None` for any other rational function.
fn linear(scale: Node<'_, '_>) -> Option<(f64, f64)> {
    let Some(coefficients) = child(scale, "COMPU-RATIONAL-COEFFS") else { return Some((1.0, 0.0)) };
    let read = |list: &str| -> Option<Vec<f64>> {
        let values = child(coefficients, list)?.children().filter(Node::is_element).take(3);
        values.map(|value| number(value.text()?.trim())).collect()
    };
    let (numerator, denominator) = (read("COMPU-NUMERATOR")?, read("COMPU-DENOMINATOR")?);
    let ([offset, factor], [divisor]) = (numerator.as_slice(), denominator.as_slice()) else { return None };
    let (factor, offset) = (factor / divisor, offset / divisor);
    (factor.is_finite() && offset.is_finite()).then_some((factor, offset))
}
