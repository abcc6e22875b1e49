//! Makes the decoder of the demo vehicle's DBC, as dbc-codegen does it.

use std::path::Path;

fn main() {
    let dbc = "../../dbc/demo_vehicle.dbc";
    println!("cargo:rerun-if-changed={dbc}");
    let text = std::fs::read_to_string(dbc).unwrap();
    let out = Path::new(&std::env::var_os("OUT_DIR").unwrap()).join("demo_vehicle.rs");
    let config = dbc_codegen::Config::builder().dbc_name("demo_vehicle.dbc").dbc_content(&text).build();
    config.write_to_file(out).unwrap();
}
