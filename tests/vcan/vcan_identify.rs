//! `identify --live` with simulated vehicles on the bus.

mod slow {
    use std::process::{Command, Stdio};

    use crate::support::prerequisite::require;
    use crate::support::vcan::Vcan;

    const GATEWAY: &str = env!("CARGO_BIN_EXE_signal-gateway");

    /// A driver who uses everything; the vehicle answers at once.
    const SCRIPT: &str =
        "0.5 stalk left\n3 stalk off\n4 stalk right\n6.5 stalk off\n7 hazard on\n9 hazard off\n";

    #[test]
    fn simulated_vehicles_are_found_on_their_bus() {
        let vcan = require!(Vcan::new("vcanident"));
        let folder = tempfile::tempdir().unwrap();
        let script = folder.path().join("drive.txt");
        std::fs::write(&script, SCRIPT).unwrap();
        for profile in ["hyundai_kia", "vw_mqb", "subaru_outback_2015"] {
            let mut vehicle = Command::new(GATEWAY)
                .args(["vehicle", "--profile", profile, "--interface", vcan.name, "--script"])
                .arg(&script)
                .stdin(Stdio::null())
                .stdout(Stdio::null())
                .spawn()
                .unwrap();
            let listen = ["identify", "--live", vcan.name, "--seconds", "12", "--json"];
            let output = Command::new(GATEWAY).args(listen).output().unwrap();
            vehicle.kill().unwrap();
            vehicle.wait().unwrap();
            let text = String::from_utf8_lossy(&output.stdout);
            let found: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
            let first = &found["candidates"][0]["profile"];
            assert_eq!(first, profile, "{text}{}", String::from_utf8_lossy(&output.stderr));
        }
    }
}
