//! A terminal that tmux plays.

use std::process::Command;

use super::prerequisite::{Missing, Prerequisite};
use super::waiting::{described, wait_for};

/// A terminal with a command in it, and the shell that started it.
pub(crate) struct Tmux(tempfile::TempDir);

impl Tmux {
    /// Runs a command in a terminal of 100 × 30, and shows its exit code and the settings of the terminal
    /// behind it.
    pub(crate) fn run(command: &str) -> Result<Self, Missing> {
        let tmux = Self(tempfile::tempdir().unwrap());
        let script = format!("{command}; echo code $?; stty -a; echo end of settings; sleep 1000");
        let arguments = ["-f", "/dev/null", "new-session", "-d", "-x", "100", "-y", "30", &script];
        let started =
            tmux.command().args(arguments).env("TERM", "xterm-256color").env("LC_ALL", "C.UTF-8").output();
        let started = started.map_err(|_| Prerequisite::Tmux.missing("not installed"))?;
        assert!(started.status.success(), "{started:?}");
        Ok(tmux)
    }

    fn command(&self) -> Command {
        let mut command = Command::new("tmux");
        command.arg("-S").arg(self.0.path().join("socket")).env_remove("NO_COLOR").env_remove("TMUX");
        command
    }

    pub(crate) fn tell(&self, arguments: &[&str]) -> String {
        let output = self.command().args(arguments).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    }

    pub(crate) fn screen(&self) -> String {
        self.tell(&["capture-pane", "-p"])
    }

    /// Waits for a screen for which `is_it` holds.
    pub(crate) fn wait_for(&self, is_it: impl Fn(&str) -> bool) -> String {
        let what = described(|| format!("a screen; there is:\n{}", self.screen()));
        wait_for(what, || Some(self.screen()).filter(|screen| is_it(screen)))
    }

    pub(crate) fn press(&self, key: &str) {
        self.tell(&["send-keys", key]);
    }

    /// The process that the shell has started.
    pub(crate) fn child(&self) -> String {
        let shell = self.tell(&["display-message", "-p", "#{pane_pid}"]).trim().to_owned();
        let children = std::fs::read_to_string(format!("/proc/{shell}/task/{shell}/children")).unwrap();
        children.split_whitespace().next().unwrap().to_owned()
    }

    /// Waits for the end of the command, on a terminal that is as it was.
    pub(crate) fn wait_for_end(&self) -> String {
        let screen = self.wait_for(|screen| screen.contains("code ") && screen.contains("end of settings"));
        let settings: Vec<_> = screen.split_whitespace().collect();
        assert!(settings.contains(&"icanon") && settings.contains(&"echo"), "{screen}");
        assert_eq!(self.tell(&["display-message", "-p", "#{alternate_on} #{cursor_flag}"]).trim(), "0 1");
        screen
    }
}

impl Drop for Tmux {
    fn drop(&mut self) {
        self.tell(&["kill-server"]);
    }
}
