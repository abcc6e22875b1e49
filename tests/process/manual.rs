//! The man pages and completions, which packages have beside the binary.

use super::cli::out;

#[test]
fn the_man_pages_and_completions_name_every_option_that_help_names() {
    let folder = tempfile::tempdir().unwrap();
    out(&["man", "--out", folder.path().to_str().unwrap()]);
    let bash = out(&["completions", "bash"]);
    for command in [
        "run", "demo", "replay", "check", "decode", "doctor", "lights", "decide", "vehicle", "discover",
        "init",
    ] {
        let page =
            std::fs::read_to_string(folder.path().join(format!("signal-gateway-{command}.1"))).unwrap();
        let page = page.replace("\\-", "-");
        let help = out(&[command, "--help"]);
        let options: Vec<_> = help.split_whitespace().filter(|option| option.starts_with("--")).collect();
        assert!(!options.is_empty());
        for option in options {
            // Without the form of a value that may be left out.
            let option = option.split('[').next().unwrap_or(option);
            let option = option.trim_end_matches([',', '.', ']', ';']);
            assert!(page.contains(option), "{command} {option} is not in the man page");
            assert!(bash.contains(option), "{command} {option} is not completed");
        }
    }
    let main = out(&["man"]);
    assert!(main.contains(".TH signal-gateway 1"));
    assert_eq!(std::fs::read_to_string(folder.path().join("signal-gateway.1")).unwrap(), main);
}

/// A page has the exit codes of its command, and leads to files, variables and further pages.
#[test]
fn the_man_pages_have_the_sections_that_one_looks_for() {
    let folder = tempfile::tempdir().unwrap();
    out(&["man", "--out", folder.path().to_str().unwrap()]);
    let page = |name: &str| {
        let page = std::fs::read_to_string(folder.path().join(format!("{name}.1"))).unwrap();
        page.replace("\\-", "-")
    };
    let codes = |name: &str| {
        let page = page(name);
        let section = page.split(".SH \"EXIT STATUS\"\n").nth(1).unwrap().split(".SH ").next().unwrap();
        let codes = section.lines().filter_map(|line| line.strip_prefix("\\fB")?.strip_suffix("\\fR"));
        codes.collect::<Vec<_>>().join(" ")
    };
    assert_eq!(codes("signal-gateway"), "0 1 2 3 4 5 6 7 8 9");
    assert_eq!(codes("signal-gateway-check"), "0 1 2 3 4 8 9");
    assert_eq!(codes("signal-gateway-status"), "0 2 4 7 8");
    assert_eq!(codes("signal-gateway-doctor"), "0 1 2 4 7");
    assert_eq!(codes("signal-gateway-decide"), "0 1 2 3 5");
    for name in ["signal-gateway", "signal-gateway-run"] {
        for part in [".SH FILES", "/etc/signal-gateway/gateway.toml", ".SH ENVIRONMENT", "ROS_DOMAIN_ID"] {
            assert!(page(name).contains(part), "{name}: {part}");
        }
    }
    let check = page("signal-gateway-check");
    assert!(check.contains(".SH EXAMPLES\n.nf\n  signal-gateway check --config gateway.toml"), "{check}");
    assert!(check.contains(".SH \"SEE ALSO\"\nsignal-gateway(1)"), "{check}");
}
