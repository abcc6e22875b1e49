//! Warnings of the daemon on `/rosout`.

use crate::dds::daemon_on_ros::Bench;
use crate::dds::daemon_on_ros::peer::{DIAGNOSTICS, ENDPOINTS, ROSOUT};
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;
use crate::support::process::Process;

const KEYS: &str =
    "scenario = \"crossing.xosc\"\nmap = \"crossroads.osm\"\ninputs.command = \"/lights/command\"\n";
/// So many that ten of them come within some seconds, however slow the machine, and that all may wait.
const REFUSED: u64 = 60;

#[test]
fn warnings_arrive_with_their_place_from_the_start_on_and_many_of_a_kind_are_folded() {
    let bench = require!(Bench::new(KEYS));
    let reader = bench.reader(&[ROSOUT]);
    let _gateway = Process::start(bench.folder.path(), |command| {
        command.args(["run", "--config", "gateway.toml", "--ros-args", "-r", "/diagnostic:=/else"]);
    });
    reader.wait(Mark::START, "rosout", "a warning from before the network was joined", |data| {
        data["msg"].as_str()?.contains("-r /diagnostic:=/else has no effect").then_some(())
    });
    let commands = bench.writer(&[("text", "lights/command")]);
    (0..REFUSED).for_each(|_| commands.send(0, "Nonsense(A)"));
    let (mut lines, mut folded, mut places) = (0, 0, vec![]);
    reader.wait(Mark::START, "rosout", "all refusals", |data| {
        let text = data["msg"].as_str()?;
        if text.starts_with("a command was refused: ") {
            lines += 1;
            places.push((data["file"].clone(), data["function"].clone(), data["line"].as_u64()?));
        } else if let Some((count, _)) = text.strip_prefix("log: ").and_then(|text| text.split_once(" more "))
        {
            // A command that is late by a quiet second has a summary of its own.
            folded += if count == "once" { 1 } else { count.parse().unwrap() };
        }
        (lines + folded >= REFUSED).then_some(())
    });
    assert!(folded > 0 && lines + folded == REFUSED, "{lines} lines, {folded} folded");
    for (file, module, line) in places {
        assert_eq!(
            (file, module),
            ("src/signal-gateway/daemon/outputs.rs".into(), "signal_gateway::daemon::outputs".into())
        );
        assert!(line > 0);
    }
}

#[test]
fn rosout_can_be_left_out() {
    let bench = require!(Bench::new(KEYS));
    let configuration = std::fs::read_to_string(bench.folder.path().join("gateway.toml")).unwrap();
    bench.folder.write("gateway.toml", &configuration.replacen("[ros]\n", "[ros]\nrosout = false\n", 1));
    let reader = bench.reader(&[ENDPOINTS, DIAGNOSTICS]);
    let _gateway = bench.run();
    reader.wait(Mark::START, "diagnostics", "a sample", |_| Some(()));
    let topics: Vec<_> =
        reader.samples(Mark::START, "endpoints").iter().map(|line| line["data"]["topic"].clone()).collect();
    assert!(topics.contains(&"rt/diagnostics".into()) && !topics.contains(&"rt/rosout".into()), "{topics:?}");
}
