//! Starts the network side: the settings name the engine, which then serves the gateway.

use std::io;
use std::os::unix::net::UnixStream;

use tokio::runtime::Builder;

use crate::link::{Link, LostLines, NetworkSettings, ToNetwork};
use crate::orders;
use crate::processor_wait::ProcessorWait;
use crate::settings::Transport;

/// Serves the gateway at the other end of the socket until it orders to stop; `confine` is called with the
/// requested engine, before any contact with the network. `lost_lines` returns the number of lines that the
/// log of this process could not write. Fails with the error of `confine`, or of the link, usually because
/// the gateway is gone.
pub fn serve(
    socket: UnixStream,
    lost_lines: fn() -> LostLines,
    confine: impl FnOnce(&Transport) -> io::Result<()>,
) -> io::Result<()> {
    let runtime = Builder::new_current_thread().enable_all().build()?;
    let Some((settings, link)) = runtime.block_on(start(socket))? else { return Ok(()) };
    // Opened now, since a confined process cannot.
    let processor = ProcessorWait::of_this_thread();
    confine(&settings.transport)?;
    match &settings.transport {
        Transport::Dds => runtime.block_on(crate::dds::serve(settings, link, lost_lines, processor)),
        #[cfg(feature = "zenoh")]
        Transport::Zenoh(_) => crate::zenoh::serve(&runtime, settings, link, lost_lines),
        #[cfg(not(feature = "zenoh"))]
        Transport::Zenoh(_) => runtime.block_on(orders::refuse("this build has no Zenoh", link)),
    }
}

/// Waits for the settings; `None` if the gateway orders to stop instead.
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
