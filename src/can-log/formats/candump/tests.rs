use super::*;
use crate::format::testing::{assert_refused, good, read};
use can_signal::can::Frame;
use proptest::prelude::*;

fn frame(line: &str) -> Frame {
    match parse_line(line.as_bytes()).unwrap().content {
        EntryContent::Data(frame) => frame,
        other @ (EntryContent::Remote | EntryContent::Error(_) | EntryContent::Note(_)) => {
            panic!("{other:?}")
        }
    }
}

#[test]
fn lines_for_people_and_padded_stamps_are_read() {
    let lines = good(
        FORMAT,
        &[
            "( 1436509052.249713) can0 123#01",
            "(0000000012.5) can0 123#02",
            "(-0.250000) can0 123#02",
            "(2015-07-10 06:17:32.249713)  can0  123   [1]  03",
            "  (000.000100)  can0       123   [4]  2A 36 6C 2B               '*6l+'",
            " (12.5)  can1  18FEF100   [0]",
            " (12.5)  can0  RX - -  123   [8] 1 2 3 4 5 6 7 8",
            " (12.5)  can0  TX B E  123  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B",
            " (12.5)  can0  123   {F}  1 2 3 4 5 6 7 8",
            " (12.5)  can0  123   [3]  remote request",
            " (12.5)  can0  20000204   [8]  00 08 00 00 00 00 60 7F   ERRORFRAME",
        ],
    );
    let expected = [
        "1436509052249713 can0 123#01",
        "12500000 can0 123#02",
        "-250000 can0 123#02",
        "1436509052249713 can0 123#03",
        "100 can0 123#2A366C2B",
        "12500000 can1 18FEF100#",
        "12500000 can0 123#0102030405060708",
        "12500000 can0 123##0000102030405060708090A0B",
        "12500000 can0 123#0102030405060708",
        "12500000 can0 Remote",
        "12500000 can0 Error(ErrorFrame { class: 516, data: [0, 8, 0, 0, 0, 0, 96, 127] })",
    ];
    assert_eq!(lines, expected);
}

/// Lines of candump 2020.11 on a virtual bus, with each of its options.
#[test]
fn output_for_terminals_is_read_without_what_adorns_it() {
    let swapped = " (1.5)  vcan0  20000204   [8]  7F`60`00`00`00`00`08`00   ERRORFRAME";
    let lines = good(
        FORMAT,
        &[
            " (1.5)  vcan0  123   [2]  00000010 11101111                                  '..'",
            " (1.5)  vcan0  TX - -  123   [5]  DE AD BE EF 11            '.....'",
            " (1.5)  vcan0  123   [3]  11`EF`BE   'AB`'",
            swapped,
            " (1.5)  \x1B[1m\x1B[34mvcan0\x1B[0m  123   [1]  11",
            " (1.5)  \x1B[1m\x1B[34mvcan0  123   [1]  11\x1B[0m",
            " \x1B[34m(1.5)  vcan0  123   [1]  11\x1B[0m",
            " (1.5)  vcan0  20000204   [1]  00   ERRORFRAME",
            "controller-problem{rx-error-warning}",
            "(0000000001.500000000) vcan0 123#11",
            "(001.500000)   can0 123#11",
            "(1.5) can1 7A8 [1] F4",
        ],
    );
    let error = "Error(ErrorFrame { class: 516, data: [0, 8, 0, 0, 0, 0, 96, 127] })";
    let expected = [
        "1500000 vcan0 123#02EF",
        "1500000 vcan0 123#DEADBEEF11",
        "1500000 vcan0 123#BEEF11",
        &format!("1500000 vcan0 {error}"),
        "1500000 vcan0 123#11",
        "1500000 vcan0 123#11",
        "1500000 vcan0 123#11",
        &format!("1500000 vcan0 {}", error.replace("8, 0, 0, 0, 0, 96, 127", "0, 0, 0, 0, 0, 0, 0")),
        "1500000 vcan0 123#11",
        "1500000 can0 123#11",
        "1500000 can1 7A8#F4",
    ];
    assert_eq!(lines, expected);
    let text = "controller-problem{rx-error-warning}";
    assert_eq!(parse_line(text.as_bytes()), Err(BadLine::NoTime), "without an error frame before it");
}

#[test]
fn differences_are_added_up_whatever_else_is_in_their_lines() {
    let lines = [
        " (000.000000)  vcan0  123   [1]  11",
        " (000.125026)  vcan0  123   [0]  remote request",
        "(000.052722) vcan0 123#22",
        "(001.000001) vcan0 123#2",
        " (000.009470)  vcan0  123   [1]  33",
    ];
    let expected = [
        Ok("0 vcan0 123#11"),
        Ok("125026 vcan0 Remote"),
        Ok("177748 vcan0 123#22"),
        Err(BadLine::BadData),
        Ok("1187219 vcan0 123#33"),
    ];
    assert_eq!(read(DIFFERENCES, &lines), expected.map(|entry| entry.map(str::to_owned)));
}

#[test]
fn every_kind_of_line_is_read() {
    let line = parse_line(b"(1436509052.249713) vcan0 044#2A366C").unwrap();
    assert_eq!(line.stamp, WallStamp::from_nanos(1_436_509_052_249_713_000));
    assert_eq!(line.interface, EntryInterface::Named("vcan0"));
    assert_eq!(frame("(0.000001) can0 044#2A366C").to_string(), "044#2A366C");
    assert_eq!(frame("(0.000001) can0 0CFDCC27#ff00 R").id(), CanId::Extended(0x0CFD_CC27));
    assert_eq!(frame("(0.000001) can0 123##10102030405060708090A0B0C").data().len(), 12);
    assert_eq!(frame("(0.000001) can0 123#1122334455667788_F T").data().len(), 8);
    assert_eq!(frame("(0.000001) can0 123#").data().len(), 0);
    let remote = parse_line(b"(0.1) can0 123#R8").unwrap();
    assert_eq!((remote.content, remote.stamp.as_nanos()), (EntryContent::Remote, 100_000_000));
    let error = parse_line(b"(0.1) can0 20000204#000800000000607F").unwrap();
    let warning = ErrorFrame::new(0x204, &[0, 8, 0, 0, 0, 0, 96, 127]);
    assert_eq!(error.content, EntryContent::Error(warning));
}

