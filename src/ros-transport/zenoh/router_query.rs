//! Queries a router about sessions that we have lost.

use std::collections::BTreeSet;
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use zenoh::Wait;

use super::keys::{node_of, session_tokens};
use super::peer_search::Answer;
use crate::zenoh_config;

/// Maximum wait for a router.
const PATIENCE: Duration = Duration::from_secs(2);
/// Maximum number of nodes named per session; a process may have hundreds.
const MAX_NODES: usize = 8;

/// Asks a router, in a separate thread, which of these sessions have tokens in a domain. The query comes from
/// a client, since a router tells peers only about itself. Calls `then` with the answer; `None` if there was
/// none.
///
/// # Errors
/// Fails with the kernel's error if no thread can be created.
pub(super) fn ask(
    config: zenoh::Config,
    domain: u16,
    sessions: BTreeSet<String>,
    then: impl FnOnce(BTreeSet<String>, Option<Answer>) + Send + 'static,
) -> std::io::Result<()> {
    let ask = move || {
        // Its sessions come and go with each peer that ends, and Zenoh writes a line for each.
        let quiet = tracing::subscriber::NoSubscriber::default();
        let answer = tracing::subscriber::with_default(quiet, || answer(config, domain, &sessions));
        if let Err(error) = &answer {
            tracing::debug!("no router says who is there: {error}");
        }
        then(sessions, answer.ok());
    };
    thread::Builder::new().name("zenoh query".to_owned()).spawn(ask).map(drop)
}

fn answer(config: zenoh::Config, domain: u16, sessions: &BTreeSet<String>) -> zenoh::Result<Answer> {
    let session = zenoh::open(zenoh_config::for_a_query(config, PATIENCE)?).wait()?;
    let mut answer = Answer::new();
    for id in sessions {
        let (sender, replies) = channel();
        session
            .liveliness()
            .get(session_tokens(domain, id))
            .timeout(PATIENCE)
            .callback(move |reply| {
                let token = reply.result().ok().map(|sample| sample.key_expr().as_str().to_owned());
                // The receiver is gone after the timeout.
                let _ = sender.send(token);
            })
            .wait()?;
        let nodes = replies.into_iter().flatten().filter_map(|token| node_of(&token));
        let nodes: BTreeSet<_> = nodes.collect();
        if !nodes.is_empty() {
            answer.insert(id.clone(), nodes.into_iter().take(MAX_NODES).collect());
        }
    }
    let _ = session.close().wait();
    Ok(answer)
}
