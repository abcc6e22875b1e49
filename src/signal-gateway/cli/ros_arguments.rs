//! Parses the arguments of ROS 2 that `ros2 run` and launch files put between `--ros-args` and `--`.

use std::borrow::Cow;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::Args;

use super::failure::Failure;
use crate::config::files::Files;
use crate::config::ros_names::{NodeNames, Remapping, RosOverrides, is_name, is_namespace, is_topic};
use crate::config::ros_parameters::{FileParameter, ParameterValue, read_parameters, read_value};
use crate::report::text::escaped;
use gateway_base::near_miss::mistyped;

const BEGIN: &str = "--ros-args";
const NAMES: [&str; 3] = ["config", "profile", "use_sim_time"];

pub(super) fn parameters() -> String {
    let [first, second, last] = NAMES;
    format!("{first}, {second} and {last}")
}

#[derive(Debug, Args)]
pub(super) struct RosArgs {
    /// Arguments of ROS 2, up to -- or the end
    #[arg(long = "ros-args", value_name = "ARGS", num_args = 0.., allow_hyphen_values = true, value_terminator = "--")]
    pub(super) arguments: Vec<OsString>,
}

#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct RosArguments {
    pub(super) overrides: RosOverrides,
    pub(super) log_level: Option<&'static str>,
    /// The parameter `config`; `--config` has priority.
    pub(super) config: Option<PathBuf>,
    /// The parameter `profile`; `--profile` has priority.
    pub(super) profile: Option<PathBuf>,
    /// Parameters that this node does not have, e.g. global parameters of a launch file.
    pub(super) unknown: Vec<String>,
    /// Accepted options that change nothing here, with an alternative.
    pub(super) without_effect: Vec<String>,
}

/// Parses the ROS 2 arguments for a node that the configuration calls `default_node`. Fails for an unknown or
/// unsupported option or rule, and for an invalid parameter file.
pub(super) fn read(files: &dyn Files, ros: &[OsString], default_node: &str) -> Result<RosArguments, Failure> {
    let mut found = RosArguments::default();
    let mut rules = Vec::new();
    let mut parameters = Vec::new();
    let mut rest = ros.iter().map(|argument| argument.to_string_lossy());
    while let Some(option) = rest.next() {
        let mut value = |form: &str| {
            let missing = || usage(&option, &format!("give {form} after it"));
            rest.next().map(Cow::into_owned).ok_or_else(missing)
        };
        let mut ignore = |rest: String| found.without_effect.push(format!("{option} {rest}"));
        match &*option {
            "-r" | "--remap" => rules.push(RemapRule::read(&value("FROM:=TO")?)?),
            "-p" | "--param" => parameters.push(GivenParameters::Value(value("NAME:=VALUE")?)),
            "--params-file" => parameters.push(GivenParameters::File(PathBuf::from(value("a file")?))),
            "--log-level" => found.set_log_level(&value("a level")?, default_node)?,
            // No library writes to the log.
            BEGIN | "--enable-stdout-logs" | "--enable-external-lib-logs" | "--disable-external-lib-logs" => {
            }
            "--enable-rosout-logs" => found.overrides.rosout = Some(true),
            "--disable-rosout-logs" => found.overrides.rosout = Some(false),
            "--disable-stdout-logs" => ignore("(--log-level fatal logs less)".to_owned()),
            "-e" | "--enclave" => ignore(value("an enclave")? + " (this node has no DDS security)"),
            "--log-config-file" => ignore(value("a file")? + " (set --log-level or RUST_LOG)"),
            "--log-file-name" => ignore(value("a name")? + " (the log goes to standard error)"),
            _ => {
                let reason = "not an argument of ROS 2 that this node follows; it follows -r, -p, --params-file and \
                              --log-level";
                return Err(usage(&option, reason));
            }
        }
    }
    found.remap(&rules, default_node)?;
    let overrides = found.overrides.clone();
    let names = NodeNames {
        node: overrides.node.as_deref().unwrap_or(default_node),
        namespace: overrides.namespace.as_deref().unwrap_or("/"),
        remappings: &[],
    };
    // The last value applies, as in rcl: launch files give global parameters before the parameters of a node.
    for given in &parameters {
        match given {
            GivenParameters::File(path) => found.adopt_file(files, path, names)?,
            GivenParameters::Value(parameter) => found.adopt_parameter(parameter, names)?,
        }
    }
    Ok(found)
}

enum GivenParameters {
    File(PathBuf),
    /// An argument `NAME:=VALUE`.
    Value(String),
}

struct RemapRule {
    /// Node to which the rule applies; `None` for all nodes.
    node: Option<String>,
    from: String,
    to: String,
}

