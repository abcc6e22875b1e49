//! Small recordings of the demo vehicle in every format, and the pieces of binary formats that hostile ones
//! are made of.

/// A frame of eight bytes or fewer, with 11 bits of identifier.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    pub(crate) micros: u64,
    pub(crate) id: u16,
    pub(crate) data: Vec<u8>,
}

/// The turn message of the demo vehicle, of which `decode` prints two lines a frame.
pub(crate) const TURN: u16 = 0x2A5;

/// Frames of the demo vehicle, 100 ms apart from 1,700,000,000 s on.
pub(crate) fn drive(count: usize) -> Vec<Frame> {
    let frame = |index: u64| Frame {
        micros: 1_700_000_000_000_000 + index * 100_000,
        id: if index % 4 == 3 { 0x2C1 } else { TURN },
        data: vec![0, 0, if (index / 8).is_multiple_of(2) { 2 } else { 0 }, 0, 0, 0, 0, 0],
    };
    (0..count as u64).map(frame).collect()
}

fn hex(bytes: &[u8], between: &str) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(between)
}

/// How a format of lines is written: its name, what stands before the first line, and a line.
pub(crate) type TextFormat = (&'static str, &'static str, fn(&Frame) -> String);

pub(crate) const TEXT_FORMATS: [TextFormat; 14] = [
    ("candump.log", "", |frame| {
        format!("({}) can0 {:03X}#{}\n", seconds(frame), frame.id, hex(&frame.data, ""))
    }),
    ("asc", "date Tue Mar 5 02:30:00.250 pm 2024\nbase hex  timestamps absolute\n", |frame| {
        let data = hex(&frame.data, " ");
        format!("   {} 1  {:X}             Rx   d {} {data}\n", offset(frame), frame.id, frame.data.len())
    }),
    ("trc", ";$FILEVERSION=2.1\n;$STARTTIME=45356.6041695602\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n", |frame| {
        let (millis, data) = (frame.micros % 1_000_000_000 / 1000, hex(&frame.data, " "));
        format!("  1 {millis}.000 DT 1 {:04X} Rx - {} {data}\n", frame.id, frame.data.len())
    }),
    ("gvret.csv", "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n", |frame| {
        let data = hex(&frame.data, ",");
        format!("{},{:08X},false,Rx,0,{},{data},\n", frame.micros % 4_000_000_000, frame.id, frame.data.len())
    }),
    ("python.csv", "timestamp,arbitration_id,extended,remote,error,dlc,data\n", |frame| {
        format!("{},0x{:x},0,0,0,8,AAAAAAAAAAA=\n", seconds(frame), frame.id)
    }),
    (
        "busmaster.log",
        "***BUSMASTER Ver 3.2.2***\n***START DATE AND TIME 5:3:2024 14:30:0:250***\n***HEX***\n***SYSTEM MODE***\n",
        |frame| {
            let data = hex(&frame.data, " ");
            format!("14:30:01:5000 Rx 1 0x{:03X} s {} {data}\n", frame.id, frame.data.len())
        },
    ),
    ("canhacker.trc", "Time   ID     DLC Data                    Comment\n", |frame| {
        format!("{} {:03X} {} {}\n", offset(frame), frame.id, frame.data.len(), hex(&frame.data, " "))
    }),
    ("crtd", "1.0 CXX OVMS CAN log\n", |frame| {
        format!("{} 1R11 {:03X} {}\n", seconds(frame), frame.id, hex(&frame.data, " "))
    }),
    ("sniffer.log", "", |frame| {
        format!("{}   0x{:03X}: {}\n", frame.micros / 1000 % 1_000_000, frame.id, hex(&frame.data, " "))
    }),
    ("cabana.csv", "time,addr,bus,data\n", |frame| {
        format!("{},0x{:03X},0,0x{}\n", offset(frame), frame.id, hex(&frame.data, ""))
    }),
    (
        "canedge.csv",
        "TimestampEpoch;BusChannel;ID;IDE;DLC;DataLength;Dir;EDL;BRS;ESI;RTR;DataBytes\n",
        |frame| {
            let length = frame.data.len();
            let data = hex(&frame.data, "");
            format!("{};9;{:03X};0;{length};{length};0;0;0;0;0;{data}\n", seconds(frame), frame.id)
        },
    ),
    ("hcrl.csv", "", |frame| {
        let data = hex(&frame.data, ",").to_lowercase();
        format!("{},{:04x},{},{data},R\n", seconds(frame), frame.id, frame.data.len())
    }),
    ("slcan", "", |frame| format!("t{:03X}{}{}\n", frame.id, frame.data.len(), hex(&frame.data, ""))),
    (
        "ixxat.csv",
        "ASCII Trace IXXAT canAnalyser V2.8\nDate: 12:3:2010\n\"Time\",\"Identifier (hex)\",\"Format\",\"Flags\",\"Data (hex)\"\n",
        |frame| format!("\"00:01:03.03\",\"{:X}\",\"Std\",\"\",\"{}\"\n", frame.id, hex(&frame.data, " ")),
    ),
];

