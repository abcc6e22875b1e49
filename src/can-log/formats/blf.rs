//! Vector BLF: objects in compressed containers.
//!
//! A file begins with `LOGG`, its size and the start of the measurement. Objects follow, each `LOBJ`, sizes
//! and a type; most are containers of further objects, packed with zlib or stored, and an object may begin in
//! one container and end in the next. This reader concatenates the containers' contents to one stream, so it
//! needs memory for only one container (at most [`MAX_BYTES`]), whatever the file's size.
//!
//! It reads CAN messages (types 1 and 86), CAN FD messages (100 and 101) and error frames (2, 73
//! and 104), and skips other objects. An object that cannot be read counts as a bad line, and
//! reading continues at the next `LOBJ`.

use std::io::{self, BufRead, BufReader, Cursor, ErrorKind, Read};

use flate2::read::ZlibDecoder;

use crate::clock::{DAY, days, nanos};
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::exact::{append, skip};
use crate::fields::{bus_error, data_frame, id, length_of_dlc};
use crate::file_budget::Kept;
use crate::format::{Mark, ObjectFormat, ObjectReader, ObjectSource, Outcome};
use crate::little_endian::{u16_at, u32_at, u64_at};
use can_signal::can::MAX_DATA;

/// Largest valid size, bytes. Writers fill containers with 128 KiB, unpacked.
const MAX_BYTES: u32 = 16 << 20;

const MAGIC: [u8; 4] = *b"LOBJ";
const CONTAINER: u32 = 10;
/// Length of the head of all objects: magic, size of the header, its version, size, type.
const BASE: usize = 16;
/// Length of the header of a frame: head, flags, time.
const HEADER: usize = 32;
/// Cost of a byte of a container, to unpack it and search it for an object, nominal ns.
const UNPACKED_WORK: u64 = 8;
/// Maximum number of bytes read from an object, enough for a header and a CAN FD message.
const MAX_READ: usize = 256;

pub(super) const FORMAT: ObjectFormat = ObjectFormat {
    name: "Vector BLF",
    mark: Mark::Magics(&[b"LOGG"]),
    reader: |source| Ok(Box::new(Blf::new(source)?)),
};

/// Reads a BLF file.
struct Blf {
    objects: BufReader<ContainerContents>,
    start: i64,
}

impl Blf {
    /// Reads the head of the file. Fails if the source fails or ends within it.
    fn new(mut source: ObjectSource) -> io::Result<Self> {
        let mut head = [0; 56];
        source.read_exact(&mut head)?;
        let size = u64::from(u32_at(&head, 4));
        skip(&mut source, size.saturating_sub(56))?;
        let start = system_time(&head[40..]).unwrap_or(0);
        let kept = source.budget.keep();
        let contents = ContainerContents { source, inside: Inside::Nothing, kept };
        Ok(Self { objects: BufReader::new(contents), start })
    }

    fn read_object(&mut self) -> io::Result<Option<Outcome<'static>>> {
        let mut object = [0; MAX_READ];
        let Some(skipped) = find_magic(&mut self.objects)? else { return Ok(None) };
        self.objects.read_exact(&mut object[4..BASE])?;
        let size = u32_at(&object, 8);
        let read = usize::try_from(size).unwrap_or(MAX_READ).min(MAX_READ);
        if read < BASE || size > MAX_BYTES {
            return Ok(Some(Err(BadLine::BadLength)));
        }
        self.objects.read_exact(&mut object[BASE..read])?;
        skip(&mut self.objects, u64::from(size) - read as u64)?;
        if skipped > 0 {
            // The bytes in between were a damaged object.
            return Ok(Some(Err(BadLine::NoFrame)));
        }
        Ok(Some(parse_object(&object[..read], self.start)))
    }
}

