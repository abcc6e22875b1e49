//! The recipe of `docs/ci.md`: the commands that the page contains are run as they stand there.
//! `UPDATE_DOCS=1 cargo test --test process ci_recipe` renews its table of findings.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::Value;
use signal_gateway::check::KINDS;

const MARKS: [&str; 2] = ["<!-- begin kinds -->\n", "<!-- end kinds -->\n"];

fn page() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/ci.md")
}

fn page_text() -> String {
    fs::read_to_string(page()).unwrap()
}

/// The code blocks of a language, in the order of the page.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let begin = format!("```{language}\n");
    text.split(&begin).skip(1).map(|rest| rest.split_once("```").unwrap().0.to_owned()).collect()
}

/// A repository as the page describes it, with a small car and a recording without faults.
fn repository() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    let dbc = "VERSION \"\"\nBO_ 193 LIGHTS: 1 X\n SG_ TURN : 0|2@1+ (1,0) [0|3] \"\" X\n SG_ HAZARD : 2|1@1+ (1,0) [0|1] \"\" X\n";
    let profile = "name = \"Car\"\n[bus.body]\ndbc = \"car.dbc\"\n[message.LIGHTS]\ntimeout_ms = 500\n\
                   [turn]\nsignal = \"LIGHTS.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n\
                   [hazard]\nfrom = \"signal\"\nsignal = \"LIGHTS.HAZARD\"\noff = [0]\non = [1]\n";
    let mut drive = String::new();
    for step in 0_u32..200 {
        let state = [0, 1, 0, 2, 4][(step / 40) as usize];
        writeln!(drive, "({}.{}00000) can0 0C1#{state:02X}", 1 + step / 10, step % 10).unwrap();
    }
    let configuration = "profile = \"car.toml\"\n[can.body]\ninterface = \"can0\"\n";
    let texts = [("car.dbc", dbc), ("car.toml", profile), ("gateway.toml", configuration)];
    for (name, text) in texts {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let mut log =
        GzEncoder::new(fs::File::create(folder.path().join("drive.log.gz")).unwrap(), Compression::fast());
    log.write_all(drive.as_bytes()).unwrap();
    log.finish().unwrap();
    for name in ["ci", "bin"] {
        fs::create_dir(folder.path().join(name)).unwrap();
    }
    let program = project.join(env!("CARGO_BIN_EXE_signal-gateway"));
    symlink(program, folder.path().join("bin/signal-gateway")).unwrap();
    // The wheel is made by `packaging`; here its installation is a command that does nothing.
    fs::write(folder.path().join("bin/pip"), "#!/bin/sh\nexit 0\n").unwrap();
    let executable = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    fs::set_permissions(folder.path().join("bin/pip"), executable).unwrap();
    folder
}

/// Runs lines of the page in the repository, and returns whether they succeeded, and what they printed.
fn shell(folder: &Path, lines: &str) -> (bool, String) {
    let path = format!("{}:{}", folder.join("bin").display(), std::env::var("PATH").unwrap());
    let output = Command::new("sh")
        .args(["-e", "-c", lines])
        .current_dir(folder)
        .env("PATH", path)
        .env_remove("RUST_LOG")
        .output()
        .unwrap();
    let printed = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8(printed).unwrap())
}

/// The shell lines of a job: the values of `run:` on GitHub, and the items of `script:` on GitLab.
fn job_lines(yaml: &str) -> String {
    let lines = yaml.lines().map(str::trim).filter_map(|line| {
        line.strip_prefix("- run: ").or_else(|| line.strip_prefix("- ").filter(|line| !line.contains(": ")))
    });
    lines.map(|line| line.to_owned() + "\n").collect()
}

#[test]
fn the_commands_of_the_page_pass_for_a_sound_profile_and_fail_for_a_changed_one() {
    let text = page_text();
    let [golden, script] = <[String; 2]>::try_from(blocks(&text, "sh")).unwrap();
    let jobs = blocks(&text, "yaml").iter().map(|job| job_lines(job)).collect::<Vec<_>>();
    let expected = "pip install ci/signal_gateway-*.whl\nsh ci/profile.sh\n";
    assert_eq!(jobs, [expected, expected]);
    let folder = repository();
    let folder = folder.path();
    assert_eq!(shell(folder, &golden), (true, String::new()));
    fs::write(folder.join("ci/profile.sh"), script).unwrap();
    for job in &jobs {
        let (is_sound, printed) = shell(folder, job);
        assert!(is_sound && printed.contains("0 errors, 0 warnings"), "{printed}");
    }
    // A changed meaning: the check is content, and the golden file is not.
    let profile = fs::read_to_string(folder.join("car.toml")).unwrap();
    let exchanged = profile.replace("left = [1]\nright = [2]", "left = [2]\nright = [1]");
    fs::write(folder.join("car.toml"), exchanged).unwrap();
    let (is_sound, printed) = shell(folder, &jobs[0]);
    assert!(!is_sound && printed.contains("\n> {\"t\""), "{printed}");
    // A missing meaning: the check finds it.
    fs::write(folder.join("car.toml"), profile.replace("right = [2]", "right = [3]")).unwrap();
    let (is_sound, printed) = shell(folder, &jobs[1]);
    assert!(!is_sound && printed.contains("warning ") && !printed.contains("> {"), "{printed}");
}

#[test]
fn the_page_lists_every_kind_of_finding() {
    let mut table = "| kind | severity | found | remedy |\n|---|---|---|---|\n".to_owned();
    for row in &KINDS {
        let Value::String(name) = serde_json::to_value(row.kind).unwrap() else { panic!() };
        writeln!(table, "| `{name}` | {} | {} | {} |", row.severity, row.meaning, row.remedy).unwrap();
    }
    let text = page_text();
    let (before, rest) = text.split_once(MARKS[0]).unwrap();
    let (shown, after) = rest.split_once(MARKS[1]).unwrap();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        let [begin, end] = MARKS;
        fs::write(page(), format!("{before}{begin}{table}{end}{after}")).unwrap();
    } else {
        assert_eq!(shown, table, "renew it: UPDATE_DOCS=1 cargo test --test process ci_recipe");
    }
}
