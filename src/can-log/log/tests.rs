use super::*;
use std::io::Write;

const TEXT: &str = "(1.000000) can0 123#01\n\nnonsense\r\n(1.100000) can1 123#02\r\n(1.2) can0 124#";

fn read_all(bytes: Vec<u8>) -> (Log, Vec<LogRecord>) {
    let mut log = Log::new(Box::new(Cursor::new(bytes))).unwrap();
    let mut records = Vec::new();
    while let Some(record) = log.next_record().unwrap() {
        records.push(record);
    }
    (log, records)
}

#[test]
fn bad_lines_are_counted_and_the_rest_is_read() {
    let (log, records) = read_all(TEXT.into());
    let order: Vec<_> = records.iter().map(|record| record.interface.0).collect();
    assert_eq!(order, [0, 1, 0]);
    assert_eq!(log.interfaces(), ["can0", "can1"]);
    assert_eq!((log.bad_lines(), log.first_bad()), (1, Some((3, BadLine::NoTime))));
}

#[test]
fn differences_are_recognised_behind_a_beginning_that_rises() {
    let stamps =
        [(0..10_u32).collect::<Vec<_>>(), vec![3; 10], (0..60).map(|at| at * 7 % 5).collect()].concat();
    let text: String = stamps.iter().map(|ms| format!(" (000.{ms:03}000)  can0  123   [0] \n")).collect();
    let (log, records) = read_all(text.into());
    assert_eq!((log.bad_lines(), records.len()), (0, 80));
    let millis = records.last().unwrap().stamp.as_nanos() / 1_000_000;
    assert_eq!(millis, i64::from(stamps.iter().sum::<u32>()), "the sum of all");
}

#[test]
fn a_file_that_was_cut_gives_what_it_holds_and_tells_where_it_breaks_off() {
    let lines = (0..5_000_u32).map(|i| format!("({i}.0) can0 123#{:08X}", i.wrapping_mul(2_654_435_761)));
    let text = lines.collect::<Vec<_>>().join("\n");
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(text.as_bytes()).unwrap();
    let packed = gzip.finish().unwrap();
    let (whole, records) = read_all(packed.clone());
    assert_eq!((records.len(), whole.breakage()), (5_000, None));
    let cut = packed.len() / 2;
    let (log, part) = read_all(packed[..cut].to_vec());
    let breakage = log.breakage().unwrap();
    assert_eq!((breakage.records, breakage.bytes), (part.len() as u64, cut as u64));
    assert!(part.len() > 2_000 && records.starts_with(&part), "{}", part.len());
    let nothing = Log::new(Box::new(Cursor::new(packed[..15].to_vec()))).map(|mut log| log.next_record());
    assert!(!matches!(nothing, Ok(Ok(_))), "a file that holds nothing is refused");
}

#[test]
fn more_frames_than_a_bus_carries_are_named_and_frames_without_times_are_not() {
    let text = |micros: u64| -> String {
        (0..2_000)
            .map(|at| format!("({}.{:06}) can0 123#\n", at * micros / 1_000_000, at * micros % 1_000_000))
            .collect()
    };
    let densest = |text: String| read_all(text.into()).0.densest();
    assert_eq!(densest(text(50)), None);
    let crowd = densest(text(1)).unwrap();
    assert_eq!((crowd.frames, crowd.span), (2_000, Duration::from_micros(1_999)));
    assert_eq!(
        crowd.to_string(),
        "the stamps of can0 are not believable: 2000 frames in 0.002 s, and a bus carries at most 21000 a second; if their \
         unit is another one, give it with --time-unit"
    );
    assert_eq!(densest(text(0)), None);
    let burst: String = text(1).lines().take(999).map(|line| format!("{line}\n")).collect();
    assert_eq!(densest(burst), None, "a buffer may be emptied at once");
}

#[test]
fn a_file_that_is_not_a_recording_is_refused_with_what_it_looks_like() {
    let refused = |bytes: &[u8]| Log::new(Box::new(Cursor::new(bytes.to_vec()))).unwrap_err().to_string();
    assert_eq!(refused(b""), "the file is empty");
    let zip = refused(b"PK\x03\x04\x14");
    assert!(zip.starts_with("format not recognised: it looks like a zip archive; these are read, "), "{zip}");
    assert!(zip.contains("candump") && zip.contains("Vector BLF"), "{zip}");
    assert!(refused(b"time,speed\n1,2\n").contains("text that begins with \"time,speed\""));
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(b"\x89PNG").unwrap();
    assert!(refused(&gzip.finish().unwrap()).contains("a picture (PNG)"));
}

#[test]
fn an_endless_line_does_not_fill_memory() {
    let mut bytes = b"(1.0) can0 123#01\n".to_vec();
    bytes.extend(vec![b'x'; 1 << 20]);
    bytes.extend(b"\n(1.0) can0 123#01\n");
    let (log, records) = read_all(bytes);
    assert_eq!((records.len(), log.bad_lines()), (2, 1));
}

/// Returns a BLF file with one message.
fn blf() -> Vec<u8> {
    let mut file = [b"LOGG".as_slice(), &144_u32.to_le_bytes()].concat();
    file.resize(144, 0);
    file.extend([b"LOBJ".as_slice(), &[32, 0, 1, 0], &48_u32.to_le_bytes(), &1_u32.to_le_bytes()].concat());
    file.extend([1, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0]);
    file.extend([1, 0, 0, 8, 0xA0, 1, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8]);
    file
}

#[test]
fn damage_of_compressed_data_ends_the_recording_in_a_format_that_skips_damaged_objects() {
    let mut lz4 = lz4_flex::frame::FrameEncoder::new(Vec::new());
    lz4.write_all(&blf()).unwrap();
    let zstd =
        ruzstd::encoding::compress_to_vec(blf().as_slice(), ruzstd::encoding::CompressionLevel::Fastest);
    for packed in [lz4.finish().unwrap(), zstd] {
        assert_eq!(read_all(packed.clone()).1.len(), 1);
        for (at, bit) in (0..packed.len()).flat_map(|at| (0..8).map(move |bit| (at, bit))) {
            let mut damaged = packed.clone();
            damaged[at] ^= 1 << bit;
            let Ok(mut log) = Log::new(Box::new(Cursor::new(damaged))) else { continue };
            // The objects are bounded by bytes, not by records.
            let ends = (0..1000).any(|_| !matches!(log.next_record(), Ok(Some(_))));
            assert!(ends && log.bad_lines() < 1000, "byte {at}, bit {bit}");
        }
    }
}

#[test]
fn entries_are_read_up_to_the_limit_of_their_file() {
    let mut log = Log::new(Box::new(Cursor::new(b"(1.0) can0 123#\n".repeat(100)))).unwrap();
    let limit = 10_000_000_000;
    log.budget().spend(limit - 50 * ENTRY_WORK).unwrap();
    let read = std::iter::from_fn(|| log.next_record().unwrap()).count();
    assert_eq!(read, 50);
    let reason = log.breakage().unwrap().to_string();
    assert!(reason.contains("unpack the file first"), "{reason}");
}
