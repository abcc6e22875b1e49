//! The recording formats, one in each file, and format recognition.
//!
//! `LINE_FORMATS` lists the line formats, `OBJECT_FORMATS` the binary formats, which are recognised by their
//! first bytes; a new format needs a file and a line there. The name of a file does not matter. The first
//! line claimed by a format decides; lines before it are read (and counted as bad) in that format. A file
//! without such a line at its beginning is refused with a description of its content.
//!
//! # Time
//! A format with a date gives absolute stamps. Writers record local time without its zone, so it is
//! interpreted as UTC: stamps of such a file are off by the writer's distance to UTC, which matters only
//! where the wall clock is read. A format with only offsets or a free counter gives stamps starting at the
//! epoch; a format without any time gives the epoch for every entry.
//!
//! # Interfaces
//! Formats that number their buses get the name `can` and the number as in the file: GVRET counts from 0,
//! Vector and PCAN from 1. Without a number the name is `can0`.

mod asc;
mod attack_csv;
mod bag;
mod blf;
mod busmaster;
mod cabana;
mod can_packet;
pub mod candump;
mod candump_stamps;
mod canedge;
mod canhacker;
mod capnp;
mod carbus;
mod crtd;
mod csv;
mod hcrl;
mod ixxat;
mod mcap;
mod mf4;
mod mf4_blocks;
mod mf4_channels;
mod mf4_data;
mod mf4_records;
mod openpilot;
mod pcap;
mod pcapng;
mod plain;
mod python_csv;
mod python_sqlite;
mod recorded_topics;
mod ros_frames;
mod ros_sqlite;
mod slcan;
mod sqlite;
mod sqlite_columns;
mod sqlite_file;
mod trc;
mod unrecognised;

use std::io;

pub use bag::open_messages;
pub use recorded_topics::{Choose, LoggedMessage, MessageReader, RecordedTopic, TopicChoice};
pub use ros_frames::received_frame;
pub(super) use sqlite::refuse_pending_rows;
pub use unrecognised::{Looks, known_magic};

use crate::format::{LineFormat, ObjectFormat, refused};

/// Line formats, in order of precedence.
const LINE_FORMATS: [LineFormat; 16] = [
    candump::FORMAT,
    candump::DIFFERENCES,
    asc::FORMAT,
    trc::FORMAT,
    csv::FORMAT,
    python_csv::FORMAT,
    attack_csv::FORMAT,
    busmaster::FORMAT,
    canhacker::FORMAT,
    crtd::FORMAT,
    plain::FORMAT,
    cabana::FORMAT,
    canedge::FORMAT,
    hcrl::FORMAT,
    slcan::FORMAT,
    ixxat::FORMAT,
];

/// Binary formats.
const OBJECT_FORMATS: [ObjectFormat; 8] = [
    blf::FORMAT,
    mcap::FORMAT,
    mf4::FORMAT,
    pcap::FORMAT,
    pcapng::FORMAT,
    sqlite::FORMAT,
    openpilot::FORMAT,
    carbus::FORMAT,
];

/// Returns true if a file that begins with `head` may be part of a bag in a folder.
pub(super) fn is_in_bags(head: &[u8]) -> bool {
    const TOPICS: &[u8] = b"CREATE TABLE topics";
    let has_topics = || head.windows(TOPICS.len()).any(|part| part == TOPICS);
    mcap::FORMAT.begins(head) || sqlite::FORMAT.begins(head) && has_topics()
}

/// Returns true if `head`, the first bytes of a file, belongs to a binary recording.
pub fn begins_like_binary(head: &[u8]) -> bool {
    OBJECT_FORMATS.iter().any(|format| format.begins(head))
}

/// Returns the names of all readable formats.
pub fn names() -> Vec<&'static str> {
    let lines = LINE_FORMATS.iter().map(|format| format.name);
    lines.chain(OBJECT_FORMATS.iter().map(|format| format.name)).collect()
}

