//! A session of Zenoh, with the node that declares its endpoints there.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use zenoh::liveliness::LivelinessToken;
use zenoh::{Session, Wait};

use super::keys::{EndpointKind, NodeKey, TopicKey};
use crate::link::NetworkSettings;

/// A session and our node in it. Clones are the same session.
#[derive(Clone)]
pub(super) struct NodeSession {
    pub(super) session: Session,
    pub(super) key: NodeKey,
    /// The last id of an endpoint; each is used once.
    last_id: Arc<AtomicU32>,
}

impl NodeSession {
    /// Creates the node of these settings, without declaring it.
    pub(super) fn new(session: Session, settings: &NetworkSettings) -> Self {
        let key = NodeKey {
            domain: settings.domain_id,
            session: session.zid().to_string(),
            namespace: if settings.namespace == "/" { String::new() } else { settings.namespace.clone() },
            node: settings.node.clone(),
        };
        Self { session, key, last_id: Arc::default() }
    }

    /// Returns the token of a new endpoint.
    pub(super) fn endpoint_token(&self, kind: EndpointKind, topic: &TopicKey, qos: &str) -> String {
        let id = self.last_id.fetch_add(1, Ordering::Relaxed).wrapping_add(1);
        self.key.endpoint_token(id, kind, topic, qos)
    }

    /// Declares a token, which lasts until the result is dropped.
    pub(super) fn declare(&self, token: String) -> zenoh::Result<LivelinessToken> {
        self.session.liveliness().declare_token(token).wait()
    }
}