impl ObjectReader for Blf {
    fn next_object(&mut self) -> io::Result<Option<Outcome<'_>>> {
        match self.read_object() {
            // A container that cannot be unpacked is reported instead of its objects. A failing source
            // returns errors of other kinds.
            Err(error) if error.kind() == ErrorKind::InvalidData => Ok(Some(Err(BadLine::BadData))),
            outcome => outcome,
        }
    }
}

/// Parses one object that starts with `LOBJ`; `start` is the start of the measurement, ns since 1970.
fn parse_object(object: &[u8], start: i64) -> Outcome<'static> {
    let kind = if object.len() < BASE { 0 } else { u32_at(object, 12) };
    if !matches!(kind, 1 | 2 | 73 | 86 | 100 | 101 | 104) {
        return Ok(None);
    }
    let header = object.get(..HEADER).ok_or(BadLine::BadLength)?;
    // The unit is 10 µs or 1 ns.
    let unit = if u32_at(header, 16) == 1 { 10_000 } else { 1 };
    let nanos = i64::try_from(u64_at(header, 24))
        .ok()
        .and_then(|time| time.checked_mul(unit))
        .ok_or(BadLine::NoTime)?;
    let data = object.get(usize::from(u16_at(object, 4)).max(HEADER)..).unwrap_or_default();
    let (channel, content) = match kind {
        1 | 86 => message(data),
        100 => fd_message(data),
        101 => fd_message_64(data),
        104 => data.first().map(|channel| (u32::from(*channel), Ok(bus_error()))),
        _ => data.get(..2).map(|data| (u16_at(data, 0).into(), Ok(bus_error()))),
    }
    .ok_or(BadLine::BadLength)?;
    Ok(Some(LogEntry::numbered(start.saturating_add(nanos), channel, content?)))
}

type ChannelContent = Option<(u32, Result<EntryContent, BadLine>)>;

fn message(data: &[u8]) -> ChannelContent {
    let data = data.get(..16)?;
    let content = if data[2] & 0x80 != 0 {
        Ok(EntryContent::Remote)
    } else {
        // A DLC above 8 is sent unchanged, but the frame still has 8 bytes.
        frame(u32_at(data, 4), false, usize::from(data[3]).min(8), &data[8..])
    };
    Some((u16_at(data, 0).into(), content))
}

fn fd_message(data: &[u8]) -> ChannelContent {
    let fixed = data.get(..20)?;
    let content = if fixed[2] & 0x80 != 0 {
        Ok(EntryContent::Remote)
    } else {
        frame(u32_at(fixed, 4), fixed[13] & 1 != 0, usize::from(fixed[14]), &data[20..])
    };
    Some((u16_at(fixed, 0).into(), content))
}

fn fd_message_64(data: &[u8]) -> ChannelContent {
    let fixed = data.get(..40)?;
    let flags = u32_at(fixed, 12);
    let content = if flags & 0x10 != 0 {
        Ok(EntryContent::Remote)
    } else {
        // Bytes within the frame's length that are missing in the file are zero.
        let mut bytes = [0; MAX_DATA];
        let written = usize::from(fixed[2]).min(MAX_DATA).min(data.len() - 40);
        bytes[..written].copy_from_slice(&data[40..40 + written]);
        let fd = flags & 0x1000 != 0;
        let length = length_of_dlc(fixed[1].into(), fd);
        length.ok_or(BadLine::BadLength).and_then(|length| frame(u32_at(fixed, 4), fd, length, &bytes))
    };
    Some((fixed[0].into(), content))
}

fn frame(number: u32, fd: bool, length: usize, bytes: &[u8]) -> Result<EntryContent, BadLine> {
    // Bit 31 is set for 29-bit identifiers.
    let id = id(number & !(1 << 31), number >> 31 == 1)?;
    data_frame(id, fd, bytes.get(..length).ok_or(BadLine::BadLength)?)
}

/// The contents of containers, and objects outside of containers, as one stream.
struct ContainerContents {
    source: ObjectSource,
    inside: Inside,
    /// The packed bytes of a container.
    kept: Kept,
}