#[test]
fn flags_in_an_identifier_are_taken_as_can_utils_takes_them() {
    for (frame, expected) in [
        ("98f00400#01", "18F00400#01"),
        ("80000123##001", "00000123##001"),
        ("58F00400#", "Remote"),
        ("C0000123#R4", "Remote"),
        ("A0000004#", "Error(ErrorFrame { class: 4, data: [0, 0, 0, 0, 0, 0, 0, 0] })"),
        ("F0000004   [0]", "Error(ErrorFrame { class: 268435460, data: [0, 0, 0, 0, 0, 0, 0, 0] })"),
        ("98F00400   [1]  01", "18F00400#01"),
    ] {
        assert_eq!(good(FORMAT, &[&format!("(1.5) can0 {frame}")]), [format!("1500000 can0 {expected}")]);
    }
}

#[test]
fn every_malformed_line_has_its_reason() {
    let cases = [
        ("", BadLine::NoTime),
        ("(12) can0 123#00", BadLine::NoTime),
        ("(99999999999999999999.0) can0 123#00", BadLine::NoTime),
        ("(1.0)", BadLine::NoInterface),
        ("(1.0) can0", BadLine::NoFrame),
        ("(1.0) can0 12300", BadLine::NoFrame),
        ("(1.0)can0 123#", BadLine::NoTime),
        ("(2024-03-05 24:00:00.0) can0 123#", BadLine::NoTime),
        ("(1969-12-31 23:59:59.0) can0 123#", BadLine::NoTime),
        ("(1.0) can0 123 3 00 01 02", BadLine::NoFrame),
        ("(1.0) can0 RX - -", BadLine::NoFrame),
        ("(1.0) can0 1234 [0]", BadLine::BadId),
        ("(1.0) can0 123 [x]", BadLine::BadLength),
        ("(1.0) can0 123 [65] 00", BadLine::BadLength),
        ("(1.0) can0 123 {G} 00", BadLine::BadLength),
        ("(1.0) can0 123 [2] 00", BadLine::BadData),
        ("(1.0) can0 123 [1] 100", BadLine::BadData),
        ("(1.0) can0 123 [2] 00`", BadLine::BadData),
        ("(1.0) can0 123 [1] 00000002", BadLine::BadData),
        ("(1.0) can0 123 [1] 001", BadLine::BadData),
        ("(1.0) \x1B[34m\x1B[0m 123 [0]", BadLine::NoInterface),
        ("(1.0) can0 123 [0001] 00", BadLine::CanXl),
        ("(1.0) can0 12#00", BadLine::BadId),
        ("(1.0) can0 800#00", BadLine::BadId),
        ("(1.0) can0 +23#00", BadLine::BadId),
        ("(1.0) can0 123#0", BadLine::BadData),
        ("(1.0) can0 123#0G", BadLine::BadData),
        ("(1.0) can0 123##", BadLine::BadData),
        ("(1.0) can0 20000004#R", BadLine::BadData),
        ("(1.0) can0 123#112233445566778899", BadLine::BadLength),
        ("(1.0) can0 123##0112233445566778899", BadLine::BadLength),
        ("(1.0) can0 123#11_2", BadLine::BadLength),
        ("(1.0) can0 00000123#81:00:12345678#1122", BadLine::CanXl),
    ];
    assert_refused(FORMAT, &[], &cases);
    assert_eq!(parse_line(&[b' '; 600]), Err(BadLine::TooLong));
    assert_eq!(parse_line(b"(1.0) can\xFF 123#"), Err(BadLine::NotText));
}

proptest! {
    #[test]
    fn what_a_frame_prints_is_what_is_read(
        id in 0..0x800_u32,
        extended in any::<bool>(),
        data in proptest::collection::vec(any::<u8>(), 0..=8),
        fd in any::<bool>(),
    ) {
        let id = if extended { CanId::extended(id) } else { CanId::standard(id) }.unwrap();
        let sent = if fd { Frame::fd(id, &data) } else { Frame::classic(id, &data) }.unwrap();
        prop_assert_eq!(frame(&format!("(1.5) can0 {sent}")), sent);
        let line = format!("(1.500000) can0 {sent}");
        let common = common_line(line.as_bytes());
        prop_assert_eq!(common.map(|entry| entry.content), (!fd).then_some(EntryContent::Data(sent)));
    }

    #[test]
    fn common_lines_are_read_as_all_others(
        line in r"\([0-9]{1,11}\.[0-9]{5,7}\) {1,2}[a-z\tµ]{0,16} ([0-7][0-9a-fA-F]{2}|[0-9A-F]{8})#([0-9a-fA-F]{2}){0,9}[ #RG]?",
    ) {
        if let Some(entry) = common_line(line.as_bytes()) {
            prop_assert_eq!(any_line(line.as_bytes()), Ok(entry));
        }
    }

    #[test]
    fn any_bytes_are_read_or_refused(line in proptest::collection::vec(any::<u8>(), 0..600)) {
        let _outcome = parse_line(&line);
    }
}