/// Seconds since 1970.
fn seconds(frame: &Frame) -> String {
    format!("{}.{:06}", frame.micros / 1_000_000, frame.micros % 1_000_000)
}

/// Seconds, below a thousand.
fn offset(frame: &Frame) -> String {
    format!("{}.{:06}", frame.micros / 1_000_000 % 1000, frame.micros % 1_000_000)
}

pub(crate) fn text((_, heading, line): TextFormat, frames: &[Frame]) -> Vec<u8> {
    heading.bytes().chain(frames.iter().flat_map(|frame| line(frame).into_bytes())).collect()
}

pub(crate) fn carbus(frames: &[Frame]) -> Vec<u8> {
    let mut file = b"@ TEXT @ 3 @ 64 @ 0 @ 55 @ 10078 @ 00:00:10.078 @\r".to_vec();
    for frame in frames {
        let (micros, data) = (frame.micros % 1_000_000_000, hex(&frame.data, " "));
        let time = format!("{},{:06}", micros / 1_000_000, micros % 1_000_000);
        let line = format!("{time}\t1\t0004\t{:03X}\t{}\t{data}\t00000000\tZ\r", frame.id, frame.data.len());
        file.extend(line.into_bytes());
    }
    file
}

/// Vector BLF.
pub(crate) mod blf {
    use super::Frame;

    pub(crate) fn head() -> Vec<u8> {
        let mut head = b"LOGG".to_vec();
        head.extend(144_u32.to_le_bytes());
        head.resize(144, 0);
        head
    }

    fn base(kind: u32, header: u16, content: &[u8]) -> Vec<u8> {
        let size = u32::try_from(16 + content.len()).unwrap();
        let mut object = b"LOBJ".to_vec();
        object.extend(header.to_le_bytes());
        object.extend(1_u16.to_le_bytes());
        object.extend([size, kind].map(u32::to_le_bytes).concat());
        object.extend(content);
        object.resize(object.len().next_multiple_of(4), 0);
        object
    }

    pub(crate) fn frame(frame: &Frame) -> Vec<u8> {
        let mut content = 2_u32.to_le_bytes().to_vec();
        content.extend([0; 4]);
        content.extend((frame.micros * 1000 % (1 << 60)).to_le_bytes());
        content.extend([1, 0, 0, u8::try_from(frame.data.len()).unwrap()]);
        content.extend(u32::from(frame.id).to_le_bytes());
        content.extend(&frame.data);
        content.resize(32, 0);
        base(1, 32, &content)
    }

    /// A container of objects that stand in it as they are, or packed by zlib.
    pub(crate) fn container(method: u16, unpacked: usize, content: &[u8]) -> Vec<u8> {
        let mut head = method.to_le_bytes().to_vec();
        head.extend([0; 6]);
        head.extend(u32::try_from(unpacked).unwrap_or(u32::MAX).to_le_bytes());
        head.extend([0; 4]);
        base(10, 16, &[head, content.to_vec()].concat())
    }

    pub(crate) fn packed(objects: &[u8]) -> Vec<u8> {
        container(2, objects.len(), &super::super::packing::zlib(objects))
    }
}

/// MCAP.
pub(crate) mod mcap {
    use super::Frame;

