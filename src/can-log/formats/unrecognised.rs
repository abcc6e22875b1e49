//! Describes files that are not recordings.

use std::fmt::Write as _;

/// Likely kind of a file that is not a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Looks {
    /// Name of its kind with an article, e.g. `a zip archive`.
    pub name: &'static str,
    /// Remedy for the user; may be empty.
    pub remedy: &'static str,
}

const fn plain(name: &'static str) -> Looks {
    Looks { name, remedy: "" }
}

const UTF_16: Looks = Looks { name: "text in UTF-16", remedy: "save it as UTF-8" };

/// First bytes of files that are not recordings.
const MAGIC: [(&[u8], Looks); 21] = [
    (b"PK\x03\x04", plain("a zip archive")),
    (b"PK\x05\x06", plain("an empty zip archive")),
    (b"Rar!", plain("a RAR archive")),
    (b"7z\xBC\xAF\x27\x1C", plain("a 7z archive")),
    (b"\x1F\x9D", plain("a compress (.Z) file")),
    (b"\xFF\xFE", UTF_16),
    (b"\xFE\xFF", UTF_16),
    (
        b"version https://git-lfs.github.com/",
        Looks { name: "a pointer of Git LFS, not the file itself", remedy: "fetch it with git lfs pull" },
    ),
    (b"SQLite format 3\0", plain("an SQLite database")),
    (b"\x89PNG", plain("a picture (PNG)")),
    (b"\xFF\xD8\xFF", plain("a picture (JPEG)")),
    (b"GIF8", plain("a picture (GIF)")),
    (b"RIFF", plain("a picture, sound or film (RIFF)")),
    (b"<svg", plain("a picture (SVG)")),
    (b"%PDF", plain("a PDF document")),
    (b"<!DOCTYPE", plain("a web page")),
    (b"<html", plain("a web page")),
    (b"\x7FELF", plain("a program")),
    (b"\x89HDF", plain("an HDF5 file")),
    (b"#ROSBAG", plain("a ROS 1 bag")),
    (b"VERSION \"", plain("a DBC file, not a recording")),
];

const QUOTED: usize = 40;

/// Returns the kind of a file by its first bytes; `None` if they are unknown.
pub fn known_magic(head: &[u8]) -> Option<Looks> {
    let begin = head.trim_ascii_start();
    let starts = |magic: &[u8]| head.starts_with(magic) || magic[0] == b'<' && begin.starts_with(magic);
    let known = MAGIC.iter().find(|(magic, _)| starts(magic)).map(|(_, looks)| *looks);
    known.or_else(|| (head.get(257..262) == Some(b"ustar")).then_some(plain("a tar archive")))
}

/// Describes a file by its first bytes, e.g. `a zip archive`, or by its first line in quotes; also returns a
/// remedy, which may be empty.
pub(super) fn looks_like(head: &[u8]) -> (String, &'static str) {
    if let Some(Looks { name, remedy }) = known_magic(head) {
        return (name.to_owned(), remedy);
    }
    let begin = head.trim_ascii_start();
    // Half of the bytes of Latin text in UTF-16 are zero, and no text has a zero byte.
    let zeros = head.split(|byte| *byte == 0).count() - 1;
    let alternates = |first| head.iter().skip(first).step_by(2).filter(|byte| **byte == 0).count() == zeros;
    if zeros * 5 > head.len() * 2 && (alternates(0) || alternates(1)) {
        return (UTF_16.name.to_owned(), UTF_16.remedy);
    }
    let line = begin.split(|byte| *byte == b'\n').next().unwrap_or_default();
    match str::from_utf8(line) {
        Ok(line) if zeros == 0 && is_without_times(line) => {
            ("the output of candump without times".to_owned(), "record it with candump -L")
        }
        Ok(line)
            if zeros == 0
                && let Some(known) = known_line(line) =>
        {
            (known.name.to_owned(), known.remedy)
        }
        Ok(line) if zeros == 0 => (quoted(line.trim_end()), ""),
        _ => ("binary data".to_owned(), ""),
    }
}

/// Remedy for frames in an unsupported layout.
const AS_CANDUMP: &str = "write its frames as candump does, with a time each: (12.345678) can0 123#0102";