enum Inside {
    Nothing,
    /// The number of bytes to copy from the file.
    Stored(u64),
    Packed(ZlibDecoder<Cursor<Vec<u8>>>),
    /// The head of an object outside of containers, and the number of its bytes already copied.
    Base([u8; BASE], usize),
}

impl Read for ContainerContents {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let read = match &mut self.inside {
                Inside::Nothing => 0,
                Inside::Stored(left) => {
                    let read = (&mut self.source).take(*left).read(buffer)?;
                    if read == 0 && *left > 0 && !buffer.is_empty() {
                        return Err(ErrorKind::UnexpectedEof.into());
                    }
                    *left -= read as u64;
                    read
                }
                Inside::Packed(unpacker) => {
                    let Ok(read) = unpacker.read(buffer) else {
                        self.inside = Inside::Nothing;
                        return Err(ErrorKind::InvalidData.into());
                    };
                    self.source.budget.spend(read as u64 * UNPACKED_WORK)?;
                    read
                }
                Inside::Base(base, done) => {
                    let read = (&base[*done..]).read(buffer)?;
                    *done += read;
                    if *done == BASE {
                        let size = Some(u32_at(base, 8)).filter(|size| *size <= MAX_BYTES).unwrap_or(0);
                        self.inside = Inside::Stored(u64::from(size).saturating_sub(BASE as u64));
                    }
                    read
                }
            };
            if read > 0 || buffer.is_empty() {
                return Ok(read);
            }
            if !self.enter()? {
                return Ok(0);
            }
        }
    }
}

impl ContainerContents {
    /// Enters the next container or object; returns false at the end of the file.
    fn enter(&mut self) -> io::Result<bool> {
        self.inside = Inside::Nothing;
        if find_magic(&mut self.source)?.is_none() {
            return Ok(false);
        }
        let mut base = [0; BASE];
        base[..4].copy_from_slice(&MAGIC);
        self.source.read_exact(&mut base[4..])?;
        let size = u32_at(&base, 8);
        if u32_at(&base, 12) != CONTAINER {
            self.inside = Inside::Base(base, 0);
            return Ok(true);
        }
        let mut container = [0; 16];
        self.source.read_exact(&mut container)?;
        // A damaged size must not cause the following data to be skipped.
        let packed =
            size.checked_sub(32).filter(|packed| *packed <= MAX_BYTES).ok_or(ErrorKind::InvalidData)?;
        match u16_at(&container, 0) {
            0 => self.inside = Inside::Stored(packed.into()),
            2 => {
                let mut bytes = Vec::new();
                append(&mut self.source, packed.into(), &mut bytes, &mut self.kept)?;
                self.inside = Inside::Packed(ZlibDecoder::new(Cursor::new(bytes)));
            }
            _ => {
                skip(&mut self.source, packed.into())?;
                return Err(ErrorKind::InvalidData.into());
            }
        }
        Ok(true)
    }
}

/// Reads to the end of the next `LOBJ` and returns the number of bytes before it, without the writers'
/// padding. Returns `None` at the end of the source.
fn find_magic(source: &mut impl BufRead) -> io::Result<Option<u64>> {
    const PADDING: u64 = 3;
    let (mut window, mut read) = ([0; 4], 0_u64);
    loop {
        let Some(byte) = source.fill_buf()?.first().copied() else { return Ok(None) };
        source.consume(1);
        window.rotate_left(1);
        window[3] = byte;
        read += 1;
        if window == MAGIC {
            return Ok(Some((read - 4).saturating_sub(PADDING)));
        }
    }
}

