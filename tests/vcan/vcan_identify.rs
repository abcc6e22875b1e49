//! `identify --live` with simulated vehicles on the bus.

mod slow {
    use std::io::Write as _;
    use std::process::{Command, Stdio};
    use std::time::Duration;

    use crate::support::prerequisite::require;
    use crate::support::vcan::Vcan;
    use crate::support::waiting::Pace;

    const GATEWAY: &str = env!("CARGO_BIN_EXE_signal-gateway");

    /// A driver who uses everything, again and again; the vehicle answers at once.
    const ACTIONS: [&str; 6] =
        ["stalk left", "stalk off", "stalk right", "stalk off", "hazard on", "hazard off"];

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn simulated_vehicles_are_found_on_their_bus() {
        let vcan = require!(Vcan::new("vcanident"));
        for profile in ["hyundai_kia", "vw_mqb", "subaru_outback_2015"] {
            let mut vehicle = Command::new(GATEWAY)
                .args(["vehicle", "--profile", profile, "--interface", vcan.name])
                .stdin(Stdio::piped())
                .stdout(Stdio::null())
                .spawn()
                .unwrap();
            let mut driver = vehicle.stdin.take().unwrap();
            let driving = std::thread::spawn(move || {
                let mut pace = Pace::every(Duration::from_millis(1_500));
                // Until the vehicle is gone.
                for action in ACTIONS.iter().cycle() {
                    if writeln!(driver, "{action}").is_err() {
                        return;
                    }
                    pace.wait();
                }
            });
            let listen = ["identify", "--live", vcan.name, "--seconds", "20", "--json"];
            let output = Command::new(GATEWAY).args(listen).output().unwrap();
            vehicle.kill().unwrap();
            vehicle.wait().unwrap();
            driving.join().unwrap();
            let text = String::from_utf8_lossy(&output.stdout);
            let found: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
            let first = &found["candidates"][0]["profile"];
            assert_eq!(first, profile, "{text}{}", String::from_utf8_lossy(&output.stderr));
        }
    }
}
