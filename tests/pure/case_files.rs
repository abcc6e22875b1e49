//! Mistakes in a file of cases are found, so that no case is left out in silence.

use crate::support::cases::cases;
use crate::support::files::MemoryFiles;

#[test]
fn a_mistake_in_a_file_of_cases_is_named_with_its_line() {
    let sound = MemoryFiles::new([("a", "one\ntwo\ntwo\n# here\n")]);
    for (text, expected) in [
        ("", Err("0: no case at the end")),
        ("=== g\n", Err("1: no case at the end")),
        ("=== g\n=== h\nin a\n\n+ x\n>\n", Err("2: the group before has no case")),
        ("in a\n\n+ x\n>\n", Err("3: a case in front of all groups")),
        ("=== g\nin a\n\n+ x\n", Err("4: a case without an answer")),
        (
            "=== g\nin a\n\n+ x\n>\n\nx\n",
            Err("7: a line of a case begins with one of \"|\", \" \", \"-\", \"+\", \"$\", \">\""),
        ),
        ("=== g\nin b\n\n+ x\n>\n", Err("4: no file \"b\"")),
        ("=== g\nin a\n\n- three\n>\n", Err("4: these lines are 0 times in a: \nthree\n")),
        ("=== g\nin a\n\n- two\n>\n", Err("4: these lines are 2 times in a: \ntwo\n")),
        (
            "=== g\nin a\n\n  one\n+ x\n>\n+ y\n>\n",
            Ok(["one\nx\ntwo\ntwo\n# here\n", "one\ntwo\ntwo\ny\n# here\n"]),
        ),
        ("=== g\nin a\n- one\n\n+ x\n>\n=== h\nin a\n\n| z\n>\n", Ok(["two\ntwo\nx\n# here\n", "z\n"])),
    ] {
        let lines: Vec<_> = text.lines().collect();
        let texts = cases(&lines, &sound)
            .map(|cases| cases.iter().map(|case| case.files.text("a").to_owned()).collect::<Vec<_>>());
        match expected {
            Ok(expected) => assert_eq!(texts.unwrap(), expected, "{text}"),
            Err(expected) => assert_eq!(texts.unwrap_err(), expected, "{text}"),
        }
    }
}