/// Parses Windows' `SYSTEMTIME`: eight 16-bit numbers, of which the third is the day of the week.
fn system_time(bytes: &[u8]) -> Option<i64> {
    let part = |index: usize| u16_at(bytes, 2 * index);
    let date = days(part(0).into(), part(1).into(), part(3).into());
    let [hours, minutes, seconds, millis] = [4, 5, 6, 7].map(|index| i64::from(part(index)));
    let millis = ((hours * 60 + minutes) * 60 + seconds) * 1000 + millis;
    nanos(date, Some(millis * 1_000_000).filter(|time| *time < DAY))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{shown, source};
    use flate2::Compression;
    use flate2::write::ZlibEncoder;
    use proptest::prelude::*;
    use std::io::Write;

    /// 2024-03-05 14:30:00.250, a Tuesday.
    const START: [u16; 8] = [2024, 3, 2, 5, 14, 30, 0, 250];
    const START_MICROS: i64 = 1_709_649_000_250_000;

    fn object(kind: u32, unit: u32, time: u64, data: &[u8]) -> Vec<u8> {
        let mut object = MAGIC.to_vec();
        object.extend([32, 0, 1, 0]);
        object.extend(u32::try_from(HEADER + data.len()).unwrap().to_le_bytes());
        object.extend(kind.to_le_bytes());
        object.extend(unit.to_le_bytes());
        object.extend([0; 4]);
        object.extend(time.to_le_bytes());
        object.extend(data);
        object
    }

    fn can_message(channel: u8, flags: u8, dlc: u8, id: u32, data: [u8; 8]) -> Vec<u8> {
        [&[channel, 0, flags, dlc][..], &id.to_le_bytes(), &data].concat()
    }

    fn container(method: u8, content: &[u8]) -> Vec<u8> {
        let mut packer = ZlibEncoder::new(Vec::new(), Compression::default());
        packer.write_all(content).unwrap();
        let content = if method == 2 { packer.finish().unwrap() } else { content.to_vec() };
        let mut container = MAGIC.to_vec();
        container.extend([16, 0, 1, 0]);
        container.extend(u32::try_from(32 + content.len()).unwrap().to_le_bytes());
        container.extend(CONTAINER.to_le_bytes());
        container.extend([method, 0, 0, 0, 0, 0, 0, 0]);
        container.extend([0; 8]);
        container.extend(content);
        container
    }

    fn file(parts: &[Vec<u8>]) -> Vec<u8> {
        let mut file = b"LOGG".to_vec();
        file.extend(144_u32.to_le_bytes());
        file.extend([0; 32]);
        file.extend(START.iter().flat_map(|part| part.to_le_bytes()));
        file.resize(144, 0);
        file.extend(parts.concat());
        file
    }

    fn read(file: &[u8]) -> Vec<Result<String, BadLine>> {
        let mut blf = Blf::new(source(file)).unwrap();
        let mut entries = Vec::new();
        while let Some(entry) = blf.next_object().unwrap() {
            entries.extend(entry.transpose().map(|entry| entry.map(|entry| shown(&entry, START_MICROS))));
        }
        entries
    }

    fn good(file: &[u8]) -> Vec<String> {
        read(file).into_iter().map(Result::unwrap).collect()
    }

    #[test]
    fn every_kind_of_object_is_read() {
        let data = [1, 2, 3, 4, 5, 6, 7, 8];
        let mut fd = [&[2, 0, 0, 9][..], &0x98FE_F100_u32.to_le_bytes(), &[0; 5], &[1, 12], &[0; 5]].concat();
        fd.extend([7; 64]);
        let mut fd64 = vec![3, 9, 12, 0];
        fd64.extend([&0x1A0_u32.to_le_bytes()[..], &[0; 4], &0x1000_u32.to_le_bytes(), &[0; 24]].concat());
        fd64.extend([9; 10]);
        let objects = [
            object(1, 1, 100, &can_message(1, 0, 3, 0x1A0, data)),
            object(86, 2, 2_000_000, &[can_message(1, 1, 15, 0x98FE_F100, data), vec![0; 8]].concat()),
            object(1, 2, 3_000_000, &can_message(1, 0x80, 3, 0x1A0, data)),
            object(65, 2, 0, &[0; 5000]),
            object(73, 2, 4_000_000, &[2, 0, 0, 0]),
            [object(100, 2, 5_000_000, &fd), vec![0; 3]].concat(),
            object(101, 2, 6_000_000, &fd64),
        ];
        let expected = [
            "1000 can1 1A0#010203",
            "2000 can1 18FEF100#0102030405060708",
            "3000 can1 Remote",
            "4000 can2 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })",
            "5000 can2 18FEF100##0070707070707070707070707",
            "6000 can3 1A0##0090909090909090909090000",
        ];
        assert_eq!(good(&file(&[container(2, &objects.concat())])), expected);
        assert_eq!(good(&file(&[container(0, &objects.concat())])), expected);
        assert_eq!(good(&file(&objects)), expected, "outside of containers");
        let objects = objects.concat();
        for split in 1..200 {
            let (first, second) = objects.split_at(split);
            let (first, second) = (container(2, first), container(0, second));
            assert_eq!(good(&file(&[first, second])), expected, "an object over two containers, {split}");
        }
    }

    #[test]
    fn damage_is_counted_and_what_follows_is_read() {
        let whole = || object(1, 1, 100, &can_message(1, 0, 1, 0x1A0, [1; 8]));
        let after = Ok("1000 can1 1A0#01".to_owned());
        let mut packed = container(2, &whole());
        packed[40..44].fill(0xAA);
        let packed = file(&[packed, container(2, &whole())]);
        assert_eq!(read(&packed), [Err(BadLine::BadData), after.clone()]);
        let mut blf = Blf::new(source(&packed)).unwrap();
        blf.next_object().unwrap();
        let mut magic = whole();
        magic[0] = b'X';
        assert_eq!(
            read(&file(&[magic, whole(), whole()])),
            [after.clone(), after.clone()],
            "outside of containers, not an object"
        );
        let mut magic = whole();
        magic[0] = b'X';
        let inside = container(0, &[magic, whole(), whole()].concat());
        assert_eq!(read(&file(&[inside])), [Err(BadLine::NoFrame), after.clone()]);
        let mut size = whole();
        size[8..12].fill(0xFF);
        assert_eq!(read(&file(&[container(0, &[size, whole()].concat())]))[0], Err(BadLine::BadLength));
        let bad_id = object(1, 1, 100, &can_message(1, 0, 1, 0x800, [1; 8]));
        assert_eq!(read(&file(&[bad_id, whole()])), [Err(BadLine::BadId), after.clone()]);
        assert_eq!(read(&file(&[object(1, 1, 100, &[1; 9]), whole()])), [Err(BadLine::BadLength), after]);
    }

    #[test]
    fn a_file_that_was_cut_off_is_an_error_at_its_end() {
        let whole = file(&[container(2, &object(1, 1, 100, &can_message(1, 0, 1, 0x1A0, [1; 8])))]);
        for length in (10..whole.len()).filter(|length| !(144..148).contains(length)) {
            let cut = source(&whole[..length]);
            let outcome = Blf::new(cut).and_then(|mut blf| blf.next_object().map(|entry| entry.is_none()));
            assert_eq!(outcome.unwrap_err().kind(), ErrorKind::UnexpectedEof, "{length}");
        }
    }

    proptest! {
        #[test]
        fn damaged_files_are_read_to_their_end(
            damage in proptest::collection::vec((0..2000_usize, any::<u8>()), 0..20),
            method in prop::sample::select(vec![0, 2]),
        ) {
            let objects: Vec<_> = (0..40).map(|n| object(1, 1, n, &can_message(1, 0, 8, 0x1A0, [1; 8]))).collect();
            let mut file = file(&[container(method, &objects[..20].concat()), container(2, &objects[20..].concat())]);
            for (at, byte) in damage {
                let at = at % file.len();
                file[at] = byte;
            }
            if let Ok(mut blf) = Blf::new(source(&file)) {
                for _ in 0..1000 {
                    if !matches!(blf.next_object(), Ok(Some(_))) {
                        return Ok(());
                    }
                }
                prop_assert!(false, "no end");
            }
        }
    }
}
