//! The confinement of the network process before it meets the network, so that whoever takes it over gains
//! little. It is made of layers ([`Layer`]), each by a means of the kernel; what this kernel does not have,
//! or what was refused, is reported.
//!
//! - If it was stopped when its parent ends, it is continued so that it ends as well. It is the first that
//!   the kernel takes when memory is short. It leaves no core dump.
//! - Its memory and its descriptors are limited. The limit is one of private writable memory (`RLIMIT_DATA`),
//!   since threads and allocators reserve much more address space than they use; memory that it would not
//!   count, which is shared or in files, cannot be had.
//! - It has no capability, not even where root started it, and none of the descriptors that its parent did
//!   not mean for it.
//! - Once the gateway has said which engine is to run, [Landlock](landlock) and a filter of [system
//!   calls](calls) leave it what this engine needs.

mod calls;
mod landlock;
mod listener;

use std::fs;
use std::os::fd::OwnedFd;

use rustix::process::{Resource, Rlimit, Signal, set_parent_process_death_signal, setrlimit};
use rustix::thread::{
    CapabilitySet, CapabilitySets, capabilities, clear_ambient_capability_set, set_capabilities,
};

use syscalls::Sysno;

use crate::link::{Layer, Layers};
use crate::settings::Transport;

/// Open descriptors. A participant has 60 and some for each interface; now and then there are two.
const DESCRIPTORS: u64 = 1024;
/// Likelihood to be taken when memory is short, from -1000 to 1000.
const OOM_SCORE: &str = "500";

/// Returns the name of a system call by its number; `None` for one that is unknown.
pub fn system_call_name(number: usize) -> Option<&'static str> {
    Sysno::new(number).map(|call| call.name())
}

/// What is missing, with the reason.
#[derive(Debug, Default)]
pub(super) struct MissingLayers(pub(super) Vec<(Layer, String)>);

impl MissingLayers {
    /// The layers that the kernel has.
    pub(super) fn layers(&self) -> Layers {
        self.0.iter().map(|(layer, _)| *layer).collect()
    }

    fn note<T>(&mut self, layer: Layer, outcome: Result<T, impl ToString>) -> Option<T> {
        outcome.map_err(|reason| self.0.push((layer, reason.to_string()))).ok()
    }
}

/// Gives up what no engine needs, and all private writable memory beyond so many bytes.
pub(super) fn confine(memory: u64) -> MissingLayers {
    let mut missing = MissingLayers::default();
    let limit = |resource, limit| setrlimit(resource, Rlimit { current: Some(limit), maximum: Some(limit) });
    missing.note(Layer::Capabilities, drop_capabilities());
    missing.note(Layer::ParentsEnd, set_parent_process_death_signal(Some(Signal::CONT)));
    missing.note(Layer::OomScore, fs::write("/proc/self/oom_score_adj", OOM_SCORE));
    missing.note(Layer::MemoryLimit, limit(Resource::Data, memory));
    missing.note(Layer::DescriptorLimit, limit(Resource::Nofile, DESCRIPTORS));
    missing.note(Layer::CoreDumps, limit(Resource::Core, 0));
    missing
}

/// Gives up what this engine does not need, in all threads but for Landlock, which binds this one and those
/// that it starts from now on. The kernel asks who listens at the descriptor, if there is one, what becomes
/// of a call that is refused.
pub(super) fn confine_to(engine: &Transport, missing: &mut MissingLayers) -> Option<OwnedFd> {
    missing.note(Layer::Landlock, landlock::restrict(engine));
    missing
        .note(Layer::SystemCalls, calls::allow_only(engine))
        .and_then(|listener| missing.note(Layer::CallNames, listener))
}

fn drop_capabilities() -> rustix::io::Result<()> {
    let none = CapabilitySet::empty();
    let sets = CapabilitySets { effective: none, permitted: none, inheritable: none };
    // A service manager may have dropped them already, and forbidden the call along with them.
    if capabilities(None)? == sets {
        return Ok(());
    }
    clear_ambient_capability_set()?;
    set_capabilities(None, sets)
}
