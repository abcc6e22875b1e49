//! Standard input as a file with the name `-`. It cannot be read twice, so its content is kept once it was
//! read as a whole.

use std::io::{self, Read};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// The content after it was read as a whole.
static CONTENT: Mutex<Option<Vec<u8>>> = Mutex::new(None);

/// Returns true for the name of standard input.
pub fn is_named(path: &Path) -> bool {
    path == Path::new("-")
}

/// Returns the whole content, the same at each call; at most `most` bytes plus one.
pub fn content(most: u64) -> io::Result<Vec<u8>> {
    let mut kept = CONTENT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(content) = kept.as_ref() {
        return Ok(content.clone());
    }
    let mut content = Vec::new();
    io::stdin().take(most + 1).read_to_end(&mut content)?;
    *kept = Some(content.clone());
    Ok(content)
}

/// Returns standard input as a stream. Fails if it was already read as a whole for another file of the same
/// command.
pub fn stream() -> io::Result<io::Stdin> {
    if CONTENT.lock().unwrap_or_else(PoisonError::into_inner).is_some() {
        let text = "standard input was already read for another file: give - only once";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
    }
    Ok(io::stdin())
}
