//! The records of a data group in an MF4 file, and their CAN frames.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};

use super::mf4_blocks::Blocks;
use super::mf4_channels::{Channel, FrameChannels, FrameKind};
use super::mf4_data::DataReader;
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::fields::{bus_error, data_frame, id, length_of_dlc};
use crate::file_budget::Kept;
use crate::format::damaged;
use crate::little_endian::{u16_at, u32_at, u64_at};

/// Cost of a record besides the conversions of its values, nominal ns.
const RECORD_WORK: u64 = 50;
/// Memory of a frame waiting in a window, bytes.
const WAITING: u64 = 160;
/// Memory of a group besides conversion tables, bytes.
const GROUP: u64 = 2048;
/// Memory of a pair in a conversion table, bytes.
const PAIR: u64 = 16;
/// Flag of a channel group whose records are values of variable length.
const VARIABLE_LENGTH: u16 = 1;

/// A frame, or the reason why it cannot be read.
pub(super) type Entry = Result<LogEntry<'static>, BadLine>;

/// Number of frames that wait in the window of a data group: loggers write the frames of one bus, or of one
/// kind, together.
const WINDOW: usize = 20_000;

/// Channel groups with one stream of records.
pub(super) struct DataGroup {
    /// Start of the measurement, ns since 1970.
    start: i64,
    data: DataReader,
    /// Length of the number before each record, bytes; 0 with a single channel group.
    number_length: usize,
    groups: BTreeMap<u64, ChannelGroup>,
    /// Entries ordered by time and record; unreadable entries have no time.
    window: BTreeMap<(Option<i64>, u64), Entry>,
    /// Maximum memory of the entries waiting in `window`.
    window_kept: Kept,
    /// Memory of the groups' descriptions.
    _kept: Kept,
    frames: u64,
    /// Reason why nothing after the window can be read.
    failure: Option<io::Error>,
}

struct ChannelGroup {
    /// Length of a record, bytes; `None` if each record is a value with its own length.
    length: Option<usize>,
    /// `None` if the records are not frames.
    frames: Option<FrameChannels>,
    records: u64,
    /// Values of variable length, each after its length.
    values: Vec<u8>,
    values_kept: Kept,
}

impl DataGroup {
    /// Reads the description of a group, `None` if it has no frames, and the link to the next group.
    pub(super) fn of(file: &Blocks, link: u64, start: i64) -> io::Result<(Option<Self>, Option<u64>)> {
        let block = file.block_of_kind(link, *b"DG")?;
        let number_length = block.data.first().copied().unwrap_or(0).into();
        let (mut groups, mut kept) = (BTreeMap::new(), file.budget.keep());
        // Numbers of the groups, by their position in the file.
        let mut numbers = BTreeMap::new();
        let mut next = block.link(1);
        while let Some(link) = next {
            let group = file.block_of_kind(link, *b"CG")?;
            let number = u64_at(group.data, 0);
            numbers.insert(link, number);
            let description = ChannelGroup::of(file, group.link(1), group.data)?;
            kept.grow(GROUP + PAIR * description.frames.as_ref().map_or(0, FrameChannels::pairs))?;
            groups.insert(number, description);
            next = group.link(0);
        }
        if !groups.values().any(|group| group.frames.is_some()) {
            return Ok((None, block.link(0)));
        }
        let is_endless = number_length == 0 && groups.values().any(|group| group.length == Some(0));
        if number_length > 8 || is_endless || number_length == 0 && groups.len() > 1 {
            return Err(damaged("MF4: the records of a group cannot be told apart"));
        }
        let data = DataReader::new(file, block.link(2));
        let (window, window_kept, frames, failure) = (BTreeMap::new(), file.budget.keep(), 0, None);
        let mut this =
            Self { start, data, number_length, groups, window, window_kept, _kept: kept, frames, failure };
        this.collect_values(file, block.link(2), &numbers);
        Ok((Some(this), block.link(0)))
    }

    /// Collects the values of variable length, which lie in their own blocks or between the other records.
    fn collect_values(&mut self, file: &Blocks, data: Option<u64>, numbers: &BTreeMap<u64, u64>) {
        let values = |group: &ChannelGroup| group.frames.as_ref()?.data()?.values;
        let links: Vec<_> =
            self.groups.iter().filter_map(|(number, group)| Some((*number, values(group)?))).collect();
        let mut between = BTreeMap::new();
        for (number, link) in &links {
            if let Some(of) = numbers.get(link) {
                between.insert(*of, (Vec::new(), file.budget.keep()));
            } else if let Some(group) = self.groups.get_mut(number) {
                let reader = DataReader::new(file, Some(*link));
                reader.append_all(file, &mut group.values, &mut group.values_kept);
            }
        }
        if between.is_empty() {
            return;
        }
        let mut reader = DataReader::new(file, data);
        // A failure recurs when the frames are read.
        while let Ok(Some((number, record))) =
            next_record(&mut reader, file, self.number_length, &self.groups)
        {
            let Some((values, kept)) = between.get_mut(&number) else { continue };
            if kept.grow(record.len() as u64 + 4).is_err() {
                break;
            }
            values.extend(u32::try_from(record.len()).unwrap_or(u32::MAX).to_le_bytes());
            values.extend(record);
        }
        for (number, link) in links {
            let values = numbers.get(&link).and_then(|of| between.remove(of));
            if let (Some(values), Some(group)) = (values, self.groups.get_mut(&number)) {
                (group.values, group.values_kept) = values;
            }
        }
    }

