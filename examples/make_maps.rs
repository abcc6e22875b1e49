//! Makes the small maps below `config/maps`, for drive scenarios:
//!
//! ```text
//! cargo run --example make_maps -- config/maps
//! ```

mod maps;

use std::io;
use std::path::PathBuf;

fn main() -> io::Result<()> {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(folder), None) = (arguments.next(), arguments.next()) else {
        return Err(io::Error::other("give the folder to write to"));
    };
    for map in maps::ALL {
        let folder = PathBuf::from(&folder).join(map.name);
        std::fs::create_dir_all(&folder)?;
        std::fs::write(folder.join(maps::MAP_FILE), map.osm())?;
        std::fs::write(folder.join(maps::PROJECTOR_FILE), maps::PROJECTOR)?;
    }
    Ok(())
}
