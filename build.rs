//! Lists the rules of countries, the files of `config/countries`, so that a new one needs no entry anywhere else.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;
use std::{env, fs};

const FOLDER: &str = "config/countries";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed={FOLDER}");
    let entries: Vec<_> = fs::read_dir(FOLDER)?.collect::<Result<_, _>>()?;
    let mut paths: Vec<_> = entries.iter().map(fs::DirEntry::path).collect();
    paths.sort_unstable();
    let mut list = "&[\n".to_owned();
    for path in paths.iter().filter(|path| path.extension().is_some_and(|extension| extension == "toml")) {
        let [name, file] = [path, &path.canonicalize()?].map(|path| path.display().to_string());
        writeln!(list, "({name:?}, include_bytes!({file:?})),")?;
    }
    fs::write(Path::new(&env::var("OUT_DIR")?).join("countries.rs"), list + "]\n")?;
    Ok(())
}
