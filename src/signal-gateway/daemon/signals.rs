//! Handles the signals of the process: stop, reload, and ignored ones.

use std::future::{pending, poll_fn};
use std::io::{self, IsTerminal as _};
use std::task::Poll;

use tokio::signal::unix::{Signal, SignalKind, signal};

use crate::io::hangup::ignore_hangup;

/// Signals that request an orderly stop, and signals that would otherwise end the process at once and are
/// ignored.
///
/// SIGHUP requests a stop if a standard stream is a terminal, since it then means that the terminal was
/// closed. Without a terminal a service treats it as [`ReloadSignal`], and a command ignores it.
pub(super) struct StopSignals {
    stop: Vec<Signal>,
    ignored: Vec<(&'static str, Signal)>,
}

/// Signals that serve no purpose here and would end the process by default.
const IGNORED: [(&str, i32); 9] = [
    ("SIGUSR1", libc::SIGUSR1),
    ("SIGUSR2", libc::SIGUSR2),
    ("SIGALRM", libc::SIGALRM),
    ("SIGVTALRM", libc::SIGVTALRM),
    ("SIGPROF", libc::SIGPROF),
    ("SIGIO", libc::SIGIO),
    ("SIGPWR", libc::SIGPWR),
    ("SIGXCPU", libc::SIGXCPU),
    ("SIGXFSZ", libc::SIGXFSZ),
];

impl StopSignals {
    /// Listens to the signals of a command.
    pub(super) fn listen() -> io::Result<Self> {
        if !has_terminal() {
            ignore_hangup();
        }
        Self::of_service()
    }

    /// Listens to the signals of a process that handles SIGHUP itself if it has no terminal.
    pub(super) fn of_service() -> io::Result<Self> {
        let mut stop = vec![SignalKind::terminate(), SignalKind::interrupt(), SignalKind::quit()];
        let ignored = IGNORED.map(|(name, number)| (name, SignalKind::from_raw(number)));
        if has_terminal() {
            stop.push(SignalKind::hangup());
        }
        let ignored = ignored.into_iter().map(|(name, kind)| Ok((name, signal(kind)?)));
        Ok(Self {
            stop: stop.into_iter().map(signal).collect::<io::Result<_>>()?,
            ignored: ignored.collect::<io::Result<_>>()?,
        })
    }

    /// Waits for a stop signal. Cancel safe.
    pub(super) async fn requested(&mut self) {
        poll_fn(|context| {
            for (name, signal) in &mut self.ignored {
                while let Poll::Ready(Some(())) = signal.poll_recv(context) {
                    tracing::info!("{name} is ignored");
                }
            }
            let mut stops = self.stop.iter_mut().map(|signal| signal.poll_recv(context));
            if stops.any(|polled| polled.is_ready()) { Poll::Ready(()) } else { Poll::Pending }
        })
        .await;
    }
}

/// SIGHUP as the request to reload the configuration; `None` in a process with a terminal.
pub(super) struct ReloadSignal(Option<Signal>);

impl ReloadSignal {
    pub(super) fn listen() -> io::Result<Self> {
        let hangup = (!has_terminal()).then(|| signal(SignalKind::hangup()));
        Ok(Self(hangup.transpose()?))
    }

    /// Ignores further requests, in a process whose configuration cannot change. Other processes can detect
    /// this.
    pub(super) fn refuse(&mut self) {
        if self.0.take().is_some() {
            ignore_hangup();
        }
    }

    /// Returns true if the process accepts reload requests.
    pub(super) fn is_taken(&self) -> bool {
        self.0.is_some()
    }

    /// Waits for a request; several at once count as one. Cancel safe.
    pub(super) async fn requested(&mut self) {
        let received = match &mut self.0 {
            Some(signal) => signal.recv().await,
            None => None,
        };
        if received.is_none() {
            pending::<()>().await;
        }
    }
}

fn has_terminal() -> bool {
    io::stdin().is_terminal() || io::stdout().is_terminal() || io::stderr().is_terminal()
}