    pub(crate) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

    pub(crate) fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
        [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
    }

    fn text(text: &[u8]) -> Vec<u8> {
        [&u32::try_from(text.len()).unwrap().to_le_bytes(), text].concat()
    }

    pub(crate) fn schema(id: u16, name: &[u8]) -> Vec<u8> {
        record(3, &[id.to_le_bytes().to_vec(), text(name), text(b"ros2msg"), text(b"")].concat())
    }

    pub(crate) fn channel(id: u16, schema: u16, topic: &[u8]) -> Vec<u8> {
        let numbers = [id.to_le_bytes(), schema.to_le_bytes()].concat();
        record(4, &[numbers, text(topic), text(b"cdr"), vec![0; 4]].concat())
    }

    pub(crate) fn message(channel: u16, nanos: u64, content: &[u8]) -> Vec<u8> {
        let mut body = channel.to_le_bytes().to_vec();
        body.extend([0; 4]);
        body.extend([nanos, nanos].map(u64::to_le_bytes).concat());
        body.extend(content);
        record(5, &body)
    }

    /// `can_msgs/msg/Frame` with its encapsulation header.
    pub(crate) fn cdr(frame: &Frame) -> Vec<u8> {
        let nanos = u32::try_from(frame.micros % 1_000_000 * 1000).unwrap();
        let second = u32::try_from(frame.micros / 1_000_000 % (1 << 31)).unwrap();
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend([second, nanos, 4].map(u32::to_le_bytes).concat());
        bytes.extend(b"can\0");
        bytes.extend(u32::from(frame.id).to_le_bytes());
        bytes.extend([0, 0, 0, u8::try_from(frame.data.len()).unwrap()]);
        bytes.extend(&frame.data);
        bytes.resize(36, 0);
        bytes
    }

    /// What tells that channel 1 has frames.
    pub(crate) fn described() -> Vec<u8> {
        [schema(1, b"can_msgs/msg/Frame"), channel(1, 1, b"/can0/from_can_bus")].concat()
    }

    pub(crate) fn messages(frames: &[Frame]) -> Vec<u8> {
        frames.iter().flat_map(|frame| message(1, frame.micros * 1000, &cdr(frame))).collect()
    }

    /// A chunk without a checksum.
    pub(crate) fn chunk(compression: &str, unpacked: u64, packed: &[u8]) -> Vec<u8> {
        let mut body = vec![0; 16];
        body.extend(unpacked.to_le_bytes());
        body.extend([0; 4]);
        body.extend(text(compression.as_bytes()));
        body.extend((packed.len() as u64).to_le_bytes());
        body.extend(packed);
        record(6, &body)
    }

    pub(crate) fn end() -> Vec<u8> {
        [record(15, &[0; 4]), record(2, &[0; 20]), MAGIC.to_vec()].concat()
    }

    pub(crate) fn file(records: &[u8]) -> Vec<u8> {
        [MAGIC, &record(1, &[0; 8]), records, &end()].concat()
    }
}

/// ASAM MDF 4.
pub(crate) mod mf4 {
    use super::Frame;

    /// Writes blocks one behind the other.
    pub(crate) struct Writer(pub(crate) Vec<u8>);

    impl Writer {
        pub(crate) fn new() -> Self {
            let mut this = Self(b"MDF     4.10    ".to_vec());
            this.0.resize(64, 0);
            this.block(*b"HD", &[0; 6], &[0; 32]);
            this
        }

        pub(crate) fn block(&mut self, kind: [u8; 2], links: &[u64], data: &[u8]) -> u64 {
            self.0.resize(self.0.len().next_multiple_of(8), 0);
            let at = self.0.len() as u64;
            let length = 24 + 8 * links.len() + data.len();
            self.0.extend([&b"##"[..], &kind, &[0; 4]].concat());
            self.0.extend((length as u64).to_le_bytes());
            self.0.extend((links.len() as u64).to_le_bytes());
            self.0.extend(links.iter().flat_map(|link| link.to_le_bytes()));
            self.0.extend(data);
            at
        }

