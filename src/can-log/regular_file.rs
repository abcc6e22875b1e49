//! Opens files for reading, and refuses devices: `/dev/zero` has no end.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

/// Opens a regular file or a pipe for reading.
///
/// # Errors
/// Fails with an error of the system, such as a missing file, or for a folder, device or socket, with a
/// remedy.
pub fn open(path: &Path) -> io::Result<File> {
    // Opening a device can already have an effect, so its kind is checked first.
    let kind = path.metadata()?.file_type();
    if kind.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !kind.is_file() && !kind.is_fifo() {
        let what = if kind.is_socket() { "a socket" } else { "a device" };
        let text = format!("this is {what}, not a file: give a file or a pipe, or - for standard input");
        return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
    }
    File::open(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_and_pipes_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "a").unwrap();
        assert!(open(&path).is_ok());
        assert_eq!(open(folder.path()).unwrap_err().kind(), io::ErrorKind::IsADirectory);
        assert_eq!(open(&folder.path().join("b")).unwrap_err().kind(), io::ErrorKind::NotFound);
        for device in ["/dev/zero", "/dev/urandom", "/dev/null"] {
            let text = open(Path::new(device)).unwrap_err().to_string();
            assert!(text.starts_with("this is a device, not a file: give a file"), "{device}: {text}");
        }
        let path = folder.path().join("socket");
        let _socket = std::os::unix::net::UnixListener::bind(&path).unwrap();
        assert!(open(&path).unwrap_err().to_string().starts_with("this is a socket"));
    }
}
