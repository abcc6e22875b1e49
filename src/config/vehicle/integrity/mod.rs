//! What a message must prove: length, checksum, counter, E2E protection, and a window over the latest
//! frames.

pub(super) mod checksum;
pub(super) mod counter;
pub(super) mod e2e;
mod field;
pub(super) mod window;

use std::time::Duration;

use toml::Spanned;

use super::binder::Binder;
use crate::core::dbc::model::Message;
use crate::core::validation::integrity::{MessageIntegrity, Protection};
use checksum::{ChecksumFile, checksum};
use counter::{CounterFile, counter};
use e2e::{E2eFile, e2e};
use window::{WindowFile, window};

/// What a section asks a message to prove.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Asked<'f> {
    /// The only right length, bytes.
    pub(super) length: Option<&'f Spanned<usize>>,
    pub(super) checksum: Option<&'f Spanned<ChecksumFile>>,
    pub(super) counter: Option<&'f Spanned<CounterFile>>,
    pub(super) e2e: Option<&'f Spanned<E2eFile>>,
    pub(super) window: Option<&'f Spanned<WindowFile>>,
}

/// The checks for what is asked; `None` when nothing is, or when a problem was noted that leaves none.
pub(super) fn integrity(
    binder: &mut Binder<'_>,
    asked: &Asked<'_>,
    message: &Message,
    forget_after: Option<Duration>,
) -> Option<MessageIntegrity> {
    if let Some(length) = asked.length.filter(|length| !(1..=64).contains(length.get_ref())) {
        binder.refuse(length.span(), format!("no frame has {} bytes", length.get_ref()), "give 1 to 64");
    }
    let length = asked.length.map(|length| *length.get_ref());
    let fields = asked.checksum.is_some() || asked.counter.is_some();
    let checksum = asked.checksum.and_then(|file| checksum(binder, file, message));
    let counter = asked.counter.and_then(|file| counter(binder, file, message));
    let window = asked.window.and_then(|file| window(binder, file));
    let protection = match asked.e2e {
        Some(e2e) if fields => {
            let reason = "an E2E profile has its own checksum and counter";
            binder.refuse(e2e.span(), reason, "give `e2e`, or `checksum` and `counter`");
            return None;
        }
        Some(file) => e2e(binder, file, message.length)?,
        None if fields || length.is_some() => Protection::Fields { checksum, counter },
        None => {
            if let Some(window) = asked.window {
                let reason = "a window judges what checksum, counter or e2e found";
                binder.refuse(window.span(), reason, "give one of them, or remove it");
            }
            return None;
        }
    };
    Some(MessageIntegrity { length, protection, window, forget_after })
}
