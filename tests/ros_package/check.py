"""The installed package, by what it is for: found, described, launched. Run in the environment of the workspace."""

import ast
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

import yaml
from catkin_pkg.package import parse_package

PROJECT = pathlib.Path(sys.argv[1])
# Attributes of launch_xml's elements, as its parser knows them.
KNOWN = {
    "arg": {"name", "default", "description"},
    "node": {"pkg", "exec", "name", "namespace", "args", "ros_args", "output", "respawn", "respawn_delay"},
    "remap": {"from", "to"},
}


def share_folder():
    """The share folder of the package, found as ament_index finds it."""
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        if (pathlib.Path(prefix) / "share/ament_index/resource_index/packages/signal_gateway").exists():
            return pathlib.Path(prefix) / "share/signal_gateway"
    raise AssertionError("AMENT_PREFIX_PATH leads to no package signal_gateway")


def launch_arguments(share):
    """Name and default of the arguments, which both launch files have to declare alike."""
    root = ElementTree.parse(share / "launch/signal_gateway.launch.xml").getroot()
    for element in root.iter():
        if element is not root:
            unknown = set(element.attrib) - KNOWN[element.tag]
            assert not unknown, f"launch_xml does not know {unknown} of {element.tag}"
    declared = [(arg.get("name"), arg.get("default"), arg.get("description")) for arg in root.iter("arg")]
    tree = ast.parse((share / "launch/signal_gateway.launch.py").read_text())
    values = {
        node.targets[0].id: node.value for node in tree.body if isinstance(node, ast.Assign)
    }
    constants = {name: value.value for name, value in values.items() if isinstance(value, ast.Constant)}
    of_python = [
        tuple(constants[part.id] if isinstance(part, ast.Name) else part.value for part in entry.elts)
        for entry in values["ARGUMENTS"].elts
    ]
    assert declared == of_python, f"the launch files differ:\n{declared}\n{of_python}"
    return root, {name: default for name, default, _ in declared}


# What a tree of launch files such as Autoware's has for all nodes: files, SetParameter and SetRemap.
GLOBAL_FILE = """/**:
  ros__parameters:
    wheel_base: 2.79 # m
    mirrors: {left: 0.1, right: 0.1}
    footprint: !!python/tuple [1.0, 0.5]
/**/converter:
  ros__parameters: {use_sim_time: yes}
"""
GLOBAL_PARAMETERS = {
    "use_sim_time": False,
    "wheel_radius": 0.383,
    "sizes": (1, 2),
    "vehicle_model": "sample vehicle",
    "start_type_description_service": True,
}
GLOBAL_REMAPS = [("/tf", "tf"), ("~/input/odometry", "/localization/kinematic_state")]


def command_line(share, root, values, global_file):
    """The command line of the node in such a tree, put together as launch_ros does it (compared with launch_ros 0.28)."""

    def filled(text):
        for name, value in values.items():
            text = text.replace(f"$(var {name})", value)
        assert "$(" not in text, f"not filled: {text}"
        return text

    node = root.find("node")
    program = share.parent.parent / "lib" / node.get("pkg") / node.get("exec")
    line = [str(program), *filled(node.get("args")).split(), "--ros-args", *filled(node.get("ros_args")).split()]
    line += ["--ros-args", "-r", f"__node:={values['name']}", "-r", f"__ns:={values['namespace']}"]
    global_file.write_text(GLOBAL_FILE)
    line += ["--params-file", str(global_file)]
    for name, value in GLOBAL_PARAMETERS.items():
        line += ["-p", f"{name}:={value}"]
    own_remaps = [(filled(remap.get("from")), filled(remap.get("to"))) for remap in node.iter("remap")]
    for source, target in GLOBAL_REMAPS + own_remaps:
        line += ["-r", f"{source}:={target}"]
    return line


def main():
    share = share_folder()
    package = parse_package(share / "package.xml")
    version = subprocess.run(
        [share.parent.parent / "lib/signal_gateway/signal-gateway", "--version"], check=True, capture_output=True, text=True
    ).stdout
    assert package.version in version, f"package.xml says {package.version}, the program {version}"
    root, defaults = launch_arguments(share)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "gateway.toml").write_text(
            f'profile = "{PROJECT}/config/vehicles/demo_vehicle.toml"\nsource = "recording"\n[can.body]\ninterface = "can0"\n'
            f'[recording]\nfile = "{PROJECT}/config/demo.log.gz"\nspeed = 100.0\n[ros]\nenabled = false\n'
        )
        values = defaults | {"config": str(folder / "gateway.toml"), "name": "lights", "namespace": "/car"}
        line = command_line(share, root, values, folder / "vehicle_info.param.yaml")
        print("started:", " ".join(line))
        process = subprocess.Popen(line, stderr=subprocess.PIPE, text=True)
        log = []
        while not log or log[-1] and "has ended" not in log[-1]:
            log.append(process.stderr.readline())
        process.terminate()
        log.append(process.stderr.read())
        code = process.wait(timeout=60)
        assert log[-2] and code == 0, f"exit code {code}: {log}"
        foreign = ", ".join(name for name in GLOBAL_PARAMETERS if name != "use_sim_time")
        assert any(f"parameters without effect: {foreign};" in text for text in log), log
        wrong = subprocess.run([*line, "-p", "use_sim_tim:=true"], capture_output=True, text=True, timeout=60)
        assert wrong.returncode == 2 and "use_sim_time" in wrong.stderr, wrong
    yaml.safe_load((share / "config/diagnostic_aggregator.yaml").read_text())
    graph = yaml.safe_load((share / "config/autoware_diagnostic_graph.yaml").read_text())["units"]
    paths = {unit["path"] for unit in graph}
    links = {entry["link"] for unit in graph for entry in unit.get("list", [])}
    assert links == paths - {graph[0]["path"]}, "links and units of the diagnostic graph differ"
    statuses = (PROJECT / "docs/diagnostics.md").read_text()
    for unit in graph[1:]:
        assert f"`{unit['name']}`" in statuses, f"no status {unit['name']}"
    configuration = (share / "config/gateway.toml").read_text()
    perspective = json.loads((share / "config/signal_gateway.perspective").read_text())
    plugins = ast.literal_eval(perspective["groups"]["pluginmanager"]["keys"]["running-plugins"]["repr"])
    assert plugins and all(re.fullmatch(r"rqt_\w+/\w+", plugin) for plugin in plugins), plugins
    displays = yaml.safe_load((share / "config/signal_gateway.rviz").read_text())["Visualization Manager"]["Displays"]
    topics = {display["Topic"]["Value"] for display in displays} - {"/map/vector_map_marker"}
    assert all(f'"{topic}"' in configuration for topic in topics), f"RViz shows topics that no configuration has: {topics}"
    print(f"{package.name} {package.version}: found, launched, {len(links)} units of diagnostics")


main()
