//! `doctor` as a process: set-ups that are broken without a bus, each mended as its remedy says.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::Command;

use crate::support::doctor::{Diagnosis, doctor, examine};
use crate::support::process::Folder;
use crate::support::program;

fn folder(keys: &str) -> Folder {
    Folder::with_demo_vehicle("nosuchcan7", &format!("[ros]\nenabled = false\n{keys}"))
}

/// `doctor` for `gateway.toml`, held to the permissions of files, also where the test is root.
fn examine_without_override(folder: &Folder) -> Diagnosis {
    let usual = doctor(folder.path(), &["--config", "gateway.toml", "--seconds", "0.1"]);
    folder.write("probe", "");
    set_mode(&folder.path().join("probe"), 0o000);
    if fs::File::open(folder.path().join("probe")).is_err() {
        return Diagnosis::of(&mut { usual });
    }
    let mut command = Command::new("setpriv");
    command.args(["--bounding-set", "-dac_override,-dac_read_search", "--inh-caps", "-all"]);
    command.arg(usual.get_program()).args(usual.get_args()).current_dir(folder.path());
    Diagnosis::of(&mut command)
}

fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
}

#[test]
fn configuration_that_may_not_be_read_is_readable_after_its_remedy() {
    let folder = folder("");
    let path = folder.path().join("gateway.toml");
    set_mode(&path, 0o000);
    let broken = examine_without_override(&folder);
    broken.assert_found("configuration_unreadable", "chmod a+r gateway.toml");
    assert_eq!(broken.whole["facts"]["configuration"]["problem"], "denied");
    set_mode(&path, 0o644);
    examine_without_override(&folder).assert_mended("configuration_unreadable");
}

#[test]
fn folder_that_may_not_be_written_is_writable_after_its_remedy() {
    let folder = folder("[black_box]\nfolder = \"kept/black-box\"\n");
    let kept = folder.path().join("kept");
    fs::create_dir(&kept).unwrap();
    set_mode(&kept, 0o555);
    examine_without_override(&folder).assert_found("folder_not_writable", "sudo install -d -o USER");
    set_mode(&kept, 0o755);
    examine_without_override(&folder).assert_mended("folder_not_writable");
    assert_eq!(fs::read_dir(&kept).unwrap().count(), 0, "doctor makes nothing");
}

#[test]
fn refused_configuration_leads_to_check_and_a_missing_one_to_init() {
    let folder = folder("");
    let sound = fs::read_to_string(folder.path().join("gateway.toml")).unwrap();
    folder.write("gateway.toml", &sound.replace("profile", "profil"));
    examine(folder.path())
        .assert_found("configuration_refused", "signal-gateway check --config gateway.toml");
    folder.write("gateway.toml", &sound);
    examine(folder.path()).assert_mended("configuration_refused");
    fs::remove_file(folder.path().join("gateway.toml")).unwrap();
    examine(folder.path()).assert_found("configuration_missing", "signal-gateway init");
}

/// A `systemctl` that answers as systemd 252 does.
#[test]
fn service_that_has_failed_is_found_until_it_runs() {
    let folder = folder("");
    let examine = |active: &str, code: u8| {
        let answer = format!(
            "#!/bin/sh\ncat <<'END'\nExecMainStatus={code}\nMainPID=0\nLoadState=loaded\nActiveState={active}\n\
             UnitFileState=enabled\nExecStart={{ path=/usr/local/bin/signal-gateway ; \
             argv[]=/usr/local/bin/signal-gateway run --config gateway.toml ; ignore_errors=no }}\nEND\n"
        );
        folder.write("systemctl", &answer);
        set_mode(&folder.path().join("systemctl"), 0o755);
        let mut command = doctor(folder.path(), &["--config", "gateway.toml", "--seconds", "0.1"]);
        let path = format!("{}:{}", folder.path().display(), std::env::var("PATH").unwrap());
        Diagnosis::of(command.env("PATH", path))
    };
    examine("failed", 3).assert_found("service_failed", "signal-gateway check explains");
    let running = examine("active", 0);
    running.assert_mended("service_failed");
    running.assert_mended("service_other_file");
}

#[test]
fn variables_of_the_shell_that_do_not_fit_are_found() {
    let folder =
        Folder::with_demo_vehicle("nosuchcan7", "[ros]\ndomain_id = 42\nonly_networks = [\"127.0.0.1\"]\n");
    let with = |name: &str, value: &str| {
        let mut command = doctor(folder.path(), &["--config", "gateway.toml", "--seconds", "0.1"]);
        Diagnosis::of(command.env("ROS_DOMAIN_ID", "42").env(name, value))
    };
    with("ROS_DOMAIN_ID", "7").assert_found("other_domain_in_shell", "export ROS_DOMAIN_ID=42");
    with("ROS_DOMAIN_ID", "42").assert_mended("other_domain_in_shell");
    with("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
        .assert_found("other_middleware", "[ros] transport = \"zenoh\"");
    with("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp").assert_mended("other_middleware");
    with("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF").assert_found("variable_refused", "unset it");
}

#[test]
fn text_names_each_finding_with_its_reason_and_its_remedy() {
    let folder = folder("");
    let ran =
        program::run(folder.path(), &["doctor", "--config", "gateway.toml", "--seconds", "0.1", "--quiet"]);
    ran.assert(7, "ERROR  interface         nosuchcan7: there is no interface of that name\n");
    for label in [
        "why:    no frame arrives",
        "remedy: plug the adapter in",
        "see:    docs/troubleshooting.md#no-reports",
    ] {
        assert!(ran.out.contains(label), "{label}\n{}", ran.out);
    }
    assert!(!ran.out.contains("not checked: "), "only findings with --quiet\n{}", ran.out);
    let all = program::run(folder.path(), &["doctor", "--interface", "nosuchcan7", "--seconds", "0.1"]);
    all.assert(7, "-      configuration     not checked: no configuration was given");
    program::run(folder.path(), &["doctor", "--scan", "can0", "--interface", "can0"])
        .assert(2, "cannot be used with");
}
