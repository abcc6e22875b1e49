//! The built binary as a process, and a folder with its configuration.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::waiting::{self, Bystander, wait_for};

/// Longest time of an orderly end; systemd kills the service after 5 s.
const STOP_LIMIT: Duration = Duration::from_secs(4);

/// A folder with a configuration; it goes when the test ends.
pub(crate) struct Folder(tempfile::TempDir);

/// A folder in memory where there is one: while compilers write, a disk takes seconds to sync a file.
fn in_memory() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap()
}

impl Folder {
    /// The lights of the demo vehicle on `interface`; `keys` are further ones, top-level keys first. Without
    /// the vehicle's status, a frame of each light is all that the gateway waits for.
    pub(crate) fn with_demo_vehicle(interface: &str, keys: &str) -> Self {
        let folder = Self(in_memory());
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR"));
        let profile = std::fs::read_to_string(shipped.join("tests/support/lights_vehicle.toml")).unwrap();
        let dbc = format!("{}/dbc/demo_vehicle.dbc", shipped.display());
        folder.write("demo_vehicle.toml", &profile.replace("../../dbc/demo_vehicle.dbc", &dbc));
        let (top, sections) = keys.split_at(keys.find('[').unwrap_or(keys.len()));
        let buses = format!("[can.body]\ninterface = \"{interface}\"\n");
        folder.write("gateway.toml", &format!("profile = \"demo_vehicle.toml\"\n{top}{buses}{sections}"));
        folder
    }

    /// Nothing but a configuration.
    #[allow(dead_code)] // most tests need a vehicle
    pub(crate) fn with_configuration(text: &str) -> Self {
        let folder = Self(in_memory());
        folder.write("gateway.toml", text);
        folder
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    #[allow(dead_code)] // not every test adds something
    pub(crate) fn append(&self, name: &str, text: &str) {
        let before = std::fs::read_to_string(self.path().join(name)).unwrap();
        self.write(name, &(before + text));
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path().join(name), text).unwrap();
    }
}

/// `[ros]` on this machine only, in a domain that no other test uses.
pub(crate) fn ros() -> String {
    ros_in(super::peer::domain())
}

/// Likewise, in this domain.
pub(crate) fn ros_in(domain: u16) -> String {
    let enabled = cfg!(feature = "ros");
    format!("[ros]\nenabled = {enabled}\ndomain_id = {domain}\nonly_networks = [\"127.0.0.1\"]\n")
}

/// A running gateway. Killed at the latest when the test ends, which prints its log if it failed.
pub(crate) struct Process {
    child: Child,
    started: Instant,
    log: Arc<(Mutex<Log>, Condvar)>,
    reader: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Log {
    lines: Vec<String>,
    has_ended: bool,
}

impl Process {
    /// `signal-gateway run` with the folder's configuration.
    pub(crate) fn run(folder: &Folder) -> Self {
        Self::run_with(folder, |_| {})
    }

    /// Likewise, with something changed about the command.
    pub(crate) fn run_with(folder: &Folder, change: impl FnOnce(&mut Command)) -> Self {
        Self::start(folder.path(), |command| {
            command.args(["run", "--config"]).arg(folder.path().join("gateway.toml"));
            change(command);
        })
    }

    pub(crate) fn start(directory: &Path, change: impl FnOnce(&mut Command)) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
        command.current_dir(directory).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let ros = [
            "ROS_DISTRO",
            "ROS_DOMAIN_ID",
            "ROS_AUTOMATIC_DISCOVERY_RANGE",
            "ROS_LOCALHOST_ONLY",
            "ROS_STATIC_PEERS",
        ];
        for variable in ["RUST_LOG", "NOTIFY_SOCKET", "WATCHDOG_USEC"].into_iter().chain(ros) {
            command.env_remove(variable);
        }
        // Not that of whoever runs the tests.
        command.env("XDG_RUNTIME_DIR", directory);
        change(&mut command);
        let started = Instant::now();
        let mut child = command.spawn().unwrap();
        let log = Arc::<(Mutex<Log>, Condvar)>::default();
        let writer = Arc::clone(&log);
        // None where the test has given it another standard error.
        let reader = child.stderr.take().map(|stderr| {
            std::thread::spawn(move || {
                for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                    writer.0.lock().unwrap().lines.push(line);
                    writer.1.notify_all();
                }
                writer.0.lock().unwrap().has_ended = true;
                writer.1.notify_all();
            })
        });
        Self { child, started, log, reader }
    }

    /// Time of the start.
    #[allow(dead_code)] // not every test uses it
    pub(crate) fn started(&self) -> Instant {
        self.started
    }

    /// Lines of standard error so far.
    pub(crate) fn log(&self) -> Vec<String> {
        self.log.0.lock().unwrap().lines.clone()
    }

    /// Waits until a line of the log contains `part`.
    pub(crate) fn wait_for_log(&mut self, part: &str) {
        self.wait_for_logs(part, 1);
    }

    /// Waits until so many lines of the log contain `part`.
    pub(crate) fn wait_for_logs(&mut self, part: &str, count: usize) {
        let lacks = |log: &Log| log.lines.iter().filter(|line| line.contains(part)).count() < count;
        let is_waiting = |log: &mut Log| lacks(log) && !log.has_ended;
        let log = self.log.0.lock().unwrap();
        let (log, _) = self.log.1.wait_timeout_while(log, waiting::DEADLINE, is_waiting).unwrap();
        let (is_lacking, has_ended) = (lacks(&log), log.has_ended);
        drop(log);
        assert!(!is_lacking, "the log did not contain {part:?} {count} times; it has ended: {has_ended}");
    }

    /// The id of the process.
    #[allow(dead_code)] // not every test looks at it
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    pub(crate) fn is_running(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }

    /// Sends a signal.
    pub(crate) fn signal(&self, signal: &str) {
        let kill = format!("kill -{signal} {}", self.child.id());
        assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
    }

    /// Sends a signal, and expects an orderly end within [`STOP_LIMIT`]; returns how long it took.
    pub(crate) fn stop(&mut self, signal: &str) -> Duration {
        let bystander = Bystander::start();
        self.signal(signal);
        let status = self.ended();
        assert_eq!(status.code(), Some(0), "after SIG{signal}: {status}");
        bystander.assert_in_time(format_args!("the end after SIG{signal}"), STOP_LIMIT)
    }

    /// Waits for its end, when the log is complete.
    pub(crate) fn ended(&mut self) -> ExitStatus {
        let status = wait_for("the end of the process", || self.child.try_wait().unwrap());
        self.reader.take().into_iter().for_each(|reader| reader.join().unwrap());
        status
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ended = (self.child.kill(), self.child.wait());
        if std::thread::panicking() {
            let _unseen = writeln!(std::io::stderr(), "the gateway's log:\n{}", self.log().join("\n"));
        }
    }
}
