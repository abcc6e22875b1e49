//! Little-endian numbers within bytes; missing bytes read as 0.

macro_rules! number_at {
    ($name:ident, $type:ty) => {
        pub(super) fn $name(bytes: &[u8], at: usize) -> $type {
            let bytes = bytes.get(at..).and_then(|bytes| bytes.first_chunk().copied());
            bytes.map(<$type>::from_le_bytes).unwrap_or_default()
        }
    };
}
number_at!(u16_at, u16);
number_at!(u32_at, u32);
number_at!(u64_at, u64);
number_at!(f64_at, f64);
