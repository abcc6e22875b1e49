//! The pictures of the documentation are those that the commands in `docs/pictures/README.md` draw.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Name and arguments of each command in the table.
fn commands(readme: &str) -> Vec<(&str, Vec<&str>)> {
    let command = |row| {
        let (picture, command) = str::split_once(row, "](")?.1.split_once(") | `signal-gateway ")?;
        Some((picture, command.strip_suffix("` |")?.split(' ').collect()))
    };
    readme.lines().filter_map(command).collect()
}

#[test]
fn each_picture_is_what_its_command_draws() {
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = project.join("docs/pictures");
    let readme = fs::read_to_string(folder.join("README.md")).unwrap();
    let scratch = tempfile::tempdir().unwrap();
    let mut drawn = Vec::new();
    for (picture, arguments) in commands(&readme) {
        let (output, arguments) = arguments.split_last().unwrap();
        assert_eq!(*output, format!("docs/pictures/{picture}"));
        let again = scratch.path().join(picture);
        let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
        let done = command.args(arguments).arg(&again).current_dir(project).output().unwrap();
        assert!(done.status.success(), "{picture}: {}", String::from_utf8_lossy(&done.stderr));
        if std::env::var_os("UPDATE_DOCS").is_some() {
            fs::copy(&again, folder.join(picture)).unwrap();
        }
        let is_same = fs::read(&again).unwrap() == fs::read(folder.join(picture)).unwrap_or_default();
        assert!(is_same, "{picture}: run `UPDATE_DOCS=1 cargo test --test process pictures`");
        drawn.push(picture.to_owned());
    }
    // The first by hand, the second and third by tests of their own, `live page` and `terminal_view`.
    drawn.extend(["fleet.svg", "page.png", "terminal.svg"].map(str::to_owned));
    // By `performance_pictures`.
    let curves = ["clients", "decision", "map", "recording", "traffic_lights"];
    drawn.extend(curves.map(|curve| format!("performance_{curve}.svg")));
    drawn.sort();
    let mut there: Vec<_> = fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| !["README.md", "draw", "performance.tsv"].contains(&name.as_str()))
        .collect();
    there.sort();
    assert_eq!(there, drawn, "every picture has its command");
}