        pub(crate) fn set_link(&mut self, block: u64, index: usize, to: u64) {
            let at = usize::try_from(block).unwrap() + 24 + 8 * index;
            self.0[at..at + 8].copy_from_slice(&to.to_le_bytes());
        }

        pub(crate) fn conversion(&mut self, values: &[f64]) -> u64 {
            let count = u16::try_from(values.len()).unwrap_or(u16::MAX);
            let mut data = vec![if values.len() == 2 { 1 } else { 5 }, 0, 0, 0, 0, 0];
            data.extend(count.to_le_bytes());
            data.extend([0; 16]);
            data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            self.block(*b"CC", &[0; 4], &data)
        }

        /// A channel; `layout` is its kind, type, first bit, first byte and number of bits.
        pub(crate) fn channel(&mut self, next: u64, name: &str, layout: [u8; 5], links: [u64; 2]) -> u64 {
            let name = self.block(*b"TX", &[], &[name.as_bytes(), &[0]].concat());
            let [kind, data_type, bit, byte, bits] = layout;
            let mut data = vec![kind, u8::from(kind == 2), data_type, bit, byte, 0, 0, 0, bits, 0, 0, 0];
            data.resize(72, 0);
            self.block(*b"CN", &[next, 0, name, 0, links[0], links[1], 0, 0], &data)
        }

        pub(crate) fn group(&mut self, next: u64, channels: u64, number: u64, flags: u8, length: u8) -> u64 {
            let mut data = [number.to_le_bytes(), [0; 8], [flags, 0, 0, 0, 0, 0, 0, 0]].concat();
            data.extend([length, 0, 0, 0, 0, 0, 0, 0]);
            self.block(*b"CG", &[next, channels, 0, 0, 0, 0], &data)
        }

        /// Appends a data group, and links it behind `before`, or to the header.
        pub(crate) fn data_group(&mut self, before: Option<u64>, groups: u64, number_length: u8) -> u64 {
            let at = self.block(*b"DG", &[0, groups, 0, 0], &[number_length, 0, 0, 0, 0, 0, 0, 0]);
            self.set_link(before.unwrap_or(64), 0, at);
            at
        }

        /// The channels of frames whose records have a time, an identifier, a length and eight bytes.
        pub(crate) fn frame_channels(&mut self) -> u64 {
            let mut channel = self.channel(0, "CAN_DataFrame.DataBytes", [0, 10, 0, 13, 64], [0, 0]);
            for (name, layout) in [
                ("CAN_DataFrame.DataLength", [0, 0, 0, 12, 8]),
                ("CAN_DataFrame.ID", [0, 0, 0, 8, 32]),
                ("CAN_DataFrame", [0, 10, 0, 8, 104]),
            ] {
                channel = self.channel(channel, name, layout, [0, 0]);
            }
            self.channel(channel, "t", [2, 4, 0, 0, 64], [0, 0])
        }

        /// A data group of frames alone, whose data are to be set as link 2.
        pub(crate) fn frames_group(&mut self) -> u64 {
            let channels = self.frame_channels();
            let group = self.group(0, channels, 0, 0, 21);
            self.data_group(None, group, 0)
        }

        pub(crate) fn packed(&mut self, unpacked: u64, packed: &[u8]) -> u64 {
            let mut data = b"DT\0\0\x01\0\0\0".to_vec();
            data.extend(unpacked.to_le_bytes());
            data.extend((packed.len() as u64).to_le_bytes());
            data.extend(packed);
            self.block(*b"DZ", &[], &data)
        }
    }

    pub(crate) fn records(frames: &[Frame]) -> Vec<u8> {
        let record = |frame: &Frame| {
            #[allow(clippy::cast_precision_loss)] // below 2^53
            let time = frame.micros as f64 / 1e6;
            let mut record = time.to_le_bytes().to_vec();
            record.extend(u32::from(frame.id).to_le_bytes());
            record.push(u8::try_from(frame.data.len()).unwrap());
            record.extend(&frame.data);
            record.resize(21, 0);
            record
        };
        frames.iter().flat_map(record).collect()
    }
}

/// Logs of openpilot.
pub(crate) mod openpilot {
    use super::Frame;

