//! No function takes a tuple of two equal types: the caller could swap them, and nothing would tell.

use std::path::Path;

use proc_macro2::{Delimiter, TokenStream, TokenTree};

use super::{SOURCES, Source, test_files};

#[test]
fn no_parameter_is_a_tuple_of_equal_types() {
    let test_files = test_files();
    let sources = SOURCES.iter().filter(|source| source.path.starts_with("src"));
    let sources = sources.filter(|source| !test_files.contains(&source.path));
    let found = sources.flat_map(|source| {
        source.swappable.iter().map(|parameter| format!("{}: {parameter}", source.path.display()))
    });
    assert_eq!(found.collect::<Vec<_>>(), Vec::<String>::new());
}

/// The parameters of the function whose tokens from `fn` on these are, in whose type there is a tuple of two
/// equal types; references and lifetimes make no difference.
pub(super) fn swappable(function: &[TokenTree]) -> Vec<String> {
    let mut angles = AngleBrackets::default();
    let parameters = function.iter().find_map(|token| {
        angles.pass(token);
        let TokenTree::Group(group) = token else { return None };
        (angles.depth == 0).then(|| group.stream())
    });
    let parameters = parameters.map(at_commas).unwrap_or_default();
    let is_swappable = |parameter: &&Vec<TokenTree>| {
        let colon = parameter.iter().position(|token| token.to_string() == ":");
        colon.is_some_and(|colon| has_tuple_of_equals(&parameter[colon..]))
    };
    let text = |parameter: &Vec<TokenTree>| parameter.iter().cloned().collect::<TokenStream>().to_string();
    parameters.iter().filter(is_swappable).map(text).collect()
}

fn has_tuple_of_equals(tokens: &[TokenTree]) -> bool {
    (0..tokens.len()).any(|at| {
        let TokenTree::Group(group) = &tokens[at] else { return false };
        let inner: Vec<_> = group.stream().into_iter().collect();
        let before = at.checked_sub(1).map(|before| tokens[before].to_string()).unwrap_or_default();
        // After a `>` it is what a function returns.
        let is_tuple = group.delimiter() == Delimiter::Parenthesis
            && !["Fn", "FnMut", "FnOnce", "fn", ">"].contains(&before.as_str());
        let mut types: Vec<_> = at_commas(group.stream()).iter().map(|tokens| bare(tokens)).collect();
        let all = types.len();
        types.sort();
        types.dedup();
        is_tuple && types.len() < all || has_tuple_of_equals(&inner)
    })
}

/// A type without references, lifetimes and `mut`.
fn bare(tokens: &[TokenTree]) -> String {
    let mut text = String::new();
    let mut is_lifetime = false;
    for token in tokens {
        let written = token.to_string();
        match written.as_str() {
            "'" => is_lifetime = true,
            _ if is_lifetime => is_lifetime = false,
            "&" | "mut" => {}
            _ => text.push_str(&written),
        }
    }
    text
}

/// The tokens between commas that are in no angle brackets.
fn at_commas(stream: TokenStream) -> Vec<Vec<TokenTree>> {
    let mut parts = vec![Vec::new()];
    let mut angles = AngleBrackets::default();
    for token in stream {
        angles.pass(&token);
        if angles.before == ',' && angles.depth == 0 {
            parts.push(Vec::new());
        } else if let Some(part) = parts.last_mut() {
            part.push(token);
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

#[derive(Default)]
struct AngleBrackets {
    depth: i32,
    /// The last token, if it was one of punctuation.
    before: char,
}

impl AngleBrackets {
    fn pass(&mut self, token: &TokenTree) {
        let punct = if let TokenTree::Punct(punct) = token { punct.as_char() } else { ' ' };
        match punct {
            '<' => self.depth += 1,
            '>' if self.before != '-' => self.depth -= 1, // the end of `->` is no bracket
            _ => {}
        }
        self.before = punct;
    }
}

#[test]
fn finds_what_can_be_swapped() {
    let found = |text: &str| Source::parse(Path::new("src/x/a.rs"), text).swappable.len();
    for text in [
        "fn f((from, to): (f64, f64)) {}",
        "impl A { pub(crate) const fn f<T: B<u8>>(&self, a: u8, names: &[(&'static str, &str)]) {} }",
        "fn f(read: impl Iterator<Item = (String, (String, String))>) {}",
        "fn f<'a>(a: Option<(BTreeMap<u8, u8>, BTreeMap<u8, u8>)>) -> u8 { 1 }",
        "fn f(say: impl Fn((bool, bool)) -> bool) {}",
    ] {
        assert_eq!(found(text), 1, "{text}");
    }
    for text in [
        "fn f(a: u8, b: u8) {}",
        "fn f((index, line): (usize, &str)) -> (u8, u8) { let a: (u8, u8) = g(); }",
        "fn f(say: impl Fn(u8, u8) -> (u8, u8), next: fn(u8, u8)) {}",
        "#[cfg(test)] mod tests { fn f(a: (u8, u8)) {} }",
    ] {
        assert_eq!(found(text), 0, "{text}");
    }
}
