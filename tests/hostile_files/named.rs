//! Recordings that are hostile on purpose, each in one way.

use super::case::Case;
use super::packing::{PACKINGS, Packing};
use super::recordings::{Frame, blf, drive};
use super::{named_lines, named_mcap, named_mf4, named_objects, named_sqlite};

/// A name, the commands that read it, how many lines `decode` prints at least, and how it is made with about
/// so many bytes.
pub(crate) struct Named(
    pub(crate) &'static str,
    pub(crate) &'static [&'static str],
    pub(crate) usize,
    pub(crate) fn(usize) -> Vec<u8>,
);

/// How many frames stand before what is hostile, if there can be any.
pub(crate) const FRAMES: usize = 20;
/// Lines that `decode` prints for them.
pub(crate) const DECODED: usize = 35;

pub(crate) const MOST: &[&str] = &["check", "decode", "mcap"];
pub(crate) const QUICK: &[&str] = &["decode", "check"];

/// Those of few frames, which are far apart.
const FEW: &[&str] = &["scattered.mcap", "jumps.candump.log"];

/// A name, and what makes the case.
pub(crate) type NamedCase = (&'static str, Box<dyn Fn() -> Case + Sync + Send>);

/// All of them; what can be of any size has about `size` bytes.
pub(crate) fn all(size: usize) -> Vec<NamedCase> {
    let lists = [named_mcap::ALL, named_sqlite::ALL, named_mf4::ALL, named_objects::ALL, named_lines::ALL];
    let mut all: Vec<NamedCase> = Vec::new();
    for Named(name, commands, decoded, make) in lists.into_iter().flatten() {
        let case = move || {
            let has_few_frames = FEW.contains(name);
            Case { has_few_frames, ..Case::recording(*name, make(size), commands).decoding(*decoded) }
        };
        all.push((name, Box::new(case)));
    }
    for packing in PACKINGS {
        let name = match packing {
            Packing::Gzip => "flipped.blf.gz",
            Packing::Bzip2 => "flipped.blf.bz2",
            Packing::Xz => "flipped.blf.xz",
            Packing::Zstd => "flipped.blf.zst",
            Packing::Lz4 => "flipped.blf.lz4",
        };
        all.push((name, Box::new(move || flipped(name, packing))));
    }
    all
}

/// A file of one object, of which one byte was flipped when it had been packed: each byte in a file of its
/// own.
fn flipped(name: &str, packing: Packing) -> Case {
    let file = packing.pack(&[blf::head(), blf::frame(&turn())].concat());
    let one = |at: usize| {
        let mut content = file.clone();
        content[at] ^= 0xFF;
        Case::recording(format!("{name}.{at}"), content, &["check"])
    };
    let mut all = Case::recording(name, file.clone(), &["check"]);
    for case in (0..file.len()).map(one) {
        all.files.extend(case.files);
        all.runs.extend(case.runs);
    }
    all
}

pub(crate) fn turn() -> Frame {
    drive(1).remove(0)
}

/// The same content again and again.
pub(crate) fn gzip_of(content: &[u8], size: usize) -> Vec<u8> {
    let piece = Packing::Gzip.pack(content);
    piece.repeat(size / piece.len() + 1)
}
