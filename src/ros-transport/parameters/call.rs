//! Extracts a request from a sample, and builds the sample of its response: each middleware associates the
//! two differently.

use ros_messages::cdr::{CdrBytes, Endian};

/// Length of the header before a Cyclone request, bytes: number of the client, number of the request.
const HEADER: usize = 16;

/// The middleware of a client, by its numbering of requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Middleware {
    /// `rmw_cyclonedds`: numbers precede request and response.
    Cyclone,
    /// `rmw_fastrtps` and others: the response names the sample of the request (DDS-RPC,
    /// "enhanced service mapping").
    Enhanced,
}

/// A request of a client.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Call<'a> {
    /// The request's own bytes.
    pub request: &'a [u8],
    /// Numbers of the client and of the request, if they precede it.
    header: Option<[u64; 2]>,
}

impl Middleware {
    /// Returns the middleware of a writer, by the vendor number at the start of its GUID.
    pub fn of(writer: [u8; 16]) -> Self {
        if writer.starts_with(&[0x01, 0x10]) { Self::Cyclone } else { Self::Enhanced }
    }

    /// Extracts the request from a sample; `None` if the preceding numbers are truncated.
    pub fn call(self, sample: &[u8], endian: Endian) -> Option<Call<'_>> {
        match self {
            Self::Enhanced => Some(Call { request: sample, header: None }),
            Self::Cyclone => {
                let (client, rest) = sample.split_first_chunk()?;
                let (number, request) = rest.split_first_chunk()?;
                let read = |bytes: &[u8; 8]| match endian {
                    Endian::Big => u64::from_be_bytes(*bytes),
                    Endian::Little => u64::from_le_bytes(*bytes),
                };
                Some(Call { request, header: Some([read(client), read(number)]) })
            }
        }
    }
}

impl Call<'_> {
    /// Builds the sample of its response.
    pub fn reply(&self, response: CdrBytes) -> CdrBytes {
        let Some(header) = self.header else { return response };
        let mut reply = Vec::with_capacity(HEADER + response.as_ref().len());
        reply.extend(header.iter().flat_map(|number| number.to_le_bytes()));
        reply.extend_from_slice(response.as_ref());
        reply.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guid(maker: [u8; 2]) -> [u8; 16] {
        let mut guid = [9; 16];
        guid[..2].copy_from_slice(&maker);
        guid
    }

    #[test]
    fn clients_are_told_apart_by_their_makers() {
        assert_eq!(Middleware::of(guid([0x01, 0x10])), Middleware::Cyclone);
        for other in [[0x01, 0x0F], [0x01, 0x12], [0x10, 0x01], [0, 0]] {
            assert_eq!(Middleware::of(guid(other)), Middleware::Enhanced);
        }
    }

    #[test]
    fn numbers_before_a_request_come_back_before_its_response() {
        let little: Vec<u8> = (1..=18).collect();
        let call = Middleware::Cyclone.call(&little, Endian::Little).unwrap();
        assert_eq!(call.request, [17, 18]);
        let reply = call.reply(CdrBytes::from(vec![99]));
        assert_eq!(reply.as_ref(), [&little[..16], &[99]].concat());

        let big: Vec<u8> = (1..=8).rev().chain((9..=16).rev()).chain([17, 18]).collect();
        assert_eq!(Middleware::Cyclone.call(&big, Endian::Big), Some(call));
        for cut_off in 0..16 {
            assert_eq!(Middleware::Cyclone.call(&little[..cut_off], Endian::Little), None);
        }
    }

    #[test]
    fn others_have_nothing_before_it() {
        let call = Middleware::Enhanced.call(&[1, 2], Endian::Little).unwrap();
        assert_eq!(call.request, [1, 2]);
        assert_eq!(call.reply(CdrBytes::from(vec![99])).as_ref(), [99]);
    }
}
