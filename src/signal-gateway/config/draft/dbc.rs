//! The DBC of the discovered signals.

use std::fmt::Write as _;

use can_signal::can::CanId;
use can_signal::dbc::codec::{ByteOrder, Layout};

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct DraftMessage {
    pub(super) id: CanId,
    pub(super) name: String,
    pub(super) length: usize,
    /// Median period of the frames, ms; `None` if it is not regular.
    pub(super) cycle_ms: Option<u32>,
    pub(super) signals: Vec<DraftSignal>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct DraftSignal {
    pub(super) name: &'static str,
    pub(super) layout: Layout,
    pub(super) values: Vec<(u64, &'static str)>,
}

pub(super) fn dbc_text(messages: &[DraftMessage]) -> String {
    let mut text = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: Vehicle\n".to_owned();
    // Writing to a String cannot fail.
    for message in messages {
        let _ = write!(text, "\nBO_ {} {}: {} Vehicle\n", number(message.id), message.name, message.length);
        for DraftSignal { name, layout, .. } in &message.signals {
            let order = u8::from(layout.order == ByteOrder::Intel);
            let highest = u64::MAX >> (64 - u32::from(layout.length.clamp(1, 64)));
            let Layout { start, length, .. } = layout;
            let _ = writeln!(
                text,
                " SG_ {name} : {start}|{length}@{order}+ (1,0) [0|{highest}] \"\" Vector__XXX"
            );
        }
    }
    text += "\nBA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\nBA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n";
    for message in messages {
        if let Some(cycle) = message.cycle_ms {
            let _ = writeln!(text, "BA_ \"GenMsgCycleTime\" BO_ {} {cycle};", number(message.id));
        }
    }
    for message in messages {
        for signal in message.signals.iter().filter(|signal| !signal.values.is_empty()) {
            let values: String =
                signal.values.iter().map(|(value, name)| format!("{value} \"{name}\" ")).collect();
            let _ = writeln!(text, "VAL_ {} {} {values};", number(message.id), signal.name);
        }
    }
    text
}

/// Returns the identifier in DBC notation: the highest bit marks a 29-bit identifier.
fn number(id: CanId) -> u32 {
    match id {
        CanId::Standard(id) => id.into(),
        CanId::Extended(id) => id | 0x8000_0000,
    }
}
