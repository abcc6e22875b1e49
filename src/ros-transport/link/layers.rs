//! The layers of the confinement of the network process, by name.

use derive_more::Display;

/// One of the kernel mechanisms that confine the network process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Display)]
pub enum Layer {
    /// It has no capability.
    #[display("dropped capabilities")]
    Capabilities,
    /// It is continued when its parent ends, in case it was stopped.
    #[display("a signal of the gateway's end")]
    ParentsEnd,
    /// The kernel kills it first when memory is short.
    #[display("OOM score")]
    OomScore,
    /// Its private writable memory is limited.
    #[display("memory limit")]
    MemoryLimit,
    /// Its open descriptors are limited.
    #[display("descriptor limit")]
    DescriptorLimit,
    /// It leaves no core dump.
    #[display("forbidden core dumps")]
    CoreDumps,
    /// Landlock refuses files, ports, sockets and signals.
    #[display("all of Landlock")]
    Landlock,
    /// A filter refuses system calls that its engine does not need.
    #[display("a filter of system calls")]
    SystemCalls,
    /// The gateway receives the names of refused calls.
    #[display("names of refused calls")]
    CallNames,
    /// Its user is not the gateway's.
    #[display("a user of its own")]
    OwnUser,
}

impl Layer {
    /// All layers, each at the position of its number.
    pub const ALL: [Self; 10] = [
        Self::Capabilities,
        Self::ParentsEnd,
        Self::OomScore,
        Self::MemoryLimit,
        Self::DescriptorLimit,
        Self::CoreDumps,
        Self::Landlock,
        Self::SystemCalls,
        Self::CallNames,
        Self::OwnUser,
    ];

    fn bit(self) -> u16 {
        1 << (self as u16)
    }
}

/// A set of layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Layers(u16);

impl Layers {
    /// Creates a set from bits sent by another process; bits without a meaning are dropped.
    pub fn from_bits(bits: u16) -> Self {
        Self(bits & Layer::ALL.into_iter().fold(0, |all, layer| all | layer.bit()))
    }

    /// Returns the layers of both sets.
    #[must_use]
    pub fn with(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// Returns true if the set has this layer.
    pub fn contains(self, layer: Layer) -> bool {
        self.0 & layer.bit() != 0
    }

    /// Returns the bits to send.
    pub fn bits(self) -> u16 {
        self.0
    }
}

impl FromIterator<Layer> for Layers {
    fn from_iter<T: IntoIterator<Item = Layer>>(layers: T) -> Self {
        Self(layers.into_iter().fold(0, |bits, layer| bits | layer.bit()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_survive_their_bits_and_bits_without_a_meaning_do_not() {
        for layer in Layer::ALL {
            let layers: Layers = [layer].into_iter().collect();
            assert_eq!(Layers::from_bits(layers.bits() | 0x8000), layers, "{layer}");
            assert!(Layer::ALL.into_iter().all(|other| layers.contains(other) == (other == layer)));
        }
        assert_eq!(Layers::from_bits(!0), Layer::ALL.into_iter().collect());
    }
}
