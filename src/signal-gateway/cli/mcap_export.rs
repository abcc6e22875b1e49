//! `replay --mcap`: writes the recording and its outputs to an MCAP file or a bag.

use std::path::{Path, PathBuf};

use super::failure::Failure;
use crate::io::mcap::bag::{Bag, FileLimits};
use crate::io::mcap::encoder::{Encoder, RecordedMessage};
use crate::io::mcap::file::McapFile;
use crate::io::sample_log::LoggedSample;
use crate::report::output_budget::OutputBudget;
use can_signal::can::CanInput;
use gateway_base::time::{MonoTime, WallStamp};
use gateway_core::gateway::call::TimedCall;
use gateway_core::gateway::event::Output;

/// Number of bytes collected before a write.
const WRITE_BYTES: usize = 1 << 20;
/// Number of bytes of a message in a file in addition to its payload: its record and its index entry.
const MESSAGE_BYTES: usize = 51;

pub(super) struct McapExport {
    path: PathBuf,
    encoder: Encoder,
    target: ExportTarget,
    budget: OutputBudget,
    /// Virtual time of the outputs.
    at: MonoTime,
}

enum ExportTarget {
    File(McapFile),
    Bag(Bag),
}

impl McapExport {
    /// Creates the file, or for a path without `.mcap` at its end the folder of a bag, which must not exist.
    pub(super) fn create(path: &Path, encoder: Encoder) -> Result<Self, Failure> {
        let target = if path.extension().is_some_and(|extension| extension == "mcap") {
            McapFile::create(path, true).map(ExportTarget::File)
        } else {
            Bag::create(path, FileLimits::NONE, encoder.channels()).map(ExportTarget::Bag)
        };
        let target = target.map_err(Failure::written(path))?;
        let (path, budget, at) = (path.to_owned(), OutputBudget::default(), MonoTime::ZERO);
        Ok(Self { path, encoder, target, budget, at })
    }

    /// Sets the virtual time of the following outputs.
    pub(super) fn advance(&mut self, at: MonoTime) {
        self.at = at;
    }

    pub(super) fn received(&mut self, input: &CanInput, at: WallStamp) -> Result<(), Failure> {
        self.add_entry(self.encoder.received(input, at))
    }

    /// Adds a ROS 2 sample, whose topic is the position of its subscription.
    pub(super) fn sample(&mut self, sample: &LoggedSample) -> Result<(), Failure> {
        let LoggedSample { topic, bytes, endian, logged, .. } = sample;
        self.add_entry(self.encoder.sample(*topic, bytes.clone(), *endian, *logged))
    }

    pub(super) fn call(&mut self, call: &TimedCall) -> Result<(), Failure> {
        self.add_entry(self.encoder.call(call))
    }

    fn add_entry(&mut self, message: Option<RecordedMessage>) -> Result<(), Failure> {
        self.budget.entry();
        message.map_or(Ok(()), |message| self.add(&message))
    }

    pub(super) fn given_out(&mut self, output: &Output, at: WallStamp) -> Result<(), Failure> {
        let messages = self.encoder.given_out(output, at);
        messages.iter().try_for_each(|message| self.add(message))
    }

    /// Closes the file or bag, whose index makes it readable. Fails if the export is incomplete.
    pub(super) fn finish(mut self) -> Result<(), Failure> {
        let finished = match &mut self.target {
            ExportTarget::File(file) => file.finish(),
            ExportTarget::Bag(bag) => bag.finish(),
        };
        finished.and_then(|()| self.budget.outcome()).map_err(Failure::written(&self.path))
    }

    fn add(&mut self, message: &RecordedMessage) -> Result<(), Failure> {
        if !self.budget.take(message.bytes.as_ref().len() + MESSAGE_BYTES, self.at) {
            return Ok(());
        }
        let added = match &mut self.target {
            ExportTarget::File(file) => file.add(message, self.encoder.channels()).and_then(|()| {
                if file.pending_bytes() > WRITE_BYTES { file.write_pending() } else { Ok(()) }
            }),
            ExportTarget::Bag(bag) => bag
                .add(message)
                .and_then(|()| if bag.pending_bytes() > WRITE_BYTES { bag.flush() } else { Ok(()) }),
        };
        added.map_err(Failure::written(&self.path))
    }
}
