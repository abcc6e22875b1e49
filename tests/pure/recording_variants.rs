//! One recording written in every format and variant that python-can does not write.

/// One recording as a variant of a format that python-can does not write.
pub(super) struct Variant {
    pub(super) name: &'static str,
    /// Name of the file; python-can goes by its end.
    pub(super) file: &'static str,
    /// The reader of `tests/peer/recordings.py`.
    pub(super) reader: &'static str,
    pub(super) text: String,
}

/// A frame as the variants write it.
pub(super) struct Line {
    micros: u64,
    bus: usize,
    /// Hexadecimal digits, 3 or 8.
    id: String,
    bytes: Vec<String>,
}

impl Line {
    fn is_extended(&self) -> bool {
        self.id.len() == 8
    }

    fn spaced(&self) -> String {
        self.bytes.join(" ")
    }

    fn seconds(&self) -> String {
        format!("{}.{:06}", self.micros / 1_000_000, self.micros % 1_000_000)
    }
}

/// The frames of a candump log with classic data frames only.
pub(super) fn lines_of(candump: &str) -> Vec<Line> {
    let line = |line: &str| {
        let mut fields = line.split(' ');
        let time = fields.next().unwrap().trim_matches(['(', ')']).replace('.', "");
        let bus = fields.next().unwrap().trim_start_matches("can").parse().unwrap();
        let (id, data) = fields.next().unwrap().split_once('#').unwrap();
        let bytes = data.as_bytes().chunks(2).map(|pair| String::from_utf8(pair.to_vec()).unwrap()).collect();
        Line { micros: time.parse().unwrap(), bus, id: id.to_owned(), bytes }
    };
    candump.lines().map(line).collect()
}

/// The variants that the gateway reads beyond those that python-can writes.
#[expect(clippy::too_many_lines, reason = "one entry for each variant")]
pub(super) fn variants(lines: &[Line]) -> Vec<Variant> {
    let start = lines[0].micros;
    let text = |heading: &str, line: &dyn Fn(&Line) -> String| {
        lines.iter().fold(heading.to_owned(), |text, frame| text + &line(frame) + "\n")
    };
    let variant = |name, file, reader, text| Variant { name, file, reader, text };
    let candump = |line: &Line| format!("{}  can{}", line.seconds(), line.bus);
    let kind = |line: &Line| if line.is_extended() { "29" } else { "11" };
    let offset_ms = |line: &Line| {
        let micros = line.micros - start;
        format!("{}.{:03}", micros / 1000, micros % 1000)
    };
    let savvycan = |line: &Line, shift: i64| {
        let (micros, extended) = (i64::try_from(line.micros - start).unwrap() - shift, line.is_extended());
        let bytes: String = line.bytes.iter().map(|byte| format!("{byte},")).collect();
        format!("{micros},{:0>8},{extended},Rx,{},{},{bytes}", line.id, line.bus, line.bytes.len())
    };
    let asc = |line: &Line| {
        let (micros, x) = (line.micros - start, if line.is_extended() { "x" } else { "" });
        let (id, bus, length) = (&line.id, line.bus + 1, line.bytes.len());
        format!(
            "{}.{:06} {bus}  {id}{x}  Rx   d {length} {}",
            micros / 1_000_000,
            micros % 1_000_000,
            line.spaced()
        )
    };
    let savvycan_heading = "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n";
    let savvycan_reader = r"lines:^-?\d+,[0-9A-F]+,(true|false),Rx,";
    let asc_heading = "date Thu, 09 Nov 2023 17:10:55 GMT\nbase hex  timestamps absolute\n\
                       0.000000 CAN 1 Status:chip status error passive - TxErr: 132 RxErr: 0\n";
    vec![
        variant(
            "candump -ta",
            "long.log",
            "cantools",
            text("", &|line| {
                format!(
                    " ({}) {}  {}   [{}]  {}",
                    line.seconds(),
                    format_args!("can{}", line.bus),
                    line.id,
                    line.bytes.len(),
                    line.spaced()
                )
            }),
        ),
        variant(
            "candump -L, stamps padded with blanks",
            "padded.log",
            r"lines:^\( +\d+\.\d+\) can\d [0-9A-F]+#",
            text("", &|line| {
                format!("({:>20}) can{} {}#{}", line.seconds(), line.bus, line.id, line.bytes.concat())
            }),
        ),
        variant(
            "candump -L, stamps padded with zeros",
            "zeros.log",
            "can",
            text("", &|line| {
                format!("({:0>20}) can{} {}#{}", line.seconds(), line.bus, line.id, line.bytes.concat())
            }),
        ),
        variant(
            "CRTD",
            "crtd.crtd",
            r"lines:^\d+\.\d+ \d[RT](11|29) ",
            text("1542473901.0 CXX OVMS CRTD 3.1\n", &|line| {
                format!("{} {}R{} {} {}", line.seconds(), line.bus + 1, kind(line), line.id, line.spaced())
            }),
        ),
        variant(
            "CANHacker",
            "canhacker.trc",
            r"lines:^\d+\.\d+ [0-9A-F]+ ",
            text("Time   ID     DLC Data                    Comment\n", &|line| {
                let micros = (line.micros - start) % 60_000_000;
                format!(
                    "{:02}.{:03} {:<8} {} {}",
                    micros / 1_000_000,
                    micros / 1000 % 1000,
                    line.id,
                    line.bytes.len(),
                    line.spaced()
                )
            }),
        ),
        variant(
            "PEAK-Converter CSV",
            "peak.csv",
            r"lines:^\d+;[\d.]+;\d+;Rx;DT;",
            text(";$STARTTIME=45360.5\n", &|line| {
                let id = if line.is_extended() { line.id.clone() } else { format!("0{}", line.id) };
                format!(
                    "1;{};{};Rx;DT;{id};-;{};{}",
                    offset_ms(line),
                    line.bus + 1,
                    line.bytes.len(),
                    line.bytes.join(";")
                )
            }),
        ),
        variant(
            "SavvyCAN CSV",
            "savvycan.csv",
            savvycan_reader,
            text(savvycan_heading, &|line| savvycan(line, 0)),
        ),
        variant(
            "SavvyCAN CSV, negative stamps",
            "negative.csv",
            savvycan_reader,
            text(savvycan_heading, &|line| savvycan(line, 1_000_000_000)),
        ),
        variant("Vector ASC, date with GMT, chip status", "gmt.asc", "can", text(asc_heading, &asc)),
        variant(
            "PCAN TRC 1.1",
            "pcan11.trc",
            "can",
            text(";$FILEVERSION=1.1\n;$STARTTIME=45360.5\n", &|line| {
                format!("1) {} Rx {:0>4} {} {}", offset_ms(line), line.id, line.bytes.len(), line.spaced())
            }),
        ),
        variant(
            "candump -L",
            "plain.log",
            "can",
            text("", &|line| {
                format!(
                    "{} {}#{}",
                    candump(line).replacen("  ", ") ", 1).replacen("", "(", 1),
                    line.id,
                    line.bytes.concat()
                )
            }),
        ),
    ]
}
