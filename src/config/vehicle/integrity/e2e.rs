//! `e2e = { … }` of `[message.*]`: AUTOSAR end-to-end protection.

use serde::Deserialize;
use toml::Spanned;

use super::super::binder::Binder;
use crate::core::validation::integrity::Protection;
use crate::core::validation::integrity::e2e::{DataIdMode, E2e, Profile};

/// `e2e = { profile = …, … }`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct E2eFile {
    /// The AUTOSAR profile and its variant.
    pub profile: E2eProfile,
    /// Data ID, of all profiles but 2 and 22.
    pub data_id: Option<u32>,
    /// Sixteen Data IDs, of profiles 2 and 22.
    pub data_ids: Option<Vec<u8>>,
    /// First byte of the header.
    #[serde(default)]
    pub offset: usize,
    /// Largest step of the counter that is still believed.
    #[serde(default = "one_step")]
    pub max_step: u32,
}

/// `profile = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum E2eProfile {
    /// Both bytes of the Data ID.
    #[serde(rename = "1A")]
    P1A,
    /// One byte in turn.
    #[serde(rename = "1B")]
    P1B,
    /// The high byte's low half is sent.
    #[serde(rename = "1C")]
    P1C,
    /// Only the low byte.
    #[serde(rename = "1-low")]
    P1Low,
    /// List of Data IDs.
    #[serde(rename = "2")]
    P2,
    /// CRC-32.
    #[serde(rename = "4")]
    P4,
    /// CRC-16.
    #[serde(rename = "5")]
    P5,
    /// CRC-16 with length.
    #[serde(rename = "6")]
    P6,
    /// CRC-64.
    #[serde(rename = "7")]
    P7,
    /// As 1A.
    #[serde(rename = "11A")]
    P11A,
    /// As 1C.
    #[serde(rename = "11C")]
    P11C,
    /// As 2.
    #[serde(rename = "22")]
    P22,
}

fn one_step() -> u32 {
    1
}

/// The profile with its place in the frame.
pub(in crate::config::vehicle) fn e2e(
    binder: &mut Binder<'_>,
    file: &Spanned<E2eFile>,
    length: usize,
) -> Option<Protection> {
    let (span, file) = (file.span(), file.get_ref());
    let applied = profile(file).and_then(|profile| {
        let e2e = E2e::new(profile, file.offset, length).map_err(|error| error.to_string())?;
        Protection::e2e(e2e, file.max_step).map_err(|error| error.to_string())
    });
    applied.map_err(|reason| binder.refuse(span, reason, "see [message.*] e2e in config/gateway.toml")).ok()
}

fn profile(file: &E2eFile) -> Result<Profile, String> {
    let wide = || file.data_id.ok_or_else(|| "this profile needs `data_id`".to_owned());
    let narrow = || u16::try_from(wide()?).map_err(|_| "`data_id` of this profile has 16 bits".to_owned());
    let one = |mode| Ok::<_, String>(Profile::P01 { data_id: narrow()?, mode });
    let is_list = matches!(file.profile, E2eProfile::P2 | E2eProfile::P22);
    if is_list && file.data_id.is_some() || !is_list && file.data_ids.is_some() {
        return Err("profiles 2 and 22 have `data_ids`, the others `data_id`".to_owned());
    }
    match file.profile {
        E2eProfile::P1A | E2eProfile::P11A => one(DataIdMode::Both),
        E2eProfile::P1B => one(DataIdMode::Alternating),
        E2eProfile::P1C | E2eProfile::P11C => one(DataIdMode::Nibble),
        E2eProfile::P1Low => one(DataIdMode::Low),
        E2eProfile::P2 | E2eProfile::P22 => {
            let list = file.data_ids.as_deref().map(<[u8; 16]>::try_from);
            match list {
                Some(Ok(data_ids)) => Ok(Profile::P02 { data_ids }),
                Some(Err(_)) | None => Err("this profile needs `data_ids`, sixteen of them".to_owned()),
            }
        }
        E2eProfile::P4 => Ok(Profile::P04 { data_id: wide()? }),
        E2eProfile::P5 => Ok(Profile::P05 { data_id: narrow()? }),
        E2eProfile::P6 => Ok(Profile::P06 { data_id: narrow()? }),
        E2eProfile::P7 => Ok(Profile::P07 { data_id: wide()? }),
    }
}
