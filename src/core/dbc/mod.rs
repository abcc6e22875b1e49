//! DBC text to a database, and compiled decoding.
//!
//! Real files are full of slips, and a strict reader would refuse half of them whole. Here every
//! statement stands for itself: one that cannot be read, or contradicts itself or another, is left
//! out with a [finding](model::Finding), and the rest stays usable. Nothing is guessed: a slip is
//! mended only where it leaves a single reading.
//!
//! [`parse`] goes through `statement` (cut), `grammar` (read, with `mend`), `outline` (messages and
//! loose remarks) and `join` (compile, with `multiplex`, and check).

pub mod codec;
mod finding;
mod grammar;
mod join;
mod mend;
pub mod model;
mod multiplex;
mod outline;
mod statement;

use std::borrow::Cow;

use encoding_rs::{UTF_8, WINDOWS_1252};

use model::Database;

/// Reads a DBC file; what cannot be used is among the findings.
///
/// The text is UTF-8 (a byte order mark is fine) or else Windows-1252, which is the format's
/// custom; lines end with LF, CRLF or CR.
pub fn parse(bytes: &[u8]) -> Database {
    let text = decoded(bytes);
    let text = if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n").into() } else { text };
    join::database(outline::read(&text))
}

fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    let (unmarked, _) = UTF_8.decode_with_bom_removal(bytes);
    match UTF_8.decode_without_bom_handling_and_without_replacement(bytes) {
        Some(_) => unmarked,
        None => WINDOWS_1252.decode_without_bom_handling(bytes).0,
    }
}
