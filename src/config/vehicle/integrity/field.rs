//! Signals of a message that hold its counter or checksum.

use toml::Spanned;

use super::super::binder::Binder;
use crate::core::dbc::codec::SignalCodec;
use crate::core::dbc::model::Message;

/// The signal of that name, of any kind.
pub(super) fn field(
    binder: &mut Binder<'_>,
    message: &Message,
    name: &Spanned<String>,
) -> Option<SignalCodec> {
    let signal = message.signal(name.get_ref());
    if signal.is_none() {
        let names: Vec<_> = message.signals.iter().map(|signal| signal.name.as_str()).collect();
        let reason = format!("{} has no signal {}", message.name, name.get_ref());
        binder.refuse(name.span(), reason, &format!("it has {}", names.join(", ")));
    }
    signal.map(|signal| signal.codec.clone())
}
