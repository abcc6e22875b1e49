//! The network side: what joins DDS, or Zenoh, behind a link.
//!
//! It believes what the network tells it, since RustDDS does: a single packet can make it allocate without
//! bound, or hang. So it runs in a process of its own ([`process`]), which knows nothing of CAN and may die
//! at any time; the gateway replaces it. It may also run in a thread of the gateway, for debuggers and tests.

mod confinement;
mod dds;
mod distribution;
mod orders;
pub mod process;
mod wakeup;
#[cfg(feature = "zenoh")]
mod zenoh;

use std::io;
use std::os::unix::net::UnixStream;

use tokio::runtime::Builder;

use super::link::{Link, NetworkSettings, ToNetwork};
use super::settings::Transport;
pub(super) use dds::survey;
pub use distribution::DISTRO;
pub(super) use distribution::identifier_length;

/// Serves the gateway at the other end of the socket until it says stop; `confine` is called with the engine
/// that it wants, before anything of the network is there. Fails with the error of `confine`, or of the link,
/// most often because the gateway is gone.
pub fn serve(socket: UnixStream, confine: impl FnOnce(&Transport) -> io::Result<()>) -> io::Result<()> {
    let runtime = Builder::new_current_thread().enable_all().build()?;
    let Some((settings, link)) = runtime.block_on(start(socket))? else { return Ok(()) };
    confine(&settings.transport)?;
    match &settings.transport {
        Transport::Dds => runtime.block_on(dds::serve(settings, link)),
        #[cfg(feature = "zenoh")]
        Transport::Zenoh(_) => zenoh::serve(&runtime, settings, link),
        #[cfg(not(feature = "zenoh"))]
        Transport::Zenoh(_) => runtime.block_on(orders::refuse("this build has no Zenoh", link)),
    }
}

/// Waits for the settings; `None` if the gateway says stop instead.
async fn start(socket: UnixStream) -> io::Result<Option<(NetworkSettings, Link)>> {
    let mut link = Link::new(socket)?;
    loop {
        match orders::next_message(&mut link)? {
            Some(ToNetwork::Start(settings)) => return Ok(Some((*settings, link))),
            Some(ToNetwork::Stop) => return Ok(None),
            Some(ToNetwork::Order(..) | ToNetwork::Parameters(_) | ToNetwork::Ping(_)) => {
                return Err(io::ErrorKind::InvalidData.into());
            }
            None => link.ready().await?,
        }
        link.read()?;
    }
}
