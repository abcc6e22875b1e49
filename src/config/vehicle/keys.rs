//! Sections with several forms: which keys are given, which of them have a meaning in which form, and
//! which are missing. Each key is written once, in the declaration of its section.

use std::ops::Range;

use toml::Spanned;

use super::binder::Binder;

/// A key that is given, once for each place where it is.
#[derive(Debug, Clone)]
pub(super) struct Key<U: 'static> {
    pub(super) name: &'static str,
    pub(super) span: Range<usize>,
    uses: &'static [U],
}

impl<U: PartialEq> Key<U> {
    pub(super) fn new(name: &'static str, span: Range<usize>, uses: &'static [U]) -> Self {
        Self { name, span, uses }
    }

    /// Whether the key has a meaning in this form of the section.
    pub(super) fn is_for(&self, form: &U) -> bool {
        self.uses.contains(form)
    }
}

/// The value of a key, which may be left out or stand in several places.
pub(super) trait Spans {
    /// Where it is given.
    fn spans(&self) -> Vec<Range<usize>>;
}

impl<T> Spans for Option<Spanned<T>> {
    fn spans(&self) -> Vec<Range<usize>> {
        self.iter().map(Spanned::span).collect()
    }
}

impl<T> Spans for Vec<Spanned<T>> {
    fn spans(&self) -> Vec<Range<usize>> {
        self.iter().map(Spanned::span).collect()
    }
}

/// Declares the shape of a section as a struct that knows its keys: behind each type stand the forms of
/// the section in which the key has a meaning. Keys without forms have a meaning in all of them.
macro_rules! section {
    (
        $(#[$meta:meta])*
        pub struct $name:ident by $form:ident {
            $( $(#[$key_meta:meta])* $key:ident: $type:ty $([$($use:ident),+])?, )+
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $( $(#[$key_meta])* pub $key: $type, )+
        }

        impl $name {
            /// The keys that are given and belong to certain forms, in the order of the declaration.
            fn keys(&self) -> Vec<$crate::config::vehicle::keys::Key<$form>> {
                use $crate::config::vehicle::keys::{Spans, Key};
                let mut keys = Vec::new();
                $( $( for span in Spans::spans(&self.$key) {
                    keys.push(Key::new(stringify!($key), span, &[$($form::$use),+]));
                } )? )+
                keys
            }
        }
    };
}
pub(super) use section;

/// Binds keys of a section to their values, or refuses the section for those that are missing.
macro_rules! require {
    ($binder:expr, $span:expr, $section:ident.{ $($key:ident),+ }, $remedy:expr) => {
        let ($(Some($key),)+) = ($(&$section.$key,)+) else {
            let keys = [$((stringify!($key), $section.$key.is_none())),+];
            $crate::config::vehicle::keys::refuse_missing($binder, $span, &keys, $remedy);
            return None;
        };
    };
}
pub(super) use require;

/// Refuses a section for its keys that are missing.
pub(super) fn refuse_missing(
    binder: &mut Binder<'_>,
    section: &Range<usize>,
    keys: &[(&str, bool)],
    remedy: &str,
) {
    let missing: Vec<_> = keys.iter().filter(|(_, missing)| *missing).map(|(key, _)| *key).collect();
    let reason = format!(
        "{} missing: {}",
        if missing.len() == 1 { "a key is" } else { "keys are" },
        missing.join(", ")
    );
    binder.refuse(section.clone(), reason, remedy);
}

/// Refuses each of these keys: "`key` reason".
pub(super) fn refuse_keys<U: PartialEq + 'static>(
    binder: &mut Binder<'_>,
    keys: impl IntoIterator<Item = Key<U>>,
    reason: &str,
    remedy: &str,
) {
    for key in keys {
        binder.refuse(key.span, format!("`{}` {reason}", key.name), remedy);
    }
}

/// Refuses one key, if it is given.
pub(super) fn refuse_given<T>(
    binder: &mut Binder<'_>,
    (name, value): (&str, &Option<Spanned<T>>),
    reason: &str,
    remedy: &str,
) {
    if let Some(value) = value {
        binder.refuse(value.span(), format!("`{name}` {reason}"), remedy);
    }
}