#[derive(Clone, Copy)]
pub(super) enum Format {
    Lines(LineFormat),
    Objects(ObjectFormat),
}

/// Number of bytes used to recognise a format.
pub(super) const HEAD: usize = 4096;

const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

impl Format {
    /// Returns the format that the whole lines of `head` match; `None` also if more lines `may_follow` and
    /// decide.
    pub(super) fn of(head: &[u8], may_follow: bool) -> Option<Self> {
        if let Some(format) = OBJECT_FORMATS.into_iter().find(|format| format.begins(head)) {
            return Some(Self::Objects(format));
        }
        let lines = without_byte_order_mark(head).split_inclusive(|byte| *byte == b'\n');
        let lines = lines.filter(|line| line.ends_with(b"\n")).map(<[u8]>::trim_ascii);
        let (line, format) = lines.clone().find_map(|line| Some((line, Self::of_line(line)?)))?;
        if candump_stamps::difference(line).is_none() {
            return Some(format);
        }
        let format =
            if candump_stamps::are_differences(lines) { Self::Lines(candump::DIFFERENCES) } else { format };
        (!may_follow).then_some(format)
    }

    pub(super) fn of_line(line: &[u8]) -> Option<Self> {
        LINE_FORMATS.into_iter().find(|format| (format.claims)(line)).map(Self::Lines)
    }
}

/// Removes the byte order mark that some editors put before UTF-8.
pub(super) fn without_byte_order_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text)
}

