//! Prerequisites of a test on its machine. A test without one is skipped visibly; with
//! `tests/run --full` it fails, unless the machine is allowed to lack the thing.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::sync::Mutex;

/// Something a machine may not have, by the name it has in `tests/prerequisites`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Prerequisite {
    /// A CAN interface `vcan0`, and root to make more: what `tests/with-vcan` provides.
    Vcan,
    /// A CAN interface on a serial line: the kernel's `slcan`.
    Slcan,
    /// `cansend` and `canplayer` of can-utils.
    CanUtils,
    /// A Python with the pinned peers, named by `SIGNAL_GATEWAY_PEER_PYTHON`.
    PeerPython,
    /// A Python with the pinned readers of MCAP, named by `SIGNAL_GATEWAY_MCAP_PYTHON`.
    McapPython,
    /// A Python with the pinned opendbc, named by `SIGNAL_GATEWAY_OPENDBC_PYTHON`.
    Opendbc,
    /// A C++ compiler and the headers of Fast DDS 2.
    FastDds,
    /// `idlc` and the headers of the Cyclone DDS of the system.
    CycloneDds,
    /// Root and iproute2, to make network namespaces.
    NetworkNamespaces,
    /// Recordings and DBC files of real vehicles, which are not the project's to publish.
    SharedData,
    /// The right to mount a `tmpfs`.
    Tmpfs,
    /// A `systemd-analyze` that can judge a unit file.
    SystemdAnalyze,
    /// `tc`, and a kernel with `sch_netem`, as `tests/with-vcan` brings one.
    Netem,
    /// `prometheus` and its `promtool`.
    Prometheus,
    /// `tmux`, which plays a terminal.
    Tmux,
    /// Public lanelet2 maps in a folder that `SIGNAL_GATEWAY_MAPS` names.
    PublicMaps,
    /// A `zenoh-bridge-ros2dds`, named by `SIGNAL_GATEWAY_BRIDGE`.
    ZenohBridge,
}

impl Prerequisite {
    fn name(self) -> &'static str {
        match self {
            Self::Vcan => "vcan",
            Self::Slcan => "slcan",
            Self::CanUtils => "can-utils",
            Self::PeerPython => "peer-python",
            Self::McapPython => "mcap-python",
            Self::Opendbc => "opendbc",
            Self::FastDds => "fast-dds",
            Self::CycloneDds => "cyclone-dds",
            Self::NetworkNamespaces => "network-namespaces",
            Self::SharedData => "shared-data",
            Self::Tmpfs => "tmpfs",
            Self::SystemdAnalyze => "systemd-analyze",
            Self::Netem => "netem",
            Self::Prometheus => "prometheus",
            Self::Tmux => "tmux",
            Self::PublicMaps => "public-maps",
            Self::ZenohBridge => "zenoh-bridge",
        }
    }

    /// Returns the way to get it, from `tests/prerequisites`.
    ///
    /// # Panics
    /// If it is not listed there.
    fn remedy(self) -> &'static str {
        let lines = include_str!("../prerequisites").lines();
        let mut rows = lines.filter_map(|line| line.trim_end().split_once(' '));
        let (_, rest) = rows.find(|(name, _)| *name == self.name()).unwrap();
        rest.trim_start().split_once(' ').unwrap().1.trim_start()
    }

    /// The error that a helper returns to [`require!`].
    pub(crate) fn missing(self, why: impl Into<String>) -> Missing {
        Missing { what: self, why: why.into() }
    }
}

/// A prerequisite that is not there, and why.
#[derive(Debug)]
pub(crate) struct Missing {
    what: Prerequisite,
    why: String,
}

/// The number of skipped tests and the way to get what they lack, by prerequisite.
static SKIPPED: Mutex<BTreeMap<&str, (usize, &str)>> = Mutex::new(BTreeMap::new());

impl Missing {
    /// Reports the test as skipped, on standard error and past the capture of libtest, now and once more at
    /// the end of the program, below libtest's count, which takes it for passed.
    ///
    /// # Panics
    /// If `SIGNAL_GATEWAY_MAY_LACK` is set and does not list the prerequisite.
    pub(crate) fn skip(&self, test: &str) {
        let (what, why) = (self.what.name(), &self.why);
        if let Ok(may_lack) = std::env::var("SIGNAL_GATEWAY_MAY_LACK") {
            let allowed = may_lack.split_whitespace().any(|name| name == what);
            assert!(allowed, "{what} is missing, and a full run must have it: {why}");
        }
        let line = format!("skipped: {test}: {what}: {why}\n");
        std::io::stderr().write_all(line.as_bytes()).unwrap();
        let mut skipped = SKIPPED.lock().unwrap();
        if skipped.is_empty() {
            at_exit(list_skipped);
        }
        skipped.entry(what).or_insert((0, self.what.remedy())).0 += 1;
    }
}