    /// Returns the next entry with its time; `None` at the end. Fails if nothing after this point can be
    /// read.
    pub(super) fn next(&mut self, file: &Blocks) -> io::Result<Option<(Option<i64>, Entry)>> {
        let size = if self.groups.len() > 1 { WINDOW } else { 1 };
        while self.window.len() < size && self.failure.is_none() {
            let waiting = (self.window.len() as u64 + 1) * WAITING;
            match self.window_kept.resize_up(waiting).and_then(|()| self.read(file)) {
                Ok(Some(entry)) => {
                    let nanos = entry.ok().map(|entry| entry.stamp.as_nanos());
                    self.window.insert((nanos, self.frames), entry);
                    self.frames += 1;
                }
                Ok(None) => break,
                Err(error) => self.failure = Some(error),
            }
        }
        match self.window.pop_first() {
            Some(((nanos, _), entry)) => Ok(Some((nanos, entry))),
            None => self.failure.take().map_or(Ok(None), Err),
        }
    }

    /// Reads to the next frame.
    fn read(&mut self, file: &Blocks) -> io::Result<Option<Entry>> {
        while let Some((number, record)) =
            next_record(&mut self.data, file, self.number_length, &self.groups)?
        {
            let Some(group) = self.groups.get_mut(&number) else { continue };
            let index = group.records;
            group.records += 1;
            if let Some(frames) = &group.frames {
                file.budget.spend(frames.pairs())?;
                return Ok(Some(entry(frames, record, index, &group.values, self.start)));
            }
        }
        Ok(None)
    }
}

impl ChannelGroup {
    fn of(file: &Blocks, channels: Option<u64>, data: &[u8]) -> io::Result<Self> {
        let is_variable = u16_at(data, 16) & VARIABLE_LENGTH != 0;
        let length = u64::from(u32_at(data, 24)) + u64::from(u32_at(data, 28));
        let length = usize::try_from(length).map_err(|_| ErrorKind::InvalidData)?;
        let frames = if is_variable { None } else { FrameChannels::of(file, channels)? };
        let (length, values_kept) = ((!is_variable).then_some(length), file.budget.keep());
        Ok(Self { length, frames, records: 0, values: Vec::new(), values_kept })
    }
}

/// Returns the next record with its group's number; `None` at the end.
fn next_record<'a>(
    data: &'a mut DataReader,
    file: &'a Blocks,
    number_length: usize,
    groups: &BTreeMap<u64, ChannelGroup>,
) -> io::Result<Option<(u64, &'a [u8])>> {
    file.budget.spend(RECORD_WORK)?;
    let (mut number, mut group) = (0, groups.values().next());
    if number_length > 0 {
        let Some(bytes) = data.take(file, number_length)? else { return Ok(None) };
        let mut padded = [0; 8];
        padded[..number_length].copy_from_slice(bytes);
        number = u64::from_le_bytes(padded);
        group = groups.get(&number);
    } else if let Some(only) = groups.keys().next() {
        number = *only;
    }
    let group = group.ok_or_else(|| damaged(format!("MF4: no group has the number {number}")))?;
    let cut = || io::Error::from(ErrorKind::UnexpectedEof);
    let length = match group.length {
        Some(length) => length,
        None => usize::try_from(u32_at(data.take(file, 4)?.ok_or_else(cut)?, 0)).map_err(|_| cut())?,
    };
    match data.take(file, length)? {
        None if number_length > 0 => Err(cut()),
        record => Ok(record.map(|record| (number, record))),
    }
}

/// Reads a record; `start` is the start of the measurement, ns since 1970.
fn entry(frames: &FrameChannels, record: &[u8], index: u64, values: &[u8], start: i64) -> Entry {
    let nanos = start.saturating_add(frames.nanos(record, index)?);
    let number = |channel: &Option<Channel>| channel.as_ref()?.number(record, index);
    let [bus, id_channel, extended, fd, dlc, length, data] = &frames.parts;
    let content = match frames.kind {
        FrameKind::Remote => EntryContent::Remote,
        FrameKind::Error => bus_error(),
        FrameKind::Data => {
            let number_and_flag = number(id_channel).ok_or(BadLine::BadId)?;
            // Writers without a channel for it mark 29 bits by a flag in the identifier.
            let is_extended = number(extended).map_or(number_and_flag > 0x7FF, |flag| flag != 0);
            let id = id(number_and_flag & 0x1FFF_FFFF, is_extended)?;
            let bytes = data.as_ref().and_then(|data| data.bytes(record, values)).ok_or(BadLine::BadData)?;
            let is_fd = number(fd).map(|flag| flag != 0);
            let length = match (length, dlc) {
                (Some(_), _) => number(length).and_then(|length| usize::try_from(length).ok()),
                (None, Some(_)) => {
                    number(dlc).and_then(|dlc| length_of_dlc(dlc, is_fd.unwrap_or(bytes.len() > 8)))
                }
                (None, None) => Some(bytes.len()),
            };
            let length = length.ok_or(BadLine::BadLength)?;
            let data = bytes.get(..length).ok_or(BadLine::BadData)?;
            data_frame(id, is_fd.unwrap_or(length > 8), data)?
        }
    };
    Ok(LogEntry::numbered(nanos, number(bus).unwrap_or(0), content))
}
