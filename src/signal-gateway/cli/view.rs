//! Opens the live view for the commands that have one.

use std::io;

use clap::Args;

use super::messages;
use crate::io::process_log::LogForm;
use crate::io::terminal::is_usable;
use crate::report::terminal::message_table::MessageTable;
use crate::report::terminal::view_model::Model;
use crate::report::terminal::{DriverLine, TerminalView};
use crate::report::view::{Destination, View};

#[derive(Debug, Args)]
pub(super) struct ViewArgs {
    /// Print lines on a terminal too, instead of the live view
    #[arg(long)]
    plain: bool,
}

impl ViewArgs {
    /// Opens the live view if there is a terminal for it, else `otherwise`; `url` is that of the live page.
    pub(super) fn open(
        &self,
        title: String,
        url: Option<String>,
        otherwise: impl FnOnce() -> io::Result<View>,
    ) -> io::Result<View> {
        if !self.is_live() {
            return otherwise();
        }
        Ok(View::new(Destination::Terminal(start(Model { title, url, ..Model::default() }, None)?)))
    }

    /// Returns the form of the log. The live view adds its own time to the lines.
    pub(super) fn log_form(&self) -> LogForm {
        if self.is_live() { LogForm::Messages } else { LogForm::Timed }
    }

    pub(super) fn is_live(&self) -> bool {
        !self.plain && is_usable()
    }
}

pub(super) fn start_messages(title: String) -> io::Result<TerminalView> {
    start(Model { title, messages: Some(MessageTable::default()), ..Model::default() }, None)
}

/// Takes the terminal for the live view; `driver` receives the requests of the driver's keys.
pub(super) fn start(model: Model, driver: Option<DriverLine>) -> io::Result<TerminalView> {
    let has_color = messages::layout(&io::stdout()).has_color;
    TerminalView::start(Model { has_color, ..model }, driver)
}
