//! From checksums, counters and E2E protection of a profile to what a message must prove.

use std::time::Duration;

use toml::Spanned;

use super::integrity_file::{
    ChecksumFile, ChecksumKind, CounterFile, CountsFile, E2eFile, E2eProfile, IdentifierFile, LimitsFile,
    WindowFile,
};
use super::roles::Binder;
use super::vehicle_file::MessageFile;
use crate::core::dbc::codec::SignalCodec;
use crate::core::dbc::model::Message;
use crate::core::trust::integrity::checksum::{Checksum, Crc8, Crc16, Extra, Parameters, Rule, Sum};
use crate::core::trust::integrity::counter::{Counter, CounterRule, Counts};
use crate::core::trust::integrity::e2e::{DataIdMode, E2e, Profile};
use crate::core::trust::integrity::window::{Limits, Window};
use crate::core::trust::integrity::{MessageIntegrity, Protection};

/// What the section asks a message to prove; `None` when it asks for nothing.
pub(super) fn integrity(
    binder: &mut Binder<'_>,
    file: &MessageFile,
    message: &Message,
    forget_after: Option<Duration>,
) -> Option<MessageIntegrity> {
    let length = file.length.as_ref().map(|length| *length.get_ref());
    if let Some(length) = file.length.as_ref().filter(|length| !(1..=64).contains(length.get_ref())) {
        binder.refuse(length.span(), format!("no frame has {} bytes", length.get_ref()), "give 1 to 64");
    }
    let checksum = file.checksum.as_ref().and_then(|file| checksum(binder, file, message));
    let counter = file.counter.as_ref().and_then(|file| counter(binder, file, message));
    let window = file.window.as_ref().and_then(|file| window(binder, file));
    let asked = length.is_some() || file.checksum.is_some() || file.counter.is_some();
    let protection = match &file.e2e {
        Some(e2e) if file.checksum.is_some() || file.counter.is_some() => {
            let reason = "an E2E profile has its own checksum and counter";
            binder.refuse(e2e.span(), reason, "give `e2e`, or `checksum` and `counter`");
            return None;
        }
        Some(file) => e2e(binder, file, message.length)?,
        None if asked => Protection::Fields { checksum, counter },
        None => {
            if let Some(window) = &file.window {
                let reason = "a window judges what checksum, counter or e2e found";
                binder.refuse(window.span(), reason, "give one of them, or remove it");
            }
            return None;
        }
    };
    Some(MessageIntegrity { length, protection, window, forget_after })
}

fn field(binder: &mut Binder<'_>, message: &Message, name: &Spanned<String>) -> Option<SignalCodec> {
    let signal = message.signal(name.get_ref());
    if signal.is_none() {
        let names: Vec<_> = message.signals.iter().map(|signal| signal.name.as_str()).collect();
        let reason = format!("{} has no signal {}", message.name, name.get_ref());
        binder.refuse(name.span(), reason, &format!("it has {}", names.join(", ")));
    }
    signal.map(|signal| signal.codec.clone())
}

fn checksum(binder: &mut Binder<'_>, file: &Spanned<ChecksumFile>, message: &Message) -> Option<Checksum> {
    let (span, file) = (file.span(), file.get_ref());
    let field = field(binder, message, &file.signal)?;
    let rule = match rule(file, message.length) {
        Ok(rule) => rule,
        Err(reason) => {
            binder.refuse(span, reason, "see [message.*] checksum in config/gateway.toml");
            return None;
        }
    };
    match Checksum::new(rule, field) {
        Ok(checksum) => Some(checksum),
        Err(error) => {
            binder.refuse(file.signal.span(), error.to_string(), "bind the signal that holds the checksum");
            None
        }
    }
}

