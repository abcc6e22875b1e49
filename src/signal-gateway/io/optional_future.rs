//! Futures that may be absent, for the branches of a `select!`.

use std::future::pending;

/// Awaits a future; never completes without one. Cancel safe if the future is.
pub async fn or_never<F: Future>(future: Option<F>) -> F::Output {
    match future {
        Some(future) => future.await,
        None => pending().await,
    }
}
