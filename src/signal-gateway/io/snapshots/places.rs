//! Places of status sockets: of the service, and of gateways that a user has started.

use std::fs::{DirBuilder, Permissions, canonicalize, read_dir, set_permissions, symlink_metadata};
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use rustix::process::geteuid;

use super::socket::{SocketError, StatusSocket};

/// Socket of the packaged service.
pub const SERVICE_SOCKET: &str = "/run/signal-gateway/status.sock";
/// Folder of the runtime directories of services.
const SERVICES: &str = "/run";
/// Name of the socket of a service in its runtime directory.
pub const SOCKET_OF_SERVICE: &str = "status.sock";
/// File mode of a user's socket: only the user may connect.
const MODE: u32 = 0o600;
/// Folder of a user's sockets, below the runtime directory; with more behind it, that of another service.
const FOLDER: &str = "signal-gateway";
/// Extension of a user's sockets.
const EXTENSION: &str = "sock";
/// Maximum number of gateways of one name and user.
const MAX_INSTANCES: u32 = 64;

/// Reason why a gateway without a configured place has no status socket.
#[derive(Debug, thiserror::Error)]
pub enum PlaceError {
    /// The user has no runtime directory: neither the one of the environment nor this one.
    #[error("XDG_RUNTIME_DIR is not set, and this user has no folder {}", .0.display())]
    NotSet(PathBuf),
    /// The runtime directory of the environment belongs to another user, or is missing.
    #[error("XDG_RUNTIME_DIR: {} is not a folder of this user", .0.display())]
    NotOwned(PathBuf),
    /// The folder of the sockets cannot be used.
    #[error("{folder}: {1}", folder = .0.display())]
    Folder(PathBuf, io::Error),
    /// The socket cannot be used.
    #[error(transparent)]
    Socket(#[from] SocketError),
}

impl PlaceError {
    /// Returns true if the user has no runtime directory, as in a container: nothing is wrong then.
    pub fn is_usual(&self) -> bool {
        match self {
            Self::NotSet(_) | Self::NotOwned(_) => true,
            Self::Folder(..) | Self::Socket(_) => false,
        }
    }
}

/// Binds a socket for this user in the runtime directory. If a gateway already has this name, a number is
/// added to it.
pub fn bind(name: &str) -> Result<StatusSocket, PlaceError> {
    bind_in(&user_folder()?, name)
}

fn bind_in(folder: &Path, name: &str) -> Result<StatusSocket, PlaceError> {
    private(folder).map_err(|error| PlaceError::Folder(folder.to_owned(), error))?;
    let path = |number: u32| match number {
        1 => folder.join(format!("{name}.{EXTENSION}")),
        _ => folder.join(format!("{name}-{number}.{EXTENSION}")),
    };
    for number in 1..MAX_INSTANCES {
        match StatusSocket::bind(&path(number), MODE) {
            Err(SocketError::InUse(_)) => {}
            bound => return Ok(bound?),
        }
    }
    Ok(StatusSocket::bind(&path(MAX_INSTANCES), MODE)?)
}

/// Returns the sockets that may belong to a running gateway: of services, then of this user, by name.
pub fn sockets() -> Vec<PathBuf> {
    let is_service = |path: &PathBuf| {
        path.is_dir()
            && path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(FOLDER.as_bytes()))
    };
    let services = entries(Path::new(SERVICES)).into_iter().filter(is_service);
    let own = user_folder().map_or_else(|_| Vec::new(), |folder| entries(&folder));
    let own = own.into_iter().filter(|path| path.extension().is_some_and(|extension| extension == EXTENSION));
    services.map(|folder| folder.join(SOCKET_OF_SERVICE)).chain(own).collect()
}

/// Returns the name of an instance by its socket: that of the service's folder, or of the user's socket.
pub fn instance_name(socket: &Path) -> String {
    let is_service = socket.file_name().is_some_and(|name| name == SOCKET_OF_SERVICE);
    let named = if is_service { socket.parent().unwrap_or(socket).file_name() } else { socket.file_stem() };
    named.unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the paths in a folder, by name; none if it cannot be read.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = read_dir(folder).into_iter().flatten();
    let mut paths: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.sort_unstable_by(|one, other| one.file_stem().cmp(&other.file_stem()));
    paths
}

/// Returns the path by which a running gateway names its configuration, whatever folder it was started in.
pub fn absolute_text(file: &Path) -> String {
    canonicalize(file).unwrap_or_else(|_| file.to_owned()).display().to_string()
}

/// Returns the folder of this user's sockets, which may not exist yet.
fn user_folder() -> Result<PathBuf, PlaceError> {
    let given = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|path| path.is_absolute());
    let usual = || PathBuf::from(format!("/run/user/{}", geteuid().as_raw()));
    let is_given = given.is_some();
    let folder = given.unwrap_or_else(usual);
    match (symlink_metadata(&folder).is_ok_and(|found| found.is_dir() && is_own(found.uid())), is_given) {
        (true, _) => Ok(folder.join(FOLDER)),
        (false, true) => Err(PlaceError::NotOwned(folder)),
        (false, false) => Err(PlaceError::NotSet(folder)),
    }
}

fn is_own(uid: u32) -> bool {
    uid == geteuid().as_raw()
}

/// Creates a folder that only this user can enter, or makes an existing one private.
fn private(folder: &Path) -> io::Result<()> {
    match DirBuilder::new().mode(0o700).create(folder) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
        Ok(()) | Err(_) => {}
    }
    let found = symlink_metadata(folder)?;
    if !found.is_dir() || !is_own(found.uid()) {
        return Err(io::Error::other("expected a folder of this user"));
    }
    if found.permissions().mode() & 0o077 != 0 {
        set_permissions(folder, Permissions::from_mode(0o700))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;
    use std::os::unix::net::UnixListener;

    fn mode(path: &Path) -> u32 {
        symlink_metadata(path).unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn folder_and_socket_are_private_and_the_file_goes_with_the_socket() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("signal-gateway");
        DirBuilder::new().mode(0o755).create(&folder).unwrap();
        let socket = bind_in(&folder, "car").unwrap();
        let path = folder.join("car.sock");
        assert_eq!((mode(&folder), mode(&path)), (0o700, 0o600));
        drop(socket);
        assert!(!path.exists());
    }

    #[test]
    fn each_gateway_of_a_name_has_a_socket_and_a_stale_one_is_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("signal-gateway");
        private(&folder).unwrap();
        drop(UnixListener::bind(folder.join("car.sock")).unwrap());
        let first = bind_in(&folder, "car").unwrap();
        let inode = symlink_metadata(folder.join("car.sock")).unwrap().ino();
        let second = bind_in(&folder, "car").unwrap();
        let third = bind_in(&folder, "car").unwrap();
        assert_eq!(symlink_metadata(folder.join("car.sock")).unwrap().ino(), inode, "it is not taken over");
        assert!(folder.join("car-2.sock").exists() && folder.join("car-3.sock").exists());
        drop(second);
        let again = bind_in(&folder, "car").unwrap();
        assert!(folder.join("car-2.sock").exists() && !folder.join("car-4.sock").exists());
        drop((first, third, again));
    }

    #[test]
    fn folder_that_is_a_link_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("signal-gateway");
        symlink(dir.path(), &folder).unwrap();
        assert!(matches!(bind_in(&folder, "car"), Err(PlaceError::Folder(..))));
    }
}
