//! Every shipped drive over ROS, in real time.

use crate::dds::daemon_on_ros::drive::{drive_through, shipped};
use crate::support::peer::Cyclone;
use crate::support::prerequisite::require;

#[test]
fn shipped_scenarios_drive_through_as_they_expect() {
    require!(Cyclone::on_loopback());
    drive_through(shipped(), 4);
}