impl RemapRule {
    fn read(text: &str) -> Result<Self, Failure> {
        let (from, to) =
            text.split_once(":=").ok_or_else(|| usage(&format!("-r {text}"), "write FROM:=TO"))?;
        let (node, from) = match from.split_once(':') {
            Some((node, from)) if !from.starts_with("//") => (Some(node.to_owned()), from),
            _ => (None, from),
        };
        Ok(Self { node, from: from.to_owned(), to: to.to_owned() })
    }

    fn is_for(&self, node: &str) -> bool {
        self.node.as_deref().is_none_or(|named| named == node)
    }

    fn wrong(&self, reason: &str) -> Failure {
        usage(&format!("-r {}:={}", self.from, self.to), reason)
    }
}

impl RosArguments {
    fn set_log_level(&mut self, given: &str, default_node: &str) -> Result<(), Failure> {
        let (logger, level) = given.split_once(":=").unwrap_or((default_node, given));
        let level = match level.to_ascii_lowercase().as_str() {
            "debug" => "debug",
            "info" => "info",
            "warn" => "warn",
            "error" | "fatal" => "error",
            "unset" => return Ok(()),
            _ => {
                let reason = format!("expected debug, info, warn, error or fatal, found {level:?}");
                return Err(usage("--log-level", &reason));
            }
        };
        // Loggers with other names belong to other nodes.
        if logger.trim_start_matches('/').replace('/', ".") == default_node {
            self.log_level = Some(level);
        }
        Ok(())
    }

    /// Applies the rules for node and namespace, then stores the topic rules for the node's new name.
    fn remap(&mut self, rules: &[RemapRule], default_node: &str) -> Result<(), Failure> {
        for rule in rules.iter().filter(|rule| rule.is_for(default_node)) {
            match rule.from.as_str() {
                "__node" | "__name" if is_name(&rule.to) => {
                    self.overrides.node.get_or_insert_with(|| rule.to.clone());
                }
                "__node" | "__name" => {
                    return Err(rule.wrong("a node's name has letters, digits and _, no digit first"));
                }
                "__ns" if is_namespace(&rule.to) => {
                    self.overrides.namespace.get_or_insert_with(|| rule.to.clone());
                }
                "__ns" => return Err(rule.wrong("write a namespace as / or /vehicle")),
                _ => {}
            }
        }
        let node = self.overrides.node.clone();
        let node = node.as_deref().unwrap_or(default_node);
        // This node has no services.
        let of_topics =
            |rule: &&RemapRule| !rule.from.starts_with("__") && !rule.from.starts_with("rosservice://");
        for rule in rules.iter().filter(of_topics).filter(|rule| rule.is_for(node)) {
            let (from, to) = (rule.from.strip_prefix("rostopic://").unwrap_or(&rule.from), &rule.to);
            if !is_topic(from) || !is_topic(to) {
                return Err(rule.wrong("write topics as /a/b, a/b or ~/a"));
            }
            self.overrides.remappings.push(Remapping { from: from.to_owned(), to: to.clone() });
        }
        Ok(())
    }

    fn adopt_file(&mut self, files: &dyn Files, path: &Path, names: NodeNames<'_>) -> Result<(), Failure> {
        for parameter in read_parameters(files, path, names)? {
            let place = format!("--params-file {}: {}", path.display(), parameter.name);
            self.adopt(&parameter, |reason| usage(&place, reason))?;
        }
        Ok(())
    }

    fn adopt_parameter(&mut self, given: &str, names: NodeNames<'_>) -> Result<(), Failure> {
        let wrong = |reason: &str| usage(&format!("-p {given}"), reason);
        let (name, value) = given.split_once(":=").ok_or_else(|| wrong("write NAME:=VALUE"))?;
        let (node, name) = name.split_once(':').map_or((None, name), |(node, name)| (Some(node), name));
        if node.is_some_and(|node| node != names.node) {
            return Ok(());
        }
        let parameter =
            FileParameter { name: name.to_owned(), value: read_value(value)?, is_for_this_node: true };
        self.adopt(&parameter, wrong)
    }

    /// Sets a parameter, or records that this node does not have it; fails if it looks like a mistyped one.
    fn adopt(&mut self, parameter: &FileParameter, wrong: impl Fn(&str) -> Failure) -> Result<(), Failure> {
        let FileParameter { name, value, is_for_this_node } = parameter;
        // A pattern applies to all nodes that have such a parameter.
        if self.set(name, value.as_ref()).map_err(&wrong)? || !is_for_this_node {
            return Ok(());
        }
        if let Some(meant) = mistyped(name, NAMES) {
            return Err(wrong(&format!("no such parameter; did you mean {meant}?")));
        }
        if !self.unknown.contains(name) {
            self.unknown.push(name.clone());
        }
        Ok(())
    }

