//! ASAM MDF 4 with CAN bus logging, as written by the tools of Vector, `CANedge`, `asammdf` and python-can.
//!
//! A data group (`DG`) has one stream of records; if they belong to several channel groups (`CG`), each
//! record begins with the number of its group. The records of a channel group with a channel `CAN_DataFrame`,
//! `CAN_RemoteFrame` or `CAN_ErrorFrame` are frames. Groups are merged by time, even if a logger wrote the
//! frames of one bus together. A file that its writer did not finish (`UnFinMF`) is read as it is: record
//! counts are ignored, and the last data block extends to the end of the file.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};

use super::mf4_blocks::Blocks;
use super::mf4_records::{DataGroup, Entry};
use crate::format::{Mark, ObjectFormat, ObjectReader, ObjectSource, Outcome, refused};
use crate::little_endian::u64_at;

pub(super) const FORMAT: ObjectFormat = ObjectFormat {
    name: "ASAM MDF 4 (MF4)",
    mark: Mark::Magics(&[b"MDF     ", b"UnFinMF "]),
    reader: |source| Ok(Box::new(Mf4::new(source)?)),
};

struct Mf4 {
    file: Blocks,
    groups: Vec<DataGroup>,
    /// The next entries of the groups, ordered by time and position of the group.
    queue: BTreeMap<(Option<i64>, usize), Entry>,
    /// Reason why the rest cannot be read.
    failure: Option<io::Error>,
}

impl Mf4 {
    fn new(source: ObjectSource) -> io::Result<Self> {
        let file = Blocks::read(source)?;
        let header = file.header()?;
        let start = i64::try_from(u64_at(header.data, 0)).unwrap_or(0);
        let (mut groups, mut failure) = (Vec::new(), None);
        let mut next = header.link(0);
        while let Some(link) = next.take() {
            match DataGroup::of(&file, link, start) {
                Ok((group, behind)) => {
                    groups.extend(group);
                    next = behind;
                }
                Err(error) => failure = Some(error),
            }
        }
        if groups.is_empty() {
            return Err(match failure {
                None => refused(
                    "the MDF file has no frames of a CAN bus (CAN_DataFrame), only signals or other buses",
                    "record the traffic of the bus, not decoded signals",
                ),
                Some(error) if error.kind() == ErrorKind::UnexpectedEof => refused(
                    "the MDF file was cut, and its descriptions of the data, which stand behind the data, are lost",
                    "copy the whole file again; a logger that writes descriptions first, as a CANedge does, loses only the end",
                ),
                Some(error) => error,
            });
        }
        let mut this = Self { file, groups, queue: BTreeMap::new(), failure };
        (0..this.groups.len()).for_each(|position| this.advance(position));
        Ok(this)
    }

    /// Reads the next entry of a group and queues it.
    fn advance(&mut self, position: usize) {
        match self.groups[position].next(&self.file) {
            Ok(Some((nanos, entry))) => {
                self.queue.insert((nanos, position), entry);
            }
            Ok(None) => {}
            Err(error) => self.failure = self.failure.take().or(Some(error)),
        }
    }
}