/// Returns the error for a file that begins with `head` and matches no format.
pub(super) fn not_recognised(head: &[u8]) -> io::Error {
    let (mut reason, mut remedy) = ("the file is empty".to_owned(), String::new());
    if !head.is_empty() {
        let (looks, first) = unrecognised::looks_like(head);
        let formats =
            format!("these are read, plain or as gzip, bzip2, xz, zstd or lz4: {}", names().join(", "));
        remedy = match first {
            "" => formats,
            first => format!("{first}; {formats}"),
        };
        reason = format!("format not recognised: it looks like {looks}");
    }
    refused(reason, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::{Mark, testing};
    use proptest::prelude::*;

    #[test]
    fn each_format_is_recognised_by_its_first_line_with_a_mark() {
        for (head, format) in [
            ("(1.0) can0 123#\n", Some("candump (-L, -ta)")),
            (" (1.000000)  can0  123   [0]\n", Some("candump (-L, -ta)")),
            (
                " (000.000000)  can0  1   [0]\n (002.500000)  can0  1   [0]\n (002.400000)  can0  1   [0]\n",
                Some("candump -td"),
            ),
            (
                " (000.000000)  can0  1   [0]\n (002.500000)  can0  1   [0]\n (002.600000)  can0  1   [0]\n",
                Some("candump (-L, -ta)"),
            ),
            ("# (1.0) can0 link down\n", Some("candump (-L, -ta)")),
            ("Time   ID     DLC Data                    Comment\r\n", Some("CANHacker")),
            ("1542473901.020305 1R11 1A0 00\n", Some("CRTD")),
            ("1.0 CXX OVMS\n", Some("CRTD")),
            ("timestamp,arbitration_id,extended,remote,error,dlc,data\n", Some("python-can CSV")),
            ("Timestamp,Arbitration_ID,DLC,Data,Label\n", Some("data set CSV")),
            ("Number;Time\n1;1.250;1;Rx;DT;01A0;-;0\n", Some("PCAN TRC and PEAK-Converter CSV")),
            ("(see below) for more\n", None),
            ("# a comment\nkey = 1\n", None),
            ("1,2,3\n4,5,6\n", None),
            ("\u{FEFF};$FILEVERSION=2.1\r\n", Some("PCAN TRC and PEAK-Converter CSV")),
            ("cut off\n\n***BUSMASTER Ver 3.2.2***\n", Some("BUSMASTER")),
            ("Time Stamp,ID,Extended,Bus,LEN\n", Some("SavvyCAN or GVRET CSV")),
            ("date Mon Jan 1 00:00:00 2024\n", Some("Vector ASC")),
            ("820298   0x085: 7C 33\n", Some("serial sniffer")),
            ("01 00 00 03 50 05 00\n", Some("serial sniffer")),
            ("time,addr,bus,data\n", Some("cabana CSV")),
            ("TimestampEpoch;BusChannel;ID;IDE;DLC;DataLength;Dir;EDL;BRS;DataBytes\n", Some("CANedge CSV")),
            ("1478198376.389427,0316,2,05,21,R\n", Some("HCRL data set")),
            ("t1A020102\r\n", Some("slcan")),
            ("b1230\n", None),
            ("ASCII Trace IXXAT canAnalyser V2.8\n", Some("IXXAT CSV")),
            ("@ TEXT @ 2 @ 64 @", Some("CARBUS Analyzer trace")),
            ("LOGG", Some("Vector BLF")),
            ("\n\r\r\n", Some("pcapng")),
            ("SQLite format 3\0", Some("SQLite of python-can or rosbag2")),
            ("MDF     4.10", Some("ASAM MDF 4 (MF4)")),
            ("UnFinMF 4.11", Some("ASAM MDF 4 (MF4)")),
            ("(1.0) can0 123#", None),
            ("", None),
        ] {
            let name = Format::of(head.as_bytes(), false).map(|format| match format {
                Format::Lines(format) => format.name,
                Format::Objects(format) => format.name,
            });
            assert_eq!(name, format, "{head}");
        }
    }

    proptest! {
        #[test]
        fn any_lines_are_read_or_refused_in_every_format(
            lines in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..200), 0..10),
        ) {
            for format in LINE_FORMATS {
                let mut reader = format.usual_reader();
                for line in &lines {
                    let _outcome = reader.read(line);
                }
            }
        }

        #[test]
        fn any_bytes_are_read_or_refused_in_every_binary_format(
            bytes in proptest::collection::vec(any::<u8>(), 0..500),
        ) {
            for format in OBJECT_FORMATS {
                let magics = if let Mark::Magics(magics) = format.mark { magics } else { &[&b""[..]] };
                for magic in magics {
                    let _outcome = testing::objects(format, &[magic, &bytes[..]].concat());
                }
            }
        }

        /// Closer to lines of the formats than any bytes.
        #[test]
        fn lines_of_likely_fields_are_read_or_refused_in_every_format(
            lines in proptest::collection::vec(proptest::collection::vec(likely_field(), 0..14), 0..20),
            separator in prop::sample::select(vec![" ", ",", ":"]),
        ) {
            for format in LINE_FORMATS {
                let mut reader = format.usual_reader();
                for line in &lines {
                    let _outcome = reader.read(line.join(separator).as_bytes());
                }
            }
        }
    }

    fn likely_field() -> impl Strategy<Value = String> {
        #[rustfmt::skip]
        let fixed = prop::sample::select(vec![
            "date", "base", "hex", "dec", "timestamps", "relative", "Begin", "Triggerblock", "CANFD", "Rx",
            "Tx", "d", "r", "ErrorFrame", "1)", ";$STARTTIME=45860.70", ";$COLUMNS=N,O,T,I,d,l,D", "DT", "FD",
            "***DEC***", "***RELATIVE MODE***", "***START DATE AND TIME 1:1:2024 0:0:0:0***", "Time Stamp",
            "ID", "Extended", "Bus", "LEN", "D1", "true", "s", "x", "08", "00",
        ]);
        prop_oneof![
            fixed.prop_map(str::to_owned),
            any::<u64>().prop_map(|number| number.to_string()),
            (any::<u32>(), any::<u32>()).prop_map(|(a, b)| format!("{a}.{b}")),
            any::<u32>().prop_map(|number| format!("{number:X}")),
        ]
    }
}
