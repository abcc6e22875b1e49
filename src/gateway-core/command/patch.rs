//! Bits of a frame that are set together, checked at start-up so that nothing can fail while driving.

use can_signal::can::MAX_DATA;
use can_signal::dbc::codec::SignalCodec;

/// Values of some signals of one message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Patch {
    mask: [u8; MAX_DATA],
    bits: [u8; MAX_DATA],
}

/// Reason why signals cannot be set together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum PatchError {
    #[error("its raw values are {lowest} to {highest}")]
    OutOfRange {
        /// Lowest raw value of the signal.
        lowest: i128,
        /// Highest raw value of the signal.
        highest: i128,
    },
    /// A multiplexor removes the signal from some frames.
    #[error("a command signal must be in every frame, but this one is multiplexed")]
    Multiplexed,
    #[error("its bits are set by another signal as well")]
    Overlap,
}

impl Default for Patch {
    fn default() -> Self {
        Self { mask: [0; MAX_DATA], bits: [0; MAX_DATA] }
    }
}

impl Patch {
    /// Adds a signal with its value.
    pub fn set(&mut self, signal: &SignalCodec, raw: i128) -> Result<(), PatchError> {
        let own = mask_of(signal)?;
        if self.mask.iter().zip(own).any(|(mine, own)| mine & own != 0) {
            return Err(PatchError::Overlap);
        }
        let (lowest, highest) = signal.range();
        signal.write(raw, &mut self.bits).map_err(|_| PatchError::OutOfRange { lowest, highest })?;
        self.mask.iter_mut().zip(own).for_each(|(mine, own)| *mine |= own);
        Ok(())
    }

    /// Returns true if both patches set the same bits, regardless of values.
    pub fn sets_like(&self, other: &Self) -> bool {
        self.mask == other.mask
    }

    /// Returns true if both patches have a bit in common.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.mask.iter().zip(other.mask).any(|(mine, other)| mine & other != 0)
    }

    /// Returns true if `data` has these values, regardless of its other bits.
    pub fn matches(&self, data: &[u8; MAX_DATA]) -> bool {
        data.iter().zip(self.mask).zip(self.bits).all(|((byte, mask), bits)| byte & mask == bits)
    }

    /// Writes the values into `data` and leaves all other bits unchanged.
    pub fn apply(&self, data: &mut [u8; MAX_DATA]) {
        for ((byte, mask), bits) in data.iter_mut().zip(self.mask).zip(self.bits) {
            *byte = *byte & !mask | bits;
        }
    }
}

fn mask_of(signal: &SignalCodec) -> Result<[u8; MAX_DATA], PatchError> {
    if signal.is_multiplexed() {
        return Err(PatchError::Multiplexed);
    }
    let (lowest, highest) = signal.range();
    let all_ones = if lowest < 0 { -1 } else { highest };
    let mut mask = [0; MAX_DATA];
    // In range of every signal, signed or unsigned.
    let _ = signal.write(all_ones, &mut mask);
    Ok(mask)
}

#[cfg(test)]
mod tests {
    use super::*;
    use can_signal::dbc::codec::{ByteOrder, Layout};
    use proptest::prelude::*;

    fn signal(start: u16, length: u16, order: ByteOrder, signed: bool) -> SignalCodec {
        SignalCodec::new(Layout { start, length, order, signed }, 8).unwrap()
    }

    proptest! {
        /// Encoding and decoding are each other's reverse, and what is not named stays.
        #[test]
        fn what_is_set_is_read_back_and_nothing_else_changes(
            start in 0_u16..64, length in 1_u16..=64, motorola: bool, signed: bool, seed: u64, background: u8,
        ) {
            let order = if motorola { ByteOrder::Motorola } else { ByteOrder::Intel };
            let Ok(codec) = SignalCodec::new(Layout { start, length, order, signed }, 8) else { return Ok(()) };
            let (lowest, highest) = codec.range();
            let raw = lowest + i128::from(seed) % (highest - lowest + 1);
            let mut patch = Patch::default();
            patch.set(&codec, raw).unwrap();
            let mut data = [background; MAX_DATA];
            patch.apply(&mut data);
            prop_assert_eq!(codec.value(&data), raw);
            let mut expected = [background; MAX_DATA];
            codec.write(raw, &mut expected).unwrap();
            prop_assert_eq!(data, expected);
            prop_assert!(patch.matches(&data));
            codec.write(if raw == lowest { highest } else { lowest }, &mut data).unwrap();
            prop_assert!(!patch.matches(&data));
            prop_assert_eq!(patch.set(&codec, raw), Err(PatchError::Overlap));
            let too_high = Patch::default().set(&codec, highest + 1);
            prop_assert_eq!(too_high, Err(PatchError::OutOfRange { lowest, highest }));
        }
    }

    #[test]
    fn multiplexed_signals_are_refused_and_patches_are_compared_by_their_bits() {
        let (low, high) = (signal(0, 4, ByteOrder::Intel, false), signal(7, 4, ByteOrder::Motorola, true));
        let (mut one, mut other, mut third) = (Patch::default(), Patch::default(), Patch::default());
        one.set(&low, 3).unwrap();
        other.set(&low, 9).unwrap();
        third.set(&high, -1).unwrap();
        assert!(one.sets_like(&other) && !one.sets_like(&third));
        assert!(one.overlaps(&other) && !one.overlaps(&third));
        let paged = low.clone().multiplexed(&high, &[1..=1]);
        assert_eq!(Patch::default().set(&paged, 0), Err(PatchError::Multiplexed));
    }
}
