//! Names in Zenoh: the keys of topics, and the tokens that describe the graph.

use xxhash_rust::xxh3::xxh3_128;

use super::attachment::Gid;
use crate::error::TransportError;
use crate::qos::{Durability, Reliability};
use crate::settings::TypeHashes;
use ros_messages::{dds_type, type_hash};

/// First part of all tokens, which `**` does not match.
const GRAPH: &str = "@ros2_lv";
/// Replaces an empty name.
const EMPTY: &str = "%";
/// Replaces the hash of a type in Humble.
const NOT_SUPPORTED: &str = "TypeHashNotSupported";

/// A topic or service with its type, as in keys and tokens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TopicKey {
    /// Absolute name of the topic.
    pub(super) name: String,
    /// Type in DDS notation, `package::msg::dds_::Name_`.
    pub(super) type_name: String,
    pub(super) hash: String,
}

impl TopicKey {
    /// Creates the topic or service of this name and type; fails for a type without a known hash.
    pub(super) fn new(name: &str, type_name: &str, hashes: TypeHashes) -> Result<Self, TransportError> {
        let hash = match hashes {
            TypeHashes::Rihs01 => type_hash(type_name)
                .ok_or_else(|| TransportError::NoHash(type_name.replacen("/msg/", "/", 1)))?,
            TypeHashes::NotSupported => NOT_SUPPORTED,
        };
        Ok(Self { name: name.to_owned(), type_name: dds_type(type_name), hash: hash.to_owned() })
    }

    pub(super) fn data(&self, domain: u16) -> String {
        format!("{domain}/{}/{}/{}", self.name.trim_start_matches('/'), self.type_name, self.hash)
    }
}

/// A node of a session.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct NodeKey {
    pub(super) domain: u16,
    pub(super) session: String,
    /// Absolute namespace of the node.
    pub(super) namespace: String,
    pub(super) node: String,
}

/// Kind of endpoint that a token describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum EndpointKind {
    Publisher,
    Subscription,
    Service,
}

impl EndpointKind {
    const fn letters(self) -> &'static str {
        match self {
            Self::Publisher => "MP",
            Self::Subscription => "MS",
            Self::Service => "SS",
        }
    }
}

impl NodeKey {
    pub(super) fn token(&self) -> String {
        self.part(0, "NN")
    }

    pub(super) fn endpoint_token(&self, id: u32, kind: EndpointKind, topic: &TopicKey, qos: &str) -> String {
        let TopicKey { name, type_name, hash } = topic;
        format!("{}/{}/{type_name}/{hash}/{qos}", self.part(id, kind.letters()), escaped(name))
    }

    fn part(&self, id: u32, kind: &str) -> String {
        let Self { domain, session, namespace, node } = self;
        format!("{GRAPH}/{domain}/{session}/0/{id}/{kind}/{EMPTY}/{}/{node}", escaped(namespace))
    }
}

/// Returns the identity of an endpoint, derived from its token.
pub(super) fn gid(token: &str) -> Gid {
    xxh3_128(token.as_bytes()).to_le_bytes()
}

/// Returns the quality of service in a token; omitted values are the defaults of `rmw_zenoh`.
pub(super) fn qos(reliability: Reliability, durability: Durability, depth: i32) -> String {
    let reliability = match reliability {
        Reliability::Reliable => "",
        Reliability::BestEffort => "2",
    };
    let durability = match durability {
        Durability::TransientLocal => "1",
        Durability::Volatile => "",
    };
    format!("{reliability}:{durability}:,{depth}:,:,:,,")
}

/// Returns the key expression for all tokens of a domain.
pub(super) fn all_tokens(domain: u16) -> String {
    format!("{GRAPH}/{domain}/**")
}

/// Returns the key expression for all tokens of a session.
pub(super) fn session_tokens(domain: u16, session: &str) -> String {
    format!("{GRAPH}/{domain}/{session}/**")
}

/// An endpoint as described by its token.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct GraphEndpoint {
    pub(super) session: String,
    pub(super) kind: EndpointKind,
    /// Its node, with namespace.
    pub(super) node: String,
    pub(super) topic: TopicKey,
}

/// Returns the id of the session that declared a token.
pub(super) fn session_of(token: &str) -> Option<&str> {
    let mut parts = token.split('/');
    (parts.next()? == GRAPH).then(|| parts.nth(1)).flatten()
}

/// Returns the node, with its namespace, that declared this token for itself or for one of its endpoints.
pub(super) fn node_of(token: &str) -> Option<String> {
    let mut parts = token.split('/');
    let (GRAPH, namespace, node) = (parts.next()?, parts.nth(6)?, parts.next()?) else { return None };
    let namespace = if namespace == EMPTY { String::new() } else { namespace.replace('%', "/") };
    Some(format!("{namespace}/{node}"))
}

