//! Makes `config/demo.log.gz`, the recording of the demo vehicle:
//!
//! ```text
//! cargo run --example make_demo_recording -- config/demo.log.gz
//! cargo run --example make_demo_recording -- --story
//! ```

mod demo_recording;

use std::fs::File;
use std::io::{self, Write};

use flate2::{Compression, GzBuilder};

fn main() -> io::Result<()> {
    let mut arguments = std::env::args_os().skip(1);
    match (arguments.next(), arguments.next()) {
        (Some(story), None) if story == "--story" => demo_recording::write_story(&mut io::stdout().lock()),
        (Some(path), None) => {
            // No time and no file name in the header: the same bytes every time.
            let file = File::create(path)?;
            let mut out = GzBuilder::new().mtime(0).write(io::BufWriter::new(file), Compression::best());
            demo_recording::write_recording(&mut out)?;
            out.finish()?.flush()
        }
        _ => Err(io::Error::other("give the file to write, or --story")),
    }
}
