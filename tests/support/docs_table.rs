//! Tables of documents that are made from rows, each between two comments.

use std::path::Path;

/// Compares the table between two comments of a document with this one; with `UPDATE_DOCS` set, puts it
/// there. `test` is the filter that runs the caller.
pub(crate) fn check(document: &str, [begin, end]: [&str; 2], table: &str, test: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(document);
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once(begin).unwrap();
    let (shown, after) = rest.split_once(end).unwrap();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(path, [before, begin, table, end, after].concat()).unwrap();
    } else {
        assert_eq!(shown, table, "renew it: UPDATE_DOCS=1 cargo test --test pure {test}");
    }
}