/// Reads the token of an endpoint; `None` for other tokens and other texts. Fields of later versions may
/// follow.
pub(super) fn read_token(token: &str) -> Option<GraphEndpoint> {
    let (session, node) = (session_of(token)?.to_owned(), node_of(token)?);
    let mut parts = token.split('/').skip(5);
    let mut next = || parts.next();
    let kind = match next()? {
        "MP" => EndpointKind::Publisher,
        "MS" => EndpointKind::Subscription,
        _ => return None,
    };
    let (_enclave, _namespace, _node) = (next()?, next()?, next()?);
    let (name, type_name, hash) = (next()?.replace('%', "/"), next()?.to_owned(), next()?.to_owned());
    Some(GraphEndpoint { session, kind, node, topic: TopicKey { name, type_name, hash } })
}

/// Returns a name as one part of a key.
fn escaped(name: &str) -> String {
    if name.is_empty() { EMPTY.to_owned() } else { name.replace('/', "%") }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn node(namespace: &str) -> NodeKey {
        let (session, node) = ("8b20917502ee955ac4476e0266340d5c".to_owned(), "talker".to_owned());
        NodeKey { domain: 2, session, namespace: namespace.to_owned(), node }
    }

    /// The examples of `rmw_zenoh`'s design document.
    #[test]
    fn keys_and_tokens_are_those_of_rmw_zenoh() {
        let chatter = TopicKey::new("/chatter", "std_msgs/msg/String", TypeHashes::Rihs01).unwrap();
        let hash = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18";
        assert_eq!(chatter.data(2), format!("2/chatter/std_msgs::msg::dds_::String_/{hash}"));
        assert_eq!(node("/").token(), "@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/0/NN/%/%/talker");
        let qos = qos(Reliability::Reliable, Durability::Volatile, 7);
        let token = node("/").endpoint_token(10, EndpointKind::Publisher, &chatter, &qos);
        let expected = format!(
            "@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{hash}/::,7:,:,:,,"
        );
        assert_eq!(token, expected);
    }

    #[test]
    fn namespaces_depths_and_humble_show_in_them() {
        let topic =
            TopicKey::new("/car/vehicle/status", "std_msgs/msg/String", TypeHashes::NotSupported).unwrap();
        assert_eq!(topic.data(0), "0/car/vehicle/status/std_msgs::msg::dds_::String_/TypeHashNotSupported");
        let qos = qos(Reliability::BestEffort, Durability::TransientLocal, 1);
        let token = node("/car/a").endpoint_token(1, EndpointKind::Subscription, &topic, &qos);
        assert!(token.contains("/0/1/MS/%/%car%a/talker/%car%vehicle%status/"), "{token}");
        assert!(token.ends_with("/TypeHashNotSupported/2:1:,1:,:,:,,"), "{token}");
        let unknown = TopicKey::new("/a", "std_msgs/msg/Nothing", TypeHashes::Rihs01).unwrap_err();
        assert_eq!(unknown.to_string(), "the hash of std_msgs/Nothing is not known");
    }

    #[test]
    fn tokens_are_read_with_what_versions_to_come_add_and_nothing_else_is() {
        let topic = TopicKey::new("/a/b", "std_msgs/msg/String", TypeHashes::Rihs01).unwrap();
        for (namespace, full) in [("/", "/talker"), ("/car/a", "/car/a/talker")] {
            let token = node(namespace).endpoint_token(10, EndpointKind::Subscription, &topic, "::,7:,:,:,,");
            let read = read_token(&token).unwrap();
            assert_eq!((read.kind, read.node.as_str()), (EndpointKind::Subscription, full));
            assert_eq!((read.session.as_str(), &read.topic), ("8b20917502ee955ac4476e0266340d5c", &topic));
            assert_eq!(read_token(&format!("{token}/more/%")), Some(read));
        }
        for other in [
            "",
            "a",
            "@ros2_lv",
            "@ros2_lv/2/8b/0/10/MP/%/%/talker/%a/type",
            "@ros2_lv/2/8b/0/10/XX/%/%/t/%a/b/c/d",
        ] {
            assert_eq!(read_token(other), None, "{other}");
        }
        let token = node("/car/a").token();
        assert_eq!(read_token(&token), None);
        let of_node = (session_of(&token), node_of(&token));
        assert_eq!(of_node, (Some("8b20917502ee955ac4476e0266340d5c"), Some("/car/a/talker".to_owned())));
        assert!(session_tokens(2, "8b20").starts_with("@ros2_lv/2/8b20/"));
        assert_eq!(gid("").len(), 16);
    }

    proptest! {
        #[test]
        fn any_text_is_a_token_or_none(parts in prop::collection::vec("[^/]{0,4}|@ros2_lv|MP|MS|%", 0..16)) {
            let text = parts.join("/");
            if let Some(endpoint) = read_token(&text) {
                prop_assert!(parts[0] == GRAPH && endpoint.topic.hash == parts[11]);
            }
            prop_assert_eq!(read_token(&text).is_some(), parts.len() >= 12 && parts[0] == GRAPH && ["MP", "MS"].contains(&parts[5].as_str()));
        }
    }

    #[test]
    fn an_identity_is_the_hash_of_the_token() {
        // XXH3-128 of empty input, as published by its authors: 99aa06d3014798d86001c324468d497f.
        let expected = 0x99aa_06d3_0147_98d8_6001_c324_468d_497f_u128;
        assert_eq!(gid(""), expected.to_le_bytes());
    }
}
