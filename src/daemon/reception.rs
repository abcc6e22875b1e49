//! What others tell over ROS 2, as inputs of the gateway.

use std::future::pending;
use std::sync::Arc;

use crate::config::Settings;
use crate::core::event::Input;
use crate::core::traffic_light::command::parse_command;
use crate::core::traffic_light::compat::Compat;
use crate::core::traffic_light::engine::Sight;
use crate::core::traffic_light::scenario::Controller;
use crate::io::ros::incoming::{Inbox, Incoming};
use crate::io::ros::messages::ReceivedGroups;

/// The way from the ROS session to the gateway.
pub(super) struct Reception {
    inbox: Option<Arc<Inbox>>,
    controllers: Vec<Controller>,
    compat: Compat,
}

impl Reception {
    pub(super) fn new(inbox: Option<Arc<Inbox>>, settings: &Settings) -> Self {
        let topics = &settings.light_topics;
        Self { inbox, controllers: topics.controllers.clone(), compat: topics.compat }
    }

    /// The next input. Waits for ever when nothing can come; loses nothing when it is given up.
    pub(super) async fn next(&self) -> Input {
        let Some(inbox) = &self.inbox else { return pending().await };
        while let Some(arrival) = inbox.take().await {
            if let Some(input) = self.input(arrival.incoming) {
                return input;
            }
        }
        // A session that ended is noticed where it is written to.
        pending().await
    }

    fn input(&self, incoming: Incoming) -> Option<Input> {
        Some(match incoming {
            Incoming::Groups { store, groups } => {
                let ReceivedGroups { groups, rejected, .. } = groups;
                let sight = |bulbs, confidence| Sight { bulbs, confidence };
                let states = groups.iter().map(|group| {
                    let lit = (!group.bulbs.is_empty()).then(|| sight(group.bulbs, group.confidence));
                    (group.relation_id, lit)
                });
                let rejected = u32::try_from(rejected.len()).unwrap_or(u32::MAX);
                Input::LightStates { store, states: states.collect(), rejected }
            }
            Incoming::Command(text) => {
                let action = parse_command(&text, &self.controllers, self.compat);
                let action =
                    action.map_err(|error| tracing::warn!("a command was not understood: {error}")).ok();
                Input::LightsAction(action.map(Arc::new))
            }
            // Nothing subscribes to these.
            Incoming::Told(_)
            | Incoming::TurnCommand { .. }
            | Incoming::HazardCommand { .. }
            | Incoming::ControlMode { .. } => return None,
        })
    }
}
