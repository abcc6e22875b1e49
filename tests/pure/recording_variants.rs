//! One recording written in every format and variant that python-can does not write, as
//! `recording_variants.toml` has them.

use serde::Deserialize;

/// One recording as a variant of a format.
pub(super) struct Variant {
    pub(super) name: String,
    pub(super) file: String,
    pub(super) reader: String,
    /// True if the times are not those of the recording.
    pub(super) is_untimed: bool,
    pub(super) text: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    variant: Vec<Form>,
}

/// What a variant begins with, and how it writes a frame.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Form {
    name: String,
    file: String,
    reader: String,
    #[serde(default)]
    is_untimed: bool,
    #[serde(default)]
    head: String,
    line: String,
}

/// A frame of a candump log with classic data frames only, as it may be written, in the notation of the
/// forms.
fn parts(line: &str, start_us: &mut Option<i64>, last_us: &mut i64) -> [(&'static str, String); 29] {
    let mut fields = line.split(' ');
    let time = fields.next().unwrap().trim_matches(['(', ')']).replace('.', "");
    let bus: usize = fields.next().unwrap().trim_start_matches("can").parse().unwrap();
    let (id, data) = fields.next().unwrap().split_once('#').unwrap();
    let bytes: Vec<_> = data.as_bytes().chunks(2).map(|pair| str::from_utf8(pair).unwrap()).collect();
    let micros: i64 = time.parse().unwrap();
    let offset = micros - *start_us.get_or_insert(micros);
    let difference = offset - std::mem::replace(last_us, offset);
    let is_extended = id.len() == 8;
    let of_kind = |[standard, extended]: [&str; 2]| if is_extended { extended } else { standard }.to_owned();
    let thousandths = |number: i64, digits: usize| {
        let one = 10_i64.pow(u32::try_from(digits).unwrap());
        format!("{}.{:0digits$}", number / one, number % one)
    };
    let seconds = thousandths(micros, 6);
    let of_minute = offset % 60_000_000 / 1000;
    let of_day = [offset / 3_600_000_000, offset / 60_000_000 % 60].map(|part| part.to_string()).join(":");
    let of_day = format!("{of_day}:{}", thousandths(offset % 60_000_000, 6));
    let binary = |byte: &&str| format!("{:08b}", u8::from_str_radix(byte, 16).unwrap());
    [
        ("{seconds:blanks}", format!("{seconds:>20}")),
        ("{seconds:zeros}", format!("{seconds:0>20}")),
        ("{seconds}", seconds),
        ("{second:minute}", format!("{:02}.{:03}", of_minute / 1000, of_minute % 1000)),
        ("{offset_s}", thousandths(offset, 6)),
        ("{offset_s,}", thousandths(offset, 6).replace('.', ",")),
        ("{difference_s}", format!("{:0>10}", thousandths(difference, 6))),
        ("{time_of_day}", of_day),
        ("{offset_ms}", thousandths(offset, 3)),
        ("{offset_us}", offset.to_string()),
        ("{offset_us:negative}", (offset - 1_000_000_000).to_string()),
        ("{bus}", bus.to_string()),
        ("{bus+1}", (bus + 1).to_string()),
        ("{id}", id.to_owned()),
        ("{id:4}", format!("{id:0>4}")),
        ("{id:8}", format!("{id:0>8}")),
        ("{id:left}", format!("{id:<8}")),
        ("{kind}", of_kind(["11", "29"])),
        ("{x}", of_kind(["", "x"])),
        ("{0|1}", of_kind(["0", "1"])),
        ("{t|T}", of_kind(["t", "T"])),
        ("{Std|Ext}", of_kind(["Std", "Ext"])),
        ("{bytes:binary}", bytes.iter().map(binary).collect::<Vec<_>>().join(" ")),
        ("{extended}", is_extended.to_string()),
        ("{length}", bytes.len().to_string()),
        ("{digits}", bytes.concat()),
        ("{bytes}", bytes.join(" ")),
        ("{bytes;}", bytes.join(";")),
        ("{bytes,}", bytes.iter().map(|byte| format!("{byte},")).collect()),
    ]
}

/// The frames of a candump log with classic data frames only, in each variant.
pub(super) fn variants(candump: &str) -> Vec<Variant> {
    let document: Document = toml::from_str(include_str!("recording_variants.toml")).unwrap();
    assert!(!document.variant.is_empty());
    let (mut start, mut last) = (None, 0);
    let frames: Vec<_> = candump.lines().map(|line| parts(line, &mut start, &mut last)).collect();
    let written = |Form { name, file, reader, is_untimed, head, line }: Form| {
        let lines = frames.iter().map(|parts| {
            let text = parts.iter().fold(line.clone(), |text, (name, value)| text.replace(name, value));
            assert!(!text.contains(['{', '}']), "{name}: {text}");
            text + "\n"
        });
        let text = head + &lines.collect::<String>();
        Variant { name, file, reader, is_untimed, text }
    };
    document.variant.into_iter().map(written).collect()
}
