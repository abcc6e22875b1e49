//! Explains why a file of a command cannot be read or written, and names the remedy.

use std::io::{self, Read};
use std::path::Path;

use super::failure::Failure;
use super::messages;
use crate::config::built_in::{BuiltIn, display};
use crate::config::car_models;
use crate::config::file_kind::FileKind;
use crate::config::{Refusal, Refused};
use can_log::{NotRecording, regular_file, standard_input};
use gateway_base::near_miss::nearest;
use vehicle_bringup::car_model::{ModelVerdict, find};

/// Number of bytes that are read to recognise a file.
pub(super) const HEAD: u64 = 16 << 10;

pub(super) fn show(path: &Path, error: &io::Error) {
    let NotRecording { reason, remedy } = explained(path, error);
    messages::file_error(path, &reason, &remedy);
}

/// Writes why a file cannot be written, and the remedy.
#[allow(clippy::wildcard_enum_match_arm)] // there are forty kinds
pub(super) fn show_unwritable(path: &Path, error: &io::Error) {
    let (reason, remedy) = match error.kind() {
        io::ErrorKind::NotFound => ("there is no such folder", "make the folder first"),
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            ("this user may not write it", "write to another folder, or use sudo")
        }
        io::ErrorKind::AlreadyExists => {
            ("it exists already, and is not replaced", "give another name, or remove it first")
        }
        io::ErrorKind::IsADirectory => ("this is a folder, not a file", "give the name of a file in it"),
        io::ErrorKind::StorageFull => ("the disk is full", "make room, or write to another disk"),
        _ => return messages::error(&format!("{}: {error}", display(path)), ""),
    };
    messages::error(&format!("{}: cannot write it: {reason}", display(path)), remedy);
}

#[allow(clippy::wildcard_enum_match_arm)] // there are forty kinds
fn explained(path: &Path, error: &io::Error) -> NotRecording {
    let texts = |reason: &str, remedy: &str| NotRecording { reason: reason.into(), remedy: remedy.into() };
    match error.kind() {
        io::ErrorKind::NotFound => texts("there is no such file", &neighbour(path).unwrap_or_default()),
        io::ErrorKind::PermissionDenied => {
            texts("permission denied", "let this user read it, e.g. with chmod a+r")
        }
        io::ErrorKind::IsADirectory => texts("this is a folder, not a recording", &in_folder(path)),
        io::ErrorKind::UnexpectedEof => texts("it breaks off before its first frame", "copy it again"),
        io::ErrorKind::InvalidData | io::ErrorKind::Unsupported => {
            match head(path).and_then(|head| FileKind::Recording.mismatch(&head)) {
                Some(Refusal { reason, remedy }) if remedy.is_empty() => {
                    texts(&reason, &format!("these are read: {}", can_log::names().join(", ")))
                }
                Some(Refusal { reason, remedy }) => texts(&reason, &remedy),
                None => match error.get_ref().and_then(|inner| inner.downcast_ref::<NotRecording>()) {
                    Some(NotRecording { reason, remedy }) => texts(reason, remedy),
                    None => texts(&error.to_string(), ""),
                },
            }
        }
        _ => texts(&error.to_string(), ""),
    }
}

fn head(path: &Path) -> Option<Vec<u8>> {
    let mut head = Vec::new();
    regular_file::open(path).ok()?.take(HEAD).read_to_end(&mut head).ok()?;
    Some(head)
}

/// Returns a hint to a similar file in the folder, or to a built-in profile of that name.
fn neighbour(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    if BuiltIn::Profile.path(&name).is_some() {
        return Some(format!("{name} is a built-in profile: give it with --profile {name}"));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new("."))).ok();
    let Some(entries) = entries else {
        return Some(format!("there is no folder {} either", folder?.display()));
    };
    let names: Vec<_> =
        entries.filter_map(|entry| Some(entry.ok()?.file_name().to_string_lossy().into_owned())).collect();
    let near = nearest(&name, names.iter().map(String::as_str))?;
    Some(format!("did you mean {}?", path.with_file_name(near).display()))
}

/// Refuses a missing file, or a file of another kind, before anything else is read.
pub(super) fn expect_recording(path: &Path) -> Result<(), Failure> {
    if standard_input::is_named(path) {
        return Ok(());
    }
    // Bytes read from a pipe would be lost.
    let is_file = std::fs::metadata(path).map_err(Failure::file(path))?.is_file();
    match Some(path).filter(|_| is_file).and_then(head).and_then(|head| FileKind::of(&head)) {
        None | Some(FileKind::Recording | FileKind::Other(_)) => Ok(()),
        Some(_) => Err(Failure::file(path)(io::ErrorKind::InvalidData.into())),
    }
}

/// Adds hints to similar files to the problems with missing files. A `profile` that resembles a built-in
/// profile already has its hint.
pub(super) fn with_neighbours(Refused(mut problems): Refused, profile: Option<&Path>) -> Refused {
    let has_hint = |path: &Path| profile == Some(path) && !BuiltIn::Profile.probably_meant(path).is_empty();
    for problem in problems.iter_mut().filter(|problem| problem.position.is_none()) {
        if !problem.file.exists() && !has_hint(&problem.file) {
            let car = profile.filter(|profile| *profile == problem.file).and_then(car);
            let hint = car.or_else(|| neighbour(&problem.file));
            problem.remedy = hint.unwrap_or_else(|| std::mem::take(&mut problem.remedy));
        }
    }
    Refused(problems)
}

/// Returns a hint to the profiles of a car that was given in the place of a profile.
fn car(path: &Path) -> Option<String> {
    let name = path.to_str()?;
    let models = car_models::models().ok()?;
    let is_known = find(&models, name).verdict > ModelVerdict::NoProfile;
    is_known.then(|| format!("this is a car: `signal-gateway profiles find {name}` names its profiles"))
}

/// Returns a hint to a recording in the folder.
fn in_folder(path: &Path) -> String {
    let files = std::fs::read_dir(path).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
    let is_recording = |file: &Path| {
        file.is_file() && head(file).is_some_and(|head| FileKind::of(&head) == Some(FileKind::Recording))
    };
    match files.take(100).find(|file| is_recording(file)) {
        Some(file) => format!("give one of its files, e.g. {}", file.display()),
        None => "give a recording".to_owned(),
    }
}