impl ObjectReader for Mf4 {
    fn next_object(&mut self) -> io::Result<Option<Outcome<'_>>> {
        let Some(((_, position), entry)) = self.queue.pop_first() else {
            return self.failure.take().map_or(Ok(None), Err);
        };
        self.advance(position);
        Ok(Some(entry.map(Some)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entry::BadLine;
    use crate::format::testing::{
        assert_parts_give_the_beginning, assert_survives_damage, objects, until_failure,
    };
    use flate2::Compression;
    use flate2::write::ZlibEncoder;
    use proptest::prelude::*;
    use std::io::Write;

    /// Writes blocks one after the other.
    struct Writer(Vec<u8>);

    impl Writer {
        /// Begins a file whose measurement started 1 s after 1970.
        fn new(magic: &str) -> Self {
            let mut this = Self(magic.as_bytes().to_vec());
            this.0.resize(64, 0);
            let start = [1_000_000_000_u64.to_le_bytes().to_vec(), vec![0; 24]].concat();
            this.block("HD", &[0; 6], &start);
            this
        }

        fn block(&mut self, kind: &str, links: &[u64], data: &[u8]) -> u64 {
            self.0.resize(self.0.len().next_multiple_of(8), 0);
            let at = self.0.len() as u64;
            let length = 24 + 8 * links.len() + data.len();
            self.0.extend([&b"##"[..], kind.as_bytes(), &[0; 4]].concat());
            self.0.extend((length as u64).to_le_bytes());
            self.0.extend((links.len() as u64).to_le_bytes());
            self.0.extend(links.iter().flat_map(|link| link.to_le_bytes()));
            self.0.extend(data);
            at
        }

        fn set_link(&mut self, block: u64, index: usize, to: u64) {
            let at = usize::try_from(block).unwrap() + 24 + 8 * index;
            self.0[at..at + 8].copy_from_slice(&to.to_le_bytes());
        }

        fn conversion(&mut self, kind: u8, values: &[f64]) -> u64 {
            let count = u16::try_from(values.len()).unwrap();
            let mut data = vec![kind, 0, 0, 0, 0, 0];
            data.extend(count.to_le_bytes());
            data.extend([0; 16]);
            data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            self.block("CC", &[0; 4], &data)
        }

        /// Writes a channel; `layout` is its kind, type, first bit, first byte and number of bits.
        fn channel(&mut self, next: u64, name: &str, layout: [u8; 5], conversion: u64, values: u64) -> u64 {
            let name = self.block("TX", &[], &[name.as_bytes(), &[0]].concat());
            let [kind, data_type, bit, byte, bits] = layout;
            let mut data = vec![kind, u8::from(kind == 2), data_type, bit, byte, 0, 0, 0, bits, 0, 0, 0];
            data.resize(72, 0);
            self.block("CN", &[next, 0, name, 0, conversion, values, 0, 0], &data)
        }

        fn group(&mut self, next: u64, channels: u64, number: u64, flags: u8, length: u8) -> u64 {
            let mut data = [number.to_le_bytes(), [0; 8], [flags, 0, 0, 0, 0, 0, 0, 0]].concat();
            data.extend([length, 0, 0, 0, 0, 0, 0, 0]);
            self.block("CG", &[next, channels, 0, 0, 0, 0], &data)
        }

        /// Appends a data group, and links it from `before`, or from the header.
        fn data_group(&mut self, before: Option<u64>, groups: u64, number_length: u8) -> u64 {
            let at = self.block("DG", &[0, groups, 0, 0], &[number_length, 0, 0, 0, 0, 0, 0, 0]);
            self.set_link(before.unwrap_or(64), 0, at);
            at
        }
    }

    /// A file like a `CANedge` writes: groups in one stream, constants as virtual channels, lengths from a
    /// table, and data of variable length.
    fn unsorted(records: &[u8]) -> Vec<u8> {
        let mut file = Writer::new("UnFinMF 4.11    ");
        let time = file.conversion(1, &[0.0, 1e-6]);
        let lengths = file.conversion(5, &[8.0, 8.0, 9.0, 12.0, 10.0, 16.0]);
        let [zero, one, nine] = [0.0, 1.0, 9.0].map(|value| file.conversion(1, &[value, 0.0]));
        let values = file.group(0, 0, 3, 1, 0);
        let mut groups = values;
        for (number, frame, fd, kind, bits) in [
            (1, "CAN_DataFrame", zero, 0, 64),
            (2, "CAN_DataFrame", one, 1, 32),
            (4, "CAN_RemoteFrame", zero, 0, 64),
        ] {
            let link = if kind == 1 { values } else { 0 };
            let mut channel = file.channel(0, &format!("{frame}.DataBytes"), [kind, 10, 0, 9, bits], 0, link);
            for (part, layout, conversion) in [
                (".DataLength", [0, 0, 0, 8, 4], lengths),
                (".IDE", [0, 0, 7, 7, 1], 0),
                (".ID", [0, 0, 0, 4, 29], 0),
                (".EDL", [6, 0, 0, 0, 0], fd),
                (".BusChannel", [6, 0, 0, 0, 0], nine),
                ("", [0, 10, 0, 4, 104], 0),
            ] {
                channel = file.channel(channel, &format!("{frame}{part}"), layout, conversion, 0);
            }
            let time = file.channel(channel, "Timestamp", [2, 0, 0, 0, 32], time, 0);
            groups = file.group(groups, time, number, 0, if kind == 1 { 13 } else { 17 });
        }
        let group = file.data_group(None, groups, 1);
        let data = file.block("DT", &[], &[]);
        file.set_link(group, 2, data);
        [&file.0, records].concat()
    }

    fn record(number: u8, micros: u32, id: u32, dlc: u8, data: &[u8]) -> Vec<u8> {
        [&[number][..], &micros.to_le_bytes(), &id.to_le_bytes(), &[dlc], data].concat()
    }

    /// A record of each group; the values of variable length come after the frames that refer to them.
    fn records() -> Vec<u8> {
        let value = |data: &[u8]| [&[3, u8::try_from(data.len()).unwrap(), 0, 0, 0][..], data].concat();
        [
            record(1, 250, 0x123, 8, &[1; 8]),
            record(2, 300, 0x98FE_F100, 9, &[0; 4]),
            value(&[7; 12]),
            record(4, 350, 0x124, 0, &[0; 8]),
            record(2, 400, 0x125, 10, &[16, 0, 0, 0]),
            value(&[8; 16]),
            record(1, 450, 0x800, 8, &[1; 8]),
            record(1, 500, 0x123, 7, &[1; 8]),
            record(1, 550, 0x126, 8, &[2; 8]),
            record(1, 275, 0x127, 8, &[3; 8]),
        ]
        .concat()
    }

    /// In the order of their times, after the unreadable entries.
    const EXPECTED: [Result<&str, BadLine>; 8] = [
        Err(BadLine::BadId),
        Err(BadLine::BadLength),
        Ok("1000250 can9 123#0101010101010101"),
        Ok("1000275 can9 127#0303030303030303"),
        Ok("1000300 can9 18FEF100##0070707070707070707070707"),
        Ok("1000350 can9 Remote"),
        Ok("1000400 can9 125##008080808080808080808080808080808"),
        Ok("1000550 can9 126#0202020202020202"),
    ];

    fn shown(entries: &[Result<&str, BadLine>]) -> Vec<Result<String, BadLine>> {
        entries.iter().map(|entry| entry.map(str::to_owned)).collect()
    }

    #[test]
    fn groups_that_share_a_stream_are_read_from_a_file_without_an_end() {
        assert_eq!(objects(FORMAT, &unsorted(&records())).unwrap(), shown(&EXPECTED));
    }

    #[test]
    fn a_cut_file_gives_the_whole_records_before_the_cut() {
        let whole = unsorted(&records());
        let failure = |(entries, outcome): (_, io::Result<()>)| (entries, outcome.unwrap_err().kind());
        assert_eq!(
            failure(until_failure(FORMAT, &whole[..whole.len() - 1])),
            (shown(&[&EXPECTED[..3], &EXPECTED[4..]].concat()), ErrorKind::UnexpectedEof)
        );
        let unknown = unsorted(&[records(), vec![9, 1, 2, 3]].concat());
        assert_eq!(failure(until_failure(FORMAT, &unknown)), (shown(&EXPECTED), ErrorKind::InvalidData));
        let records = |micros: u32| match micros % 3 {
            0 => record(1, micros, 0x123, 8, &micros.to_le_bytes().repeat(2)),
            1 => record(2, micros, 0x123, 9, &[0; 4]),
            _ => record(4, micros, 0x124, 0, &[0; 8]),
        };
        let records: Vec<u8> = (0..3000).flat_map(records).collect();
        let length = vec![3, 12, 0, 0, 0];
        let values = [length, vec![7; 12]].concat();
        let head = unsorted(&values).len();
        assert_parts_give_the_beginning(FORMAT, &unsorted(&[values, records].concat()), head, 2);
    }

    fn packed(of: &str, columns: Option<usize>, content: &[u8]) -> Vec<u8> {
        let mut packer = ZlibEncoder::new(Vec::new(), Compression::default());
        let width = columns.unwrap_or(1);
        let table = content.len() / width * width;
        let transposed: Vec<u8> = (0..width)
            .flat_map(|column| content[..table].iter().skip(column).step_by(width))
            .copied()
            .collect();
        packer.write_all(&transposed).unwrap();
        packer.write_all(&content[table..]).unwrap();
        let packed = packer.finish().unwrap();
        let mut head = [of.as_bytes(), &[u8::from(columns.is_some()), 0]].concat();
        head.extend(u32::try_from(width).unwrap().to_le_bytes());
        head.extend((content.len() as u64).to_le_bytes());
        head.extend((packed.len() as u64).to_le_bytes());
        [head, packed].concat()
    }

    /// A file like asammdf writes: a data group for each kind of frame, merged by time, in lists of plain and
    /// packed blocks.
    fn sorted() -> Vec<u8> {
        let mut file = Writer::new("MDF     4.10    ");
        let mut before = None;
        for (part, frame) in [(0, "CAN_DataFrame"), (1, "CAN_ErrorFrame")] {
            let mut channel = file.channel(0, &format!("{frame}.DataBytes"), [0, 10, 0, 12, 16], 0, 0);
            for (name, layout) in
                [(".DLC", [0, 0, 4, 11, 4]), (".ID", [0, 1, 0, 8, 24]), ("", [0, 10, 0, 8, 48])]
            {
                channel = file.channel(channel, &format!("{frame}{name}"), layout, 0, 0);
            }
            let time = file.channel(channel, "t", [2, 4, 0, 0, 64], 0, 0);
            let group = file.group(0, time, 0, 0, 14);
            let at = file.data_group(before, group, 0);
            before = Some(at);
            let records: Vec<u8> = (0..4_u8)
                .flat_map(|index| {
                    let time = f64::from(index) + f64::from(part) / 2.0;
                    [&time.to_le_bytes()[..], &[0, 1, index], &[2 << 4], &[index, 0xAA]].concat()
                })
                .collect();
            // Blocks end within records.
            let first = file.block("DT", &[], &records[..20]);
            let second = file.block("DZ", &[], &packed("DT", None, &records[20..30]));
            let third = file.block("DZ", &[], &packed("DT", Some(3), &records[30..]));
            let rest = file.block("DL", &[0, third], &[0; 8]);
            let list = file.block("DL", &[rest, first, second], &[0; 8]);
            let data = if part == 0 { file.block("HL", &[list], &[0; 8]) } else { list };
            file.set_link(at, 2, data);
        }
        file.0
    }

    #[test]
    fn sorted_groups_are_merged_by_time_out_of_lists_of_packed_blocks() {
        let error = "can0 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })";
        let expected: Vec<_> = (0..4)
            .flat_map(|index| {
                let frame = format!("{} can0 10{index}#0{index}AA", 1_000_000 * (index + 1));
                [Ok(frame), Ok(format!("{} {error}", 1_000_000 * (index + 1) + 500_000))]
            })
            .collect();
        assert_eq!(objects(FORMAT, &sorted()).unwrap(), expected);
    }

    #[test]
    fn files_without_frames_and_of_other_versions_are_refused() {
        let mut other = unsorted(&records());
        let names: Vec<_> =
            other.windows(4).enumerate().filter(|(_, part)| part == b"CAN_").map(|(at, _)| at).collect();
        for at in names {
            other[at..at + 3].copy_from_slice(b"LIN");
        }
        let refusal = |file: &[u8]| objects(FORMAT, file).unwrap_err().to_string();
        assert!(refusal(&other).contains("no frames of a CAN bus"), "{}", refusal(&other));
        let cut = refusal(&sorted()[..200]);
        assert!(cut.contains("its descriptions of the data, which stand behind the data, are lost"), "{cut}");
        let old = [&b"MDF     3.30    "[..], &[0; 60]].concat();
        assert!(refusal(&old).contains("MDF 3.30 is not supported"), "{}", refusal(&old));
    }

    proptest! {
        #[test]
        fn damaged_files_are_read_to_their_end(damage in proptest::collection::vec((any::<usize>(), any::<u8>()), 0..20)) {
            for file in [unsorted(&records()), sorted()] {
                assert_survives_damage(FORMAT, file, &damage);
            }
        }

        /// Links that lead to any block, also in circles.
        #[test]
        fn any_links_end(links in proptest::collection::vec((any::<usize>(), any::<usize>()), 1..10)) {
            for mut file in [unsorted(&records()), sorted()] {
                let blocks: Vec<_> = file.windows(2).enumerate().filter(|(at, part)| at % 8 == 0 && part == b"##").map(|(at, _)| at).collect();
                for (from, to) in &links {
                    let at = blocks[from % blocks.len()] + 24 + 8 * (to % 3);
                    if let Some(link) = file.get_mut(at..at + 8) {
                        link.copy_from_slice(&(blocks[to % blocks.len()] as u64).to_le_bytes());
                    }
                }
                let _outcome = objects(FORMAT, &file);
            }
        }
    }
}
