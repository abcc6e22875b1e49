//! A hostile case: files, and the commands that read them.

/// Files that stand in a folder of their own, and what is run there.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) files: Vec<(String, Vec<u8>)>,
    pub(crate) runs: Vec<Vec<String>>,
    /// How many lines `decode` has to print at least: what stands before the damage.
    pub(crate) decoded: usize,
    /// What of the file has to be held whole, so that its memory may grow with what is unpacked.
    pub(crate) is_held_whole: bool,
    /// True if there is little to write about it.
    pub(crate) has_few_frames: bool,
}

impl Case {
    /// A recording, read by the commands of these names.
    pub(crate) fn recording(name: impl Into<String>, content: Vec<u8>, commands: &[&str]) -> Self {
        let name = name.into();
        let runs = commands.iter().map(|command| of_recording(command, &name)).collect();
        let is_held_whole = [".mf4", ".sqlite", ".db3"].iter().any(|format| name.contains(format));
        Self {
            files: vec![(name.clone(), content)],
            name,
            runs,
            decoded: 0,
            is_held_whole,
            has_few_frames: false,
        }
    }

    /// A file of another kind, which is read by what the words say; `{}` is its name.
    pub(crate) fn other(name: &str, content: Vec<u8>, runs: &[&str]) -> Self {
        let words = |run: &&str| run.split(' ').map(|word| word.replace("{}", name)).collect();
        let runs = runs.iter().map(words).collect();
        Self {
            name: name.to_owned(),
            files: vec![(name.to_owned(), content)],
            runs,
            decoded: 0,
            is_held_whole: false,
            has_few_frames: false,
        }
    }

    pub(crate) fn with(mut self, name: &str, content: impl Into<Vec<u8>>) -> Self {
        self.files.push((name.to_owned(), content.into()));
        self
    }

    pub(crate) fn decoding(self, decoded: usize) -> Self {
        Self { decoded, ..self }
    }
}

/// All commands that read a recording of CAN frames.
pub(crate) const READING: [&str; 5] = ["check", "decode", "replay", "mcap", "identify"];

fn of_recording(command: &str, name: &str) -> Vec<String> {
    let words: &[&str] = match command {
        "identify" => &["identify", name],
        "replay" => &["replay", name, "-p", "demo_vehicle", "--json"],
        "mcap" => &["replay", name, "-p", "demo_vehicle", "--mcap", "written"],
        "decide" => &["decide", name, "--map", "map.osm"],
        other => &[other, name, "-p", "demo_vehicle"],
    };
    words.iter().map(|word| (*word).to_owned()).collect()
}
