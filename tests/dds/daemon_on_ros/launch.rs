//! The gateway as `launch_ros` starts a node: names, remapped topics and a file of parameters after
//! `--ros-args`.

use signal_gateway::io::ros::session::DISTRO;

use crate::dds::daemon_on_ros::Bench;
use crate::dds::daemon_on_ros::peer::DIAGNOSTICS;
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;
use crate::support::process::Process;

#[test]
fn a_node_stays_outside_the_graph_of_the_distribution_that_is_sourced() {
    let bench = require!(Bench::new("scenario = \"crossing.xosc\"\nmap = \"crossroads.osm\"\n"));
    let reader = bench.reader(&[DIAGNOSTICS]);
    let other = if DISTRO == "humble" { "jazzy" } else { "humble" };
    let mut gateway = Process::start(bench.folder.path(), |command| {
        command.args(["run", "--config", "gateway.toml"]).env("ROS_DISTRO", other);
    });
    reader.wait(Mark::START, "diagnostics", "the state of the graph", |data| {
        let mut statuses = data["status"].as_array()?.iter();
        let status = statuses.find(|status| status["name"] == "signal_gateway: ros")?;
        status["message"].as_str()?.starts_with("joined, but not in the graph").then_some(())
    });
    println!("SIGTERM: {:?}", gateway.stop("TERM"));
}

#[test]
fn a_launch_file_names_the_node_and_its_topics() {
    let keys = "scenario = \"crossing.xosc\"\nmap = \"crossroads.osm\"\ntopics.camera = \"~/camera\"\n";
    let bench = require!(Bench::new(keys));
    bench.folder.write(
        "launch.yaml",
        "/**:\n  ros__parameters:\n    use_sim_time: false\n    wheel_radius: 0.4\n\
         /car/lights:\n  ros__parameters:\n    config: gateway.toml\n    colour: red\n",
    );
    bench.folder.write("empty.yaml", "");
    let truth = ("array_v1", "truth", "car/truth");
    let camera = ("groups", "camera", "car/lights/camera");
    let reader = bench.reader(&[truth, camera, DIAGNOSTICS]);
    let mut gateway = Process::start(bench.folder.path(), |command| {
        command.args(["run", "--ros-args", "-r", "__node:=lights", "-r", "__ns:=/car"]);
        command.args(["-r", "/simulation/traffic_lights:=truth", "-r", "nothing:=else"]);
        command.args(["-r", "/diagnostic:=/else"]);
        command.args(["--params-file", "launch.yaml", "--log-level", "info"]);
        // What launch files give to every node.
        let all = "-p use_sim_time:=False -p wheel_radius:=0.383 --params-file empty.yaml --log-file-name x \
            --disable-stdout-logs -e /car --log-config-file y";
        command.args(all.split_whitespace());
    });
    for name in ["truth", "camera"] {
        reader.wait(Mark::START, name, "a sample", |_| Some(()));
    }
    reader.wait(Mark::START, "diagnostics", "the node's own name", |data| {
        let name = data["status"].as_array()?.first()?["name"].as_str()?;
        name.starts_with("lights: ").then_some(())
    });
    let own = "this node has config, profile and use_sim_time";
    gateway.wait_for_log(&format!("parameters without effect: colour, wheel_radius; {own}"));
    gateway.wait_for_log("without effect: --log-file-name x (");
    gateway.wait_for_log("INFO -r nothing:=else has no effect: this node has no topic nothing");
    gateway.wait_for_log("WARN -r /diagnostic:=/else has no effect: this node has no topic /diagnostic; did you mean /diagnostics?");
    println!("SIGTERM: {:?}", gateway.stop("TERM"));
}