    /// Sets a parameter; returns false if there is none with this name.
    fn set(&mut self, name: &str, value: Option<&ParameterValue>) -> Result<bool, &'static str> {
        let path = || {
            let given = value.filter(|value| !value.text.is_empty());
            given.map(|value| PathBuf::from(&value.text)).ok_or("give a path or a name")
        };
        match name {
            "use_sim_time" => {
                let is_on = value.and_then(ParameterValue::as_bool).ok_or("expected true or false")?;
                self.overrides.use_sim_time = Some(is_on);
            }
            "config" => self.config = Some(path()?),
            "profile" => self.profile = Some(path()?),
            _ => return Ok(false),
        }
        Ok(true)
    }
}

fn usage(argument: &str, reason: &str) -> Failure {
    Failure::Usage(format!("{BEGIN}: {}: {reason}", escaped(argument)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::files::TestFiles;

    const YAML: TestFiles<'_> = TestFiles(&[
        (
            "p.yaml",
            "/**: {ros__parameters: {use_sim_time: true, wheel_radius: 0.4}}\n\
             /car/left: {ros__parameters: {profile: mazda_2017, colour: red}}",
        ),
        // Output of launch_ros for `parameters` of a node, by Python's YAML.
        (
            "own.yaml",
            "/car/left:\n  ros__parameters:\n    list: !!python/tuple\n    - 1\n    - 2\n    \
             nested.x: 1.5\n    s: 'yes'\n    use_sim_time: true\n",
        ),
        // For a node without a name.
        ("any.yaml", "/**:\n  ros__parameters:\n    use_sim_time: false\n"),
        // Files of Autoware.
        (
            "vehicle_info.yaml",
            "/**:\n  ros__parameters:\n    wheel_radius: 0.383 # m\n    \
             wheel_base: 2.79\n    footprint: [1.0, 0.5]\n    mirror: {left: .nan, right: -.inf}\n    \
             qos_overrides: {/tf: {publisher: {depth: 1}}}\n",
        ),
        (
            "others.yaml",
            "/car/other:\n  ros__parameters: {use_sim_time: true}\n\
             /**/converter:\n  ros__parameters: {use_sim_time: true}\n\
             /car/:\n  left:\n    ros__parameters: {profile: kia}\n",
        ),
    ]);

    /// Arguments of nodes in a tree of launch files, as assembled by `launch_ros`, with the result in this
    /// node. Global parameters come first, then the node's own.
    #[rustfmt::skip]
    const LAUNCH_TREE: [(&str, &str); 14] = [
        // A container of composable nodes does not affect this node, and has the same global parameters.
        ("--ros-args|-r|__node:=left|-r|__ns:=/car/interface", "/car/interface left"),
        ("--log-level|info|--ros-args|-r|__node:=left|-r|__ns:=/", "/ left log=info"),
        // SetParameter(name, value): Python's own texts of numbers, truth values, tuples and strings.
        ("-p|wheel_radius:=0.383|-p|use_sim_time:=False", "sim=false unknown=wheel_radius"),
        ("-p|use_sim_time:=True|-p|sizes:=(1, 2)|-p|names:=('a', 'b')", "sim=true unknown=sizes,names"),
        ("-p|title:=a: b|-p|empty:=|-p|tilde:=~|-p|p:=/opt/a b|-p|n:=-1e-3|-p|b:=!!binary YQ==",
            "unknown=title,empty,tilde,p,n,b"),
        // Parameter(name, value): a document of YAML.
        ("-p|use_sim_time:=true\n...\n|-p|text:=x y\n...\n|-p|list:=- 1\n- 2\n",
            "sim=true unknown=text,list"),
        // Parameters of rclcpp and rclpy, for each node.
        ("-p|start_type_description_service:=False|-p|use_intra_process_comms:=true|-p|qos_overrides./tf.publisher.depth:=1",
            "unknown=start_type_description_service,use_intra_process_comms,qos_overrides./tf.publisher.depth"),
        // SetParametersFromFile: a pattern applies to all nodes that have such a parameter.
        ("--params-file|vehicle_info.yaml|-p|wheel_radius:=0.4|-p|wheel_radius:=0.5", "unknown=wheel_radius"),
        // The node's own parameters come later and win; as in rcl, in any form.
        ("-r|__node:=left|-r|__ns:=/car|-p|use_sim_time:=False|--params-file|own.yaml",
            "/car left sim=true unknown=list,nested.x,s"),
        ("-p|use_sim_time:=True|--params-file|any.yaml", "sim=false"),
        ("--params-file|any.yaml|-p|use_sim_time:=True", "sim=true"),
        ("-r|__node:=left|-r|__ns:=/car|--params-file|others.yaml", "/car left profile=kia"),
        // SetRemap: the first one wins.
        ("-r|/tf:=tf|-r|~/input/odometry:=/localization/kinematic_state|-r|a/b:=~/c|-r|rosservice://~/get:=/g",
            "/tf>tf ~/input/odometry>/localization/kinematic_state a/b>~/c"),
        ("-p|a:=1|--ros-args|--enable-rosout-logs|--log-level|rcl:=DEBUG|--log-level|signal_gateway:=WARN",
            "log=warn unknown=a"),
    ];

    fn summary(read: &RosArguments) -> String {
        let RosOverrides { node, namespace, remappings, use_sim_time, .. } = &read.overrides;
        let remapped = remappings.iter().map(|rule| format!("{}>{}", rule.from, rule.to));
        let path = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
        let unknown = (!read.unknown.is_empty()).then(|| read.unknown.join(","));
        let named = [
            ("sim", use_sim_time.map(|is_on| is_on.to_string())),
            ("log", read.log_level.map(str::to_owned)),
            ("config", path(&read.config)),
            ("profile", path(&read.profile)),
            ("unknown", unknown),
        ];
        let named = named.into_iter().filter_map(|(name, value)| Some(format!("{name}={}", value?)));
        let names = [namespace, node].into_iter().flatten().cloned();
        names.chain(remapped).chain(named).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn arguments_of_a_tree_of_launch_files_are_followed() {
        for (line, expected) in LAUNCH_TREE {
            let arguments: Vec<_> = line.split('|').map(OsString::from).collect();
            let read = read(&YAML, &arguments, "signal_gateway").map_err(|failure| failure.to_string());
            assert_eq!(read.as_ref().map(summary), Ok(expected.to_owned()), "{line}");
        }
    }

    fn of(line: &str) -> Result<RosArguments, String> {
        let arguments: Vec<_> = line.split_whitespace().map(OsString::from).collect();
        read(&YAML, &arguments, "signal_gateway").map_err(|failure| failure.to_string())
    }

    #[test]
    fn a_node_of_a_launch_file_is_named_remapped_and_given_parameters() {
        assert_eq!((of("").unwrap(), of("--ros-args").unwrap()), Default::default());
        let read = of("-r __node:=left -r __ns:=/car --params-file p.yaml -r status:=/s -r left:~/a:=b \
             -r signal_gateway:c:=d -r rostopic:///e:=f -r rosservice:///g:=h -r __node:=late \
             -p config:=x.toml -p left:profile:=kia -p other:profile:=y --log-level other:=debug --log-level WARN --disable-rosout-logs")
        .unwrap();
        let rule = |from: &str, to: &str| Remapping { from: from.into(), to: to.into() };
        let expected = RosArguments {
            overrides: RosOverrides {
                node: Some("left".into()),
                namespace: Some("/car".into()),
                remappings: vec![rule("status", "/s"), rule("~/a", "b"), rule("/e", "f")],
                use_sim_time: Some(true),
                rosout: Some(false),
            },
            log_level: Some("warn"),
            config: Some("x.toml".into()),
            profile: Some("kia".into()),
            unknown: vec!["colour".into()],
            without_effect: vec![],
        };
        assert_eq!(read, expected);
    }

    #[test]
    fn what_a_launch_tree_gives_to_all_nodes_is_taken() {
        let read = of(
            "-p use_sim_time:=False -p wheel_radius:=0.383 -p vehicle_info.sizes:=[1,2] --log-file-name a \
             --disable-stdout-logs -e /car --log-config-file b",
        )
        .unwrap();
        assert_eq!(read.overrides.use_sim_time, Some(false));
        assert_eq!(read.unknown, ["wheel_radius", "vehicle_info.sizes"]);
        let names: Vec<_> = read.without_effect.iter().map(|text| text.split(" (").next().unwrap()).collect();
        assert_eq!(names, ["--log-file-name a", "--disable-stdout-logs", "-e /car", "--log-config-file b"]);
    }

    #[test]
    fn what_is_not_followed_is_refused_by_name() {
        for (line, expected) in [
            ("-r", "--ros-args: -r: give FROM:=TO after it"),
            ("-r a=b", "--ros-args: -r a=b: write FROM:=TO"),
            ("-r a:=b-c", "-r a:=b-c: write topics as"),
            ("-r __node:=1", "a node's name has"),
            ("-r __ns:=car", "write a namespace as / or /vehicle"),
            ("-p use_sim_time:=1", "expected true or false"),
            ("-p confg:=a", "-p confg:=a: no such parameter; did you mean config?"),
            ("-p use_sim_time:='true'", "expected true or false"),
            ("-p config:=[", "--param"),
            ("-p config:=", "give a path"),
            ("--params-file none.yaml", "none.yaml: there is no such file"),
            ("--log-level loud", "expected debug, info, warn, error or fatal, found \"loud\""),
            ("-e", "-e: give an enclave after it"),
            ("--colour", "--colour: not an argument of ROS 2 that this node follows"),
        ] {
            let refused = of(line).unwrap_err();
            assert!(refused.contains(expected), "{line}: {refused}");
        }
    }
}
