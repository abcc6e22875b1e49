//! The result of a search for a bit rate as text and as JSON.

use serde_json::json;

use crate::report::text::counted;
use can_signal::can::bit_rate_scan::{ScanRefusal, ScanResult, ScanVerdict, TriedRate};

/// Returns the remedy for an interface that is not scanned.
pub fn remedy(interface: &str, refusal: ScanRefusal) -> String {
    match refusal {
        ScanRefusal::Missing | ScanRefusal::NotCan => {
            format!("signal-gateway doctor --interface {interface} names the CAN interfaces that there are")
        }
        ScanRefusal::Virtual => "all virtual interfaces take frames as they are".to_owned(),
        ScanRefusal::Up => format!("end what uses it, then: ip link set {interface} down"),
        ScanRefusal::NoListenOnly => {
            "use an adapter that has it, or the bit rate of the vehicle's documents".to_owned()
        }
    }
}

/// Formats the verdict, each rate that was tried, and the state in which the scan leaves the interface.
/// `had_bitrate` is whether a bit rate was set before.
pub fn text(interface: &str, result: &ScanResult, had_bitrate: bool) -> String {
    let mut text = format!("{interface}: {}\n", verdict(result.verdict));
    for TriedRate { bitrate_bps, heard } in &result.tried {
        let heard = match heard {
            Ok(heard) => {
                format!("{}, {}", counted(heard.frames, "frame"), counted(heard.error_frames, "error frame"))
            }
            Err(errno) => format!("not possible with this controller: {}", reason(*errno)),
        };
        text.push_str(&format!("  {bitrate_bps:>7} bit/s  {heard}\n"));
    }
    text.push_str(&state(interface, result, had_bitrate));
    if let ScanVerdict::Found(rate) | ScanVerdict::Likely(rate) = result.verdict {
        text.push_str(&format!(
            "to use it: ip link set {interface} up type can bitrate {rate} listen-only on\n"
        ));
    }
    text
}

/// Formats the same as one JSON object.
pub fn json(interface: &str, result: &ScanResult) -> String {
    let tried = result.tried.iter().map(|TriedRate { bitrate_bps, heard }| match heard {
        Ok(heard) => {
            json!({ "bitrate_bps": bitrate_bps, "frames": heard.frames, "error_frames": heard.error_frames })
        }
        Err(errno) => json!({ "bitrate_bps": bitrate_bps, "refused": reason(*errno) }),
    });
    let (name, rate) = match result.verdict {
        ScanVerdict::Found(rate) => ("found", Some(rate)),
        ScanVerdict::Likely(rate) => ("likely", Some(rate)),
        ScanVerdict::NoRate => ("no_rate", None),
        ScanVerdict::Silent => ("silent", None),
        ScanVerdict::Interrupted => ("interrupted", None),
        ScanVerdict::Refused(_) => ("refused", None),
    };
    let whole = json!({
        "interface": interface,
        "verdict": name,
        "bitrate_bps": rate,
        "tried": tried.collect::<Vec<_>>(),
        "is_restored": result.not_restored.is_none(),
    });
    format!("{whole}\n")
}

fn verdict(verdict: ScanVerdict) -> String {
    match verdict {
        ScanVerdict::Found(rate) => format!("the bit rate is {rate} bit/s"),
        ScanVerdict::Likely(rate) => {
            format!("the bit rate is probably {rate} bit/s; error frames came as well, so check the wiring")
        }
        ScanVerdict::NoRate => {
            "none of the usual bit rates fits: errors came, and no frame; perhaps it is a CAN FD bus".to_owned()
        }
        ScanVerdict::Silent => {
            "nothing came at any bit rate: switch the ignition on, check the wiring, and try again with more --seconds"
                .to_owned()
        }
        ScanVerdict::Interrupted => "ended before a bit rate was found".to_owned(),
        ScanVerdict::Refused(errno) if [libc::EPERM, libc::EACCES].contains(&errno) => {
            "only root may set a bit rate: run it with sudo".to_owned()
        }
        ScanVerdict::Refused(errno) => format!("the kernel refuses: {}", reason(errno)),
    }
}

fn state(interface: &str, result: &ScanResult, had_bitrate: bool) -> String {
    match result.not_restored {
        Some(errno) => format!(
            "{interface} could not be set as before: {}; take it down: ip link set {interface} down\n",
            reason(errno)
        ),
        None if had_bitrate || result.tried.is_empty() => format!("{interface} is down and set as before\n"),
        None => format!(
            "{interface} is down; it had no bit rate before, which the kernel cannot restore, and is left with \
             listen-only on\n"
        ),
    }
}

fn reason(errno: i32) -> String {
    std::io::Error::from_raw_os_error(errno).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use can_signal::can::bit_rate_scan::Heard;

    fn result(verdict: ScanVerdict) -> ScanResult {
        let heard = |bitrate_bps, frames, error_frames| TriedRate {
            bitrate_bps,
            heard: Ok(Heard { frames, error_frames }),
        };
        let refused = TriedRate { bitrate_bps: 250_000, heard: Err(libc::EINVAL) };
        ScanResult {
            verdict,
            tried: vec![heard(500_000, 0, 12), refused, heard(125_000, 5, 0)],
            not_restored: None,
        }
    }

    #[test]
    fn scan_tells_the_rate_what_was_tried_and_how_the_interface_is_left() {
        let found = result(ScanVerdict::Found(125_000));
        let expected = "can0: the bit rate is 125000 bit/s\n   500000 bit/s  0 frames, 12 error frames\n   250000 bit/s  \
             not possible with this controller: Invalid argument (os error 22)\n   125000 bit/s  5 frames, 0 error \
             frames\ncan0 is down and set as before\nto use it: ip link set can0 up type can bitrate 125000 \
             listen-only on\n";
        assert_eq!(text("can0", &found, true), expected);
        assert!(text("can0", &found, false).contains("and is left with listen-only on"));
        let stuck = ScanResult { not_restored: Some(libc::EBUSY), ..result(ScanVerdict::Silent) };
        assert!(text("can0", &stuck, true).contains("take it down: ip link set can0 down"));
        let denied = ScanResult { tried: Vec::new(), ..result(ScanVerdict::Refused(libc::EPERM)) };
        let expected =
            "can0: only root may set a bit rate: run it with sudo\ncan0 is down and set as before\n";
        assert_eq!(text("can0", &denied, false), expected);
        let value: serde_json::Value = serde_json::from_str(&json("can0", &found)).unwrap();
        assert_eq!((&value["bitrate_bps"], &value["tried"][2]["frames"]), (&json!(125_000), &json!(5)));
    }
}
