//! The way to ROS 2, if there is one: built in, and wanted.

use std::sync::Arc;

use crate::config::Settings;
use crate::config::file::Durability as ConfiguredDurability;
use crate::config::traffic_lights::Outlet;
use crate::core::event::Output;
use crate::core::vehicle_lights::binding::{HazardBinding, TurnBinding};
use crate::io::ros::incoming::Inbox;
#[cfg(feature = "ros")]
use crate::io::ros::session::{DISTRO, RosError, RosSession};
use crate::io::ros::settings::RosSettings;
use crate::io::ros::topics::{Durability, LightsOutlet, Subscription, SubscriptionKind, Topics};

/// Publishes outputs, or nothing.
#[derive(Debug)]
pub struct Publisher {
    #[cfg(feature = "ros")]
    session: Option<RosSession>,
    domain_id: u16,
}

/// Why nothing can be published.
#[derive(Debug, thiserror::Error)]
pub enum PublisherError {
    /// `ROS_DOMAIN_ID` is set to something else than a number from 0 to 232.
    #[error("ROS_DOMAIN_ID is {0:?}; set it to 0 to 232, or set [ros] domain_id")]
    DomainId(String),
    /// This build has no DDS.
    #[error(
        "this build has no ROS 2; build it with the feature `jazzy` or `humble`, or set [ros] enabled = false"
    )]
    NotBuilt,
    /// The session cannot start.
    #[cfg(feature = "ros")]
    #[error(transparent)]
    Ros(#[from] RosError),
}

impl Publisher {
    /// A publisher into nothing.
    pub fn off() -> Self {
        Self {
            #[cfg(feature = "ros")]
            session: None,
            domain_id: 0,
        }
    }

    /// Joins the ROS graph, unless the configuration says not to.
    ///
    /// # Errors
    /// See [`PublisherError`].
    pub fn start(settings: &Settings) -> Result<Self, PublisherError> {
        if !settings.ros.enabled {
            return Ok(Self::off());
        }
        let ros = ros_settings(settings)?;
        Self::join(ros)
    }

    #[cfg(feature = "ros")]
    fn join(ros: RosSettings) -> Result<Self, PublisherError> {
        let domain_id = ros.domain_id;
        Ok(Self { session: Some(RosSession::start(ros)?), domain_id })
    }

    #[cfg(not(feature = "ros"))]
    fn join(_ros: RosSettings) -> Result<Self, PublisherError> {
        Err(PublisherError::NotBuilt)
    }

    /// Hands an output to the session; never blocks.
    pub fn send(&self, output: &Output) {
        #[cfg(feature = "ros")]
        self.session.iter().for_each(|session| session.send(output));
        #[cfg(not(feature = "ros"))]
        let _ = output;
    }

    /// Whether publishing works, or was not asked for.
    pub fn is_well(&self) -> bool {
        #[cfg(feature = "ros")]
        let well = self.session.as_ref().is_none_or(|session| session.status().running);
        #[cfg(not(feature = "ros"))]
        let well = true;
        well
    }

    /// Distribution and domain, for people.
    pub fn graph(&self) -> String {
        #[cfg(feature = "ros")]
        if self.session.is_some() {
            return format!("ROS 2 {DISTRO}, domain {}", self.domain_id);
        }
        let _ = self.domain_id;
        "ROS 2 off".to_owned()
    }

    /// Likewise, with the readers of each topic we write and the writers of each we read.
    pub fn describe(&self) -> String {
        #[cfg(feature = "ros")]
        if let Some(session) = &self.session {
            let status = session.status();
            let readers = status.outgoing.iter().map(|topic| format!("{} {}", topic.label, topic.readers));
            let readers = readers.collect::<Vec<_>>().join(", ");
            let writers: Vec<_> =
                status.incoming.iter().map(|topic| format!("{} {}", topic.name, topic.writers)).collect();
            let writers = match writers.as_slice() {
                [] => String::new(),
                writers => format!(", writers: {}", writers.join(", ")),
            };
            let missing = match status.missing_peers {
                0 => String::new(),
                count => format!(", {count} lost"),
            };
            let graph = self.graph();
            return format!("{graph}, readers: {readers}{writers}{missing}");
        }
        self.graph()
    }

    /// Where what is received waits, if there is a session.
    pub fn inbox(&self) -> Option<Arc<Inbox>> {
        #[cfg(feature = "ros")]
        let inbox = self.session.as_ref().map(RosSession::inbox);
        #[cfg(not(feature = "ros"))]
        let inbox = None;
        inbox
    }

    /// Leaves the graph, within half a second.
    pub fn stop(self) {
        #[cfg(feature = "ros")]
        if let Some(session) = self.session {
            session.stop();
        }
    }
}

/// Topic names as configured; what the profile leaves out has none, as it is never published.
pub fn topics(settings: &Settings) -> Topics {
    let lights = &settings.gateway.lights;
    let unless = |left_out, name: &String| if left_out { String::new() } else { name.clone() };
    let turn_left_out = matches!(lights.turn, TurnBinding::LeftOut);
    let hazard_left_out = matches!(lights.hazard, HazardBinding::LeftOut);
    Topics {
        turn_indicators: unless(turn_left_out, &settings.ros.turn_indicators_status),
        hazard_lights: unless(hazard_left_out, &settings.ros.hazard_lights_status),
        diagnostics: settings.ros.diagnostics.clone(),
        lights: settings.light_topics.outlets.iter().map(|outlet| light_outlet(outlet, settings)).collect(),
        turn_command: None,
        hazard_command: None,
    }
}

fn light_outlet(outlet: &Outlet, settings: &Settings) -> LightsOutlet {
    LightsOutlet {
        topic: outlet.topic,
        name: outlet.name.clone(),
        lights: outlet.message,
        compat: settings.light_topics.compat,
    }
}

/// What is read.
fn subscriptions(settings: &Settings) -> Vec<Subscription> {
    let topics = &settings.light_topics;
    let states =
        topics.inputs.iter().map(|(store, name)| Subscription::new(name, SubscriptionKind::Groups(*store)));
    let commands = topics.command.iter().map(|name| Subscription::new(name, SubscriptionKind::Command));
    states.chain(commands).collect()
}

fn ros_settings(settings: &Settings) -> Result<RosSettings, PublisherError> {
    let from_environment = || match std::env::var("ROS_DOMAIN_ID") {
        Ok(text) if !text.is_empty() => {
            text.parse().ok().filter(|id| *id <= 232).ok_or(PublisherError::DomainId(text))
        }
        Ok(_) | Err(_) => Ok(0),
    };
    Ok(RosSettings {
        node: settings.gateway.node.clone(),
        namespace: settings.ros.namespace.clone(),
        domain_id: settings.ros.domain_id.map_or_else(from_environment, Ok)?,
        only_networks: settings.ros.only_networks.clone(),
        durability: match settings.ros.durability {
            ConfiguredDurability::TransientLocal => Durability::TransientLocal,
            ConfiguredDurability::Volatile => Durability::Volatile,
        },
        topics: topics(settings),
        subscriptions: subscriptions(settings),
        hardware_id: settings.hardware_id.clone(),
    })
}