/// The name of this program of tests.
const SUITE: &str = env!("CARGO_CRATE_NAME");

/// Says how many of the tests above did not run at all, and what they lack.
extern "C" fn list_skipped() {
    let Ok(skipped) = SKIPPED.lock() else { return };
    let mut text = String::new();
    for (what, (count, remedy)) in &*skipped {
        text.push_str(&format!(
            "not passed but skipped, without {what}: {count} tests of {SUITE}; to have it: {remedy}\n"
        ));
    }
    let _unseen = std::io::stderr().write_all(text.as_bytes());
    // For the end of `cargo test`, see tests/runner/rustdoc.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("skipped");
    let program = std::env::args_os().next().unwrap_or_default();
    if let (Ok(()), Some(program)) = (fs::create_dir_all(&folder), Path::new(&program).file_name()) {
        let _unseen = fs::write(folder.join(program), text);
    }
}

/// Has `run` called at the end of the program: libtest has nothing for that.
#[allow(unsafe_code)]
fn at_exit(run: extern "C" fn()) {
    // SAFETY: the function takes nothing, does not unwind, and lives as long as the program.
    assert_eq!(unsafe { libc::atexit(run) }, 0);
}

/// The value of a `Result<_, Missing>`; without it, the test ends here and is reported as skipped.
macro_rules! require {
    ($found:expr) => {
        match $found {
            Ok(found) => found,
            Err(missing) => {
                missing.skip($crate::support::prerequisite::test_name(std::any::type_name_of_val(&|| ())));
                return;
            }
        }
    };
}
pub(crate) use require;

/// The test's name as libtest prints it, from the type name of a closure in it.
pub(crate) fn test_name(closure: &'static str) -> &'static str {
    let name = closure.split_once("::").map_or(closure, |(_, name)| name);
    name.split_once("::{{closure}}").map_or(name, |(name, _)| name)
}

/// The pinned peers: `cyclonedds`, `cantools`, `python-can`.
pub(crate) fn peer_python() -> Result<std::path::PathBuf, Missing> {
    let python = std::env::var_os("SIGNAL_GATEWAY_PEER_PYTHON");
    let why = "SIGNAL_GATEWAY_PEER_PYTHON is not set (tests/run sets it)";
    python.map(Into::into).ok_or_else(|| Prerequisite::PeerPython.missing(why))
}

/// The pinned readers of MCAP: `rosbags`, `mcap-ros2-support`.
pub(crate) fn mcap_python() -> Result<std::path::PathBuf, Missing> {
    let python = std::env::var_os("SIGNAL_GATEWAY_MCAP_PYTHON");
    let why = "SIGNAL_GATEWAY_MCAP_PYTHON is not set (tests/run sets it)";
    python.map(Into::into).ok_or_else(|| Prerequisite::McapPython.missing(why))
}

/// opendbc, with its packer and its car states.
pub(crate) fn opendbc_python() -> Result<std::path::PathBuf, Missing> {
    let python = std::env::var_os("SIGNAL_GATEWAY_OPENDBC_PYTHON");
    let why = "SIGNAL_GATEWAY_OPENDBC_PYTHON is not set (tests/run sets it)";
    python.map(Into::into).ok_or_else(|| Prerequisite::Opendbc.missing(why))
}

/// `cansend` and `canplayer`.
pub(crate) fn can_utils() -> Result<(), Missing> {
    let there = ["cansend", "canplayer"].map(|tool| std::process::Command::new(tool).output().is_ok());
    there
        .iter()
        .all(|there| *there)
        .then_some(())
        .ok_or_else(|| Prerequisite::CanUtils.missing("not installed"))
}

/// The folder with files of real vehicles: `SIGNAL_GATEWAY_SHARED`, or `../shared` beside the project.
pub(crate) fn shared_data() -> Result<std::path::PathBuf, Missing> {
    let given = std::env::var_os("SIGNAL_GATEWAY_SHARED").map(std::path::PathBuf::from);
    let folder =
        given.unwrap_or_else(|| concat!(env!("CARGO_MANIFEST_DIR"), "/../shared").into()).join("data");
    if folder.is_dir() { Ok(folder) } else { Err(Prerequisite::SharedData.missing("../shared is absent")) }
}

/// The folder with public lanelet2 maps, in folders of their own: `SIGNAL_GATEWAY_MAPS`.
pub(crate) fn public_maps() -> Result<std::path::PathBuf, Missing> {
    let folder = std::env::var_os("SIGNAL_GATEWAY_MAPS").map(std::path::PathBuf::from);
    folder.ok_or_else(|| Prerequisite::PublicMaps.missing("SIGNAL_GATEWAY_MAPS is not set"))
}
