//! Warnings and errors of this process as messages for `/rosout`.

use std::collections::VecDeque;

use tracing::Level;

use crate::io::process_log::{TakenWarnings, Warning};
use ros_messages::rcl_interfaces::Log;

/// Creates the messages of one logger.
#[derive(Debug)]
pub(super) struct Rosout {
    logger: String,
}

impl Rosout {
    /// Creates the logger of a node, named as `rcl` names it: `vehicle.signal_gateway` in the namespace
    /// `/vehicle`.
    pub(super) fn new(namespace: &str, node: &str) -> Self {
        let full = format!("{namespace}/{node}");
        let levels: Vec<_> = full.split('/').filter(|level| !level.is_empty()).collect();
        Self { logger: levels.join(".") }
    }

    /// Returns the messages of warnings, followed by one with the number of dropped warnings, if any.
    pub(super) fn messages(&self, TakenWarnings { warnings, dropped }: TakenWarnings) -> VecDeque<Log> {
        let last = warnings.back().map(|warning| warning.at);
        let mut messages: VecDeque<_> = warnings.into_iter().map(|warning| self.message(warning)).collect();
        if let Some(at) = last.filter(|_| dropped > 0) {
            let text = format!("log: {dropped} older warnings and errors did not reach /rosout");
            let (file, module) = (String::new(), String::new());
            messages.push_back(self.message(Warning { at, level: Level::WARN, text, file, module, line: 0 }));
        }
        messages
    }

    fn message(&self, warning: Warning) -> Log {
        Log {
            stamp: warning.at.into(),
            level: if warning.level == Level::ERROR { Log::ERROR } else { Log::WARN },
            name: self.logger.clone(),
            msg: warning.text,
            file: warning.file,
            function: warning.module,
            line: warning.line,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gateway_base::time::WallStamp;

    #[test]
    fn a_logger_is_named_after_its_node_and_namespace() {
        for (namespace, node, logger) in [("/", "gw", "gw"), ("/a", "gw", "a.gw"), ("/a/b", "gw", "a.b.gw")] {
            assert_eq!(Rosout::new(namespace, node).logger, logger);
        }
    }

    #[test]
    fn warnings_keep_their_order_and_place_and_what_was_dropped_is_said() {
        let warning = |level, nanos, text: &str| Warning {
            at: WallStamp::from_nanos(nanos),
            level,
            text: text.to_owned(),
            file: "src/a.rs".to_owned(),
            module: "m".to_owned(),
            line: 7,
        };
        let warnings = VecDeque::from([warning(Level::WARN, 1, "a"), warning(Level::ERROR, 2, "b")]);
        let rosout = Rosout::new("/", "gw");
        let messages = rosout.messages(TakenWarnings { warnings: warnings.clone(), dropped: 0 });
        let shown = |log: &Log| (log.stamp.nanosec, log.level, log.msg.clone(), log.file.clone(), log.line);
        let expected = [
            (1, 30, "a".to_owned(), "src/a.rs".to_owned(), 7),
            (2, 40, "b".to_owned(), "src/a.rs".to_owned(), 7),
        ];
        assert_eq!(messages.iter().map(shown).collect::<Vec<_>>(), expected);
        let messages = rosout.messages(TakenWarnings { warnings, dropped: 3 });
        assert_eq!(messages.len(), 3);
        assert_eq!((messages[2].level, messages[2].msg.contains("3 older")), (30, true));
        assert!(rosout.messages(TakenWarnings::default()).is_empty());
    }
}