/// Recognises unsupported layouts of frames, by their first line.
fn known_line(line: &str) -> Option<Looks> {
    let line = line.trim();
    let frames = |name| Some(Looks { name, remedy: AS_CANDUMP });
    if line.starts_with("IDH:") && line.contains("IDL:") {
        return frames("frames as IDH and IDL (.dat), without reliable times");
    }
    if line.starts_with("Recv time") && line.contains("Packet num") {
        return frames("a log of the ArrowPoint CANbus tools, without a date");
    }
    let fields: Vec<_> =
        line.split([' ', '\t', ',', ';', '-', ':']).filter(|field| !field.is_empty()).collect();
    let is_hex = |text: &str| text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let [id, length, data] = fields[..] else { return None };
    let id = id.strip_prefix("0x").unwrap_or(id);
    let is_frame = is_hex(id) && (2..=8).contains(&id.len()) && is_hex(data);
    let is_frame = is_frame && length.parse() == Ok(data.len() / 2) && data.len().is_multiple_of(2);
    if is_frame { frames("frames as identifier, length and data, without times") } else { None }
}

/// Returns true for a line of candump without a time: `can0  123   [8]  01 02`, or `can0 123#0102`.
fn is_without_times(line: &str) -> bool {
    // Terminal colours may precede the interface, and three flags may follow it.
    let mut words = line.split_ascii_whitespace();
    let (Some(_), Some(first)) = (words.next(), words.next()) else { return false };
    let id = if matches!(first, "RX" | "TX") { words.nth(2).unwrap_or_default() } else { first };
    let is_hex = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    match id.split_once('#') {
        Some((id, data)) => is_hex(id) && (data.is_empty() || is_hex(data)) && words.next().is_none(),
        None => {
            is_hex(id) && words.next().is_some_and(|length| length.starts_with('[') && length.ends_with(']'))
        }
    }
}

fn quoted(line: &str) -> String {
    let mut text = "text that begins with \"".to_owned();
    for char in line.chars().take(QUOTED) {
        // Writing to a String cannot fail.
        let _ = if char.is_control() {
            write!(text, "{}", char.escape_default())
        } else {
            write!(text, "{char}")
        };
    }
    text + if line.chars().count() > QUOTED { "…\"" } else { "\"" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_often_taken_for_a_recording_is_named() {
        let utf16: Vec<u8> = "(1.0) can0 123#".encode_utf16().flat_map(u16::to_le_bytes).collect();
        let tar = [&[b'x'; 257][..], b"ustar"].concat();
        for (head, expected) in [
            (&b"PK\x03\x04rest"[..], "a zip archive"),
            (&[b"\xFF\xFE", &utf16[..]].concat(), "text in UTF-16"),
            (&utf16, "text in UTF-16"),
            (b"version https://git-lfs.github.com/spec/v1\n", "a pointer of Git LFS, not the file itself"),
            (b"SQLite format 3\0\x10", "an SQLite database"),
            (b"\x89PNG\r\n", "a picture (PNG)"),
            (b"\n <svg xmlns", "a picture (SVG)"),
            (b"VERSION \"\"\n", "a DBC file, not a recording"),
            (&tar, "a tar archive"),
            (b"\n  speed,\x1B[31mtime  \nmore", "text that begins with \"speed,\\u{1b}[31mtime\""),
            (b"  can0  123   [2]  01 02\n", "the output of candump without times"),
            (b"  can0  RX - -  123  [12]  01\n", "the output of candump without times"),
            (b"  \x1B[1m\x1B[34mcan0\x1B[0m  123   [0] \n", "the output of candump without times"),
            (b"can0 18FEF100#\n", "the output of candump without times"),
            (
                b"IDH: 07, IDL: 60, Len: 08, Data: 02 10 87 00 00 00 00 00 ,TS: 235180,BAUD: 1\n",
                "frames as IDH and IDL (.dat), without reliable times",
            ),
            (
                b"Recv time     , Packet num, ID        , flags, data\n",
                "a log of the ArrowPoint CANbus tools, without a date",
            ),
            (b"180 8 00005dc3d5003010\r\n", "frames as identifier, length and data, without times"),
            (b"0x180-2-5dc3\n", "frames as identifier, length and data, without times"),
            (b"180 7 00005dc3d5003010\n", "text that begins with \"180 7 00005dc3d5003010\""),
            (b"\x00\x01\xFF\xFE\xFD", "binary data"),
            (b"\xC3\x28", "binary data"),
        ] {
            assert_eq!(looks_like(head).0, expected, "{head:?}");
        }
        let long = "x".repeat(50);
        assert_eq!(looks_like(long.as_bytes()).0, format!("text that begins with \"{}…\"", &long[..40]));
    }
}
