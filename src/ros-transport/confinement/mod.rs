//! Confines the network process before it has any contact with the network, so that an attacker who takes it
//! over gains little. The confinement consists of layers ([`Layer`]), each using one mechanism of the kernel;
//! layers that this kernel lacks or refuses are reported.
//!
//! - If it is stopped when its parent ends, it is continued so that it ends as well. The kernel kills it
//!   first when memory is short. It leaves no core dump.
//! - Its memory and its descriptors are limited. The limit applies to private writable memory
//!   (`RLIMIT_DATA`), since threads and allocators reserve much more address space than they use; memory
//!   outside this limit, shared or in files, is not available to it.
//! - It has no capability, not even when started by root, and none of the descriptors that its parent did not
//!   intend for it.
//! - Once the gateway has sent the engine to run, [Landlock](landlock) and a filter of [system calls](calls)
//!   leave only what this engine needs.

mod calls;
mod error;
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

/// Maximum number of open descriptors. A participant has 60 and some for each interface; at times there are
/// two participants.
const DESCRIPTORS: u64 = 1024;
/// Preference with which the kernel kills it when memory is short, from -1000 to 1000.
const OOM_SCORE: &str = "500";

/// Returns the name of a system call by its number; `None` if unknown.
pub fn system_call_name(number: usize) -> Option<&'static str> {
    Sysno::new(number).map(|call| call.name())
}

/// Missing layers, each with its reason.
#[derive(Debug, Default)]
pub(super) struct MissingLayers(pub(super) Vec<(Layer, String)>);

impl MissingLayers {
    /// Returns the layers that the kernel lacks or refuses.
    pub(super) fn layers(&self) -> Layers {
        self.0.iter().map(|(layer, _)| *layer).collect()
    }

    fn note<T>(&mut self, layer: Layer, outcome: Result<T, impl ToString>) -> Option<T> {
        outcome.map_err(|reason| self.0.push((layer, reason.to_string()))).ok()
    }
}

/// Drops everything that no engine needs, and limits private writable memory to `memory` bytes.
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

/// Drops everything that this engine does not need, in all threads; except that Landlock binds only this
/// thread and threads that it starts later. Returns the descriptor, if any, through which the kernel asks how
/// to answer a refused call.
pub(super) fn confine_to(engine: &Transport, missing: &mut MissingLayers) -> Option<OwnedFd> {
    missing.note(Layer::Landlock, landlock::restrict(engine));
    missing
        .note(Layer::SystemCalls, calls::allow_only(engine))
        .and_then(|listener| missing.note(Layer::CallNames, listener))
}

fn drop_capabilities() -> rustix::io::Result<()> {
    let none = CapabilitySet::empty();
    let sets = CapabilitySets { effective: none, permitted: none, inheritable: none };
    // A service manager may have dropped them already, and forbidden the call as well.
    if capabilities(None)? == sets {
        return Ok(());
    }
    clear_ambient_capability_set()?;
    set_capabilities(None, sets)
}