fn rule(file: &ChecksumFile, length: usize) -> Result<Rule, String> {
    let start = file.start.unwrap_or(0);
    refuse_keys(file)?;
    Ok(match file.kind {
        ChecksumKind::Honda => Rule::Honda,
        ChecksumKind::Toyota => Rule::Sum(Sum::TOYOTA),
        ChecksumKind::Subaru | ChecksumKind::Tesla => Rule::Sum(Sum::IDENTIFIER),
        ChecksumKind::Mazda => Rule::Sum(Sum::MAZDA),
        ChecksumKind::J1850 => Rule::Crc8(Crc8::j1850()),
        ChecksumKind::FcaGiorgio => match file.xorout.map(u8::try_from) {
            Some(Ok(last_xor)) => Rule::Crc8(Crc8::giorgio(last_xor)),
            Some(Err(_)) | None => return Err("Giorgio needs `xorout`, the message's own 8 bits".to_owned()),
        },
        ChecksumKind::Psa => match file.start {
            Some(start @ 0..=15) => Rule::Psa { start },
            Some(_) => return Err("`start` of PSA is 0 to 15".to_owned()),
            None => return Err("PSA needs `start`, the message's own".to_owned()),
        },
        ChecksumKind::Vw => {
            let constants = file.constants.as_deref().map(<[u8; 16]>::try_from);
            let Some(Ok(constants)) = constants else {
                return Err("VW needs `constants`, sixteen of them".to_owned());
            };
            Rule::Crc8(Crc8::volkswagen(constants))
        }
        ChecksumKind::VwPq | ChecksumKind::Xor8 => Rule::Xor { start },
        ChecksumKind::HyundaiFd => {
            let crc = Crc16::hyundai_fd(length);
            Rule::Crc16(crc.ok_or_else(|| format!("Hyundai's CRC is not known for {length} bytes"))?)
        }
        ChecksumKind::Sum8 => Rule::Sum(Sum {
            start,
            identifier: file.identifier != IdentifierFile::None,
            bytes: file.bytes,
            ..Sum::PLAIN
        }),
        ChecksumKind::Crc8 => {
            let word = |value: Option<u16>, key: &str| {
                u8::try_from(value.unwrap_or(0)).map_err(|_| format!("`{key}` of a CRC-8 has 8 bits"))
            };
            let poly = file.poly.ok_or("a CRC needs `poly`")?;
            Rule::Crc8(Crc8::new(
                Parameters {
                    poly: word(Some(poly), "poly")?,
                    init: word(file.init, "init")?,
                    xorout: word(file.xorout, "xorout")?,
                    refin: file.reflected,
                    refout: file.reflected,
                },
                extra(file.identifier),
                file.bytes,
            ))
        }
        ChecksumKind::Crc16 => Rule::Crc16(Crc16::new(
            Parameters {
                poly: file.poly.ok_or("a CRC needs `poly`")?,
                init: file.init.unwrap_or(0),
                xorout: file.xorout.unwrap_or(0),
                refin: file.reflected,
                refout: file.reflected,
            },
            extra(file.identifier),
            file.bytes,
        )),
    })
}

/// Refuses keys that another kind has.
fn refuse_keys(file: &ChecksumFile) -> Result<(), String> {
    let takes: &[&str] = match file.kind {
        ChecksumKind::Honda
        | ChecksumKind::Toyota
        | ChecksumKind::Subaru
        | ChecksumKind::Tesla
        | ChecksumKind::Mazda
        | ChecksumKind::HyundaiFd
        | ChecksumKind::J1850 => &[],
        ChecksumKind::FcaGiorgio => &["xorout"],
        ChecksumKind::Psa | ChecksumKind::VwPq | ChecksumKind::Xor8 => &["start"],
        ChecksumKind::Vw => &["constants"],
        ChecksumKind::Sum8 => &["start", "identifier", "bytes"],
        ChecksumKind::Crc8 | ChecksumKind::Crc16 => {
            &["poly", "init", "xorout", "reflected", "identifier", "bytes"]
        }
    };
    let given = [
        ("start", file.start.is_some()),
        ("constants", file.constants.is_some()),
        ("poly", file.poly.is_some()),
        ("init", file.init.is_some()),
        ("xorout", file.xorout.is_some()),
        ("reflected", file.reflected),
        ("identifier", file.identifier != IdentifierFile::None),
        ("bytes", file.bytes.is_some()),
    ];
    match given.iter().find(|(key, given)| *given && !takes.contains(key)) {
        Some((key, _)) => Err(format!("`{key}` has no meaning with this kind of checksum")),
        None => Ok(()),
    }
}

fn extra(identifier: IdentifierFile) -> Extra {
    match identifier {
        IdentifierFile::None => Extra::Nothing,
        IdentifierFile::Before => Extra::IdentifierBefore,
        IdentifierFile::Behind => Extra::IdentifierBehind,
    }
}

fn counter(binder: &mut Binder<'_>, file: &Spanned<CounterFile>, message: &Message) -> Option<Counter> {
    let (span, file) = (file.span(), file.get_ref());
    let signal = field(binder, message, &file.signal)?;
    let (lowest, highest) = signal.range();
    let limit = |value: i128| u32::try_from(value).unwrap_or(if value < 0 { 0 } else { u32::MAX });
    let counts = match file.counts {
        CountsFile::Sends => Counts::Sends,
        CountsFile::Changes => Counts::Changes,
    };
    let rule = CounterRule::new(file.first.unwrap_or(limit(lowest)), file.last.unwrap_or(limit(highest)))
        .and_then(|rule| rule.with_max_step(file.max_step))
        .map(|rule| rule.with_counts(counts).with_tolerated_repeats(file.tolerated_repeats))
        .map(|rule| rule.with_sync_after(file.sync_after));
    match rule.and_then(|rule| Counter::new(rule, signal)) {
        Ok(counter) => Some(counter),
        Err(error) => {
            binder.refuse(span, error.to_string(), "see [message.*] counter in config/gateway.toml");
            None
        }
    }
}

fn e2e(binder: &mut Binder<'_>, file: &Spanned<E2eFile>, length: usize) -> Option<Protection> {
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

fn window(binder: &mut Binder<'_>, file: &Spanned<WindowFile>) -> Option<Window> {
    let limits = |file: LimitsFile| {
        let LimitsFile { size, min_ok, max_error } = file;
        Limits { size, min_ok, max_error }
    };
    let (span, file) = (file.span(), file.get_ref());
    let window =
        Window::new(limits(file.init), limits(file.valid), limits(file.invalid), file.clear_to_invalid);
    window
        .map_err(|error| {
            binder.refuse(span, error.to_string(), "see [message.*] window in config/gateway.toml");
        })
        .ok()
}