    pub(crate) fn structure(offset: u64, words: u64, pointers: u64) -> u64 {
        offset << 2 | words << 32 | pointers << 48
    }

    pub(crate) fn list(offset: u64, kind: u64, length: u64) -> u64 {
        1 | offset << 2 | kind << 32 | length << 35
    }

    pub(crate) fn message(words: &[u64]) -> Vec<u8> {
        let length = u32::try_from(words.len()).unwrap();
        let words = words.iter().flat_map(|word| word.to_le_bytes());
        [0, length].into_iter().flat_map(u32::to_le_bytes).chain(words).collect()
    }

    /// An event with frames.
    pub(crate) fn event(frames: &[Frame]) -> Vec<u8> {
        let count = frames.len() as u64;
        let nanos = frames.first().map_or(0, |frame| frame.micros * 1000);
        let mut words = vec![structure(0, 2, 1), nanos, 4, list(0, 7, 2 * count), structure(count, 1, 1)];
        for (index, frame) in (0..).zip(frames) {
            words.push(frame.id.into());
            words.push(list(2 * (count - index) - 2 + index, 2, frame.data.len() as u64));
        }
        words.extend(frames.iter().map(|frame| {
            let mut word = [0; 8];
            word[..frame.data.len()].copy_from_slice(&frame.data);
            u64::from_le_bytes(word)
        }));
        message(&words)
    }

    pub(crate) fn start() -> Vec<u8> {
        message(&[structure(0, 2, 1), 0, 0, structure(0, 2, 0), 0, 1_700_000_000_000_000_000])
    }
}

/// pcap and pcapng, of frames as SocketCAN has them.
pub(crate) mod capture {
    use super::Frame;

    fn packet(frame: &Frame) -> Vec<u8> {
        let mut packet = u32::from(frame.id).to_be_bytes().to_vec();
        packet.extend([u8::try_from(frame.data.len()).unwrap(), 0, 0, 0]);
        packet.extend(&frame.data);
        packet.resize(16, 0);
        packet
    }

    pub(crate) fn pcap_head() -> Vec<u8> {
        [0xA1B2_C3D4, 0x0004_0002, 0, 0, 262_144, 227].map(u32::to_le_bytes).concat()
    }

    pub(crate) fn pcap_packet(frame: &Frame) -> Vec<u8> {
        let second = u32::try_from(frame.micros / 1_000_000 % (1 << 31)).unwrap();
        let micro = u32::try_from(frame.micros % 1_000_000).unwrap();
        [[second, micro, 16, 16].map(u32::to_le_bytes).concat(), packet(frame)].concat()
    }

    pub(crate) fn block(kind: u32, content: &[u8]) -> Vec<u8> {
        let mut padded = content.to_vec();
        padded.resize(content.len().next_multiple_of(4), 0);
        let length = u32::try_from(padded.len() + 12).unwrap().to_le_bytes();
        [&kind.to_le_bytes()[..], &length, &padded, &length].concat()
    }

    pub(crate) fn section() -> Vec<u8> {
        let content = [&0x1A2B_3C4D_u32.to_le_bytes()[..], &[1, 0, 0, 0], &[0xFF; 8]].concat();
        block(0x0A0D_0D0A, &content)
    }

    pub(crate) fn option(code: u16, value: &[u8]) -> Vec<u8> {
        let mut option = [code, u16::try_from(value.len()).unwrap()].map(u16::to_le_bytes).concat();
        option.extend(value);
        option.resize(option.len().next_multiple_of(4), 0);
        option
    }

    pub(crate) fn interface(name: &[u8]) -> Vec<u8> {
        block(1, &[&[227, 0, 0, 0, 0, 0, 0, 0][..], &option(2, name), &option(0, &[])].concat())
    }

    pub(crate) fn pcapng_packet(interface: u32, frame: &Frame) -> Vec<u8> {
        let [high, low] =
            [frame.micros >> 32, frame.micros & 0xFFFF_FFFF].map(|half| u32::try_from(half).unwrap());
        let head = [interface, high, low, 16, 16].map(u32::to_le_bytes).concat();
        block(6, &[head, packet(frame)].concat())
    }
}
