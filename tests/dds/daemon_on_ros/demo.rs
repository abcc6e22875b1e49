//! The demo publishes what it invents on this computer alone, in a domain of its own.

use crate::dds::daemon_on_ros::peer::Reader;
