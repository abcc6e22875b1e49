//! placeholder until the DBC branch lands
/// codec
#[derive(Debug, Clone, Copy)]
pub struct SignalCodec;
impl SignalCodec {
    /// p
    pub fn is_present(&self, _d: &[u8; 64]) -> bool {
        true
    }
    /// p
    pub fn needed_length(&self) -> usize {
        1
    }
    /// p
    pub fn value(&self, d: &[u8; 64]) -> i128 {
        i128::from(d[0])
    }
}
