//! Names of ROS 2: validity, resolution of relative and private names, and remapping.

/// Settings of a node that its command line replaces.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RosOverrides {
    /// Name of the node.
    pub node: Option<String>,
    /// Namespace, `/` or `/name`.
    pub namespace: Option<String>,
    /// Remapped topics; the first matching rule applies.
    pub remappings: Vec<Remapping>,
    /// Value of the parameter `use_sim_time`.
    pub use_sim_time: Option<bool>,
    /// True if warnings and errors go to `/rosout`.
    pub rosout: Option<bool>,
}

/// A rule of `--remap`: the topic `from` is called `to`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remapping {
    /// Topic name in this node; absolute, relative or private.
    pub from: String,
    /// New name; absolute, relative or private.
    pub to: String,
}

/// A node, for resolving topic names.
#[derive(Debug, Clone, Copy)]
pub struct NodeNames<'a> {
    /// Name of the node.
    pub node: &'a str,
    /// Namespace, `/` or `/name`.
    pub namespace: &'a str,
    /// Rules, of which the first matching one applies.
    pub remappings: &'a [Remapping],
}

impl NodeNames<'_> {
    /// Returns the absolute name of a topic, after remapping. An empty name stays empty: the topic does not
    /// exist.
    pub fn resolve(&self, topic: &str) -> String {
        if topic.is_empty() {
            return String::new();
        }
        let absolute = self.absolute(topic);
        let rule = self.remappings.iter().find(|rule| self.absolute(&rule.from) == absolute);
        rule.map_or(absolute, |rule| self.absolute(&rule.to))
    }

    /// Returns true if a rule applies to this topic.
    pub fn concerns(&self, rule: &Remapping, topic: &str) -> bool {
        !topic.is_empty() && self.absolute(&rule.from) == self.absolute(topic)
    }

    /// Returns the name of the node with its namespace.
    pub fn full_name(&self) -> String {
        below(self.namespace, self.node)
    }

    fn absolute(&self, topic: &str) -> String {
        if topic.starts_with('/') {
            topic.to_owned()
        } else if let Some(private) = topic.strip_prefix("~/") {
            below(&self.full_name(), private)
        } else {
            below(self.namespace, topic)
        }
    }
}

fn below(namespace: &str, name: &str) -> String {
    format!("{}/{name}", namespace.trim_end_matches('/'))
}

/// Returns true for a valid topic in configurations and command lines: `/a/b`, `a/b` or `~/a`.
pub fn is_topic(topic: &str) -> bool {
    let tokens = topic.strip_prefix('/').or_else(|| topic.strip_prefix("~/")).unwrap_or(topic);
    tokens.split('/').all(is_name)
}

/// Returns true for `/` and absolute names such as `/vehicle`.
pub fn is_namespace(namespace: &str) -> bool {
    namespace.strip_prefix('/').is_some_and(|rest| rest.is_empty() || rest.split('/').all(is_name))
}

/// Returns true for the name of a node, and for one token of a topic.
pub fn is_name(name: &str) -> bool {
    name.chars().next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
        && name.chars().all(|char| char.is_ascii_alphanumeric() || char == '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rule(from: &str, to: &str) -> Remapping {
        Remapping { from: from.to_owned(), to: to.to_owned() }
    }

    #[test]
    fn relative_and_private_topics_follow_the_namespace() {
        for (namespace, topic, expected) in [
            ("/", "/a/b", "/a/b"),
            ("/", "a/b", "/a/b"),
            ("/", "~/a", "/node/a"),
            ("/car", "/a/b", "/a/b"),
            ("/car", "a/b", "/car/a/b"),
            ("/car/left", "~/a", "/car/left/node/a"),
            ("/car", "", ""),
        ] {
            let names = NodeNames { node: "node", namespace, remappings: &[] };
            assert_eq!(names.resolve(topic), expected, "{topic} in {namespace}");
        }
    }

    #[test]
    fn the_first_rule_that_matches_applies_once() {
        let remappings = [rule("status", "~/other"), rule("/car/status", "/never"), rule("/x", "status")];
        let names = NodeNames { node: "node", namespace: "/car", remappings: &remappings };
        assert_eq!(names.resolve("/car/status"), "/car/node/other");
        assert_eq!(names.resolve("status"), "/car/node/other");
        assert_eq!(names.resolve("/x"), "/car/status");
        assert_eq!(names.resolve("/status"), "/status");
        assert!(names.concerns(&remappings[1], "status") && !names.concerns(&remappings[1], "/status"));
    }

    #[test]
    fn names_are_as_ros_allows_them() {
        for topic in ["/a", "a/b_1", "~/a", "_a"] {
            assert!(is_topic(topic), "{topic}");
        }
        for topic in ["", "/", "~", "~a", "/a//b", "/a/", "/1", "a b", "a/~/b", "/a-b"] {
            assert!(!is_topic(topic), "{topic}");
        }
        assert!(is_namespace("/") && is_namespace("/a/b") && !is_namespace("a") && !is_namespace("/a/"));
    }
}
