//! Shipped drives over ROS, in real time.

use crate::dds::daemon_on_ros::drive::{drive_through, is_disturbed, shipped};
use crate::support::peer::Cyclone;
use crate::support::prerequisite::require;

/// Those whose inputs fail, in which times matter most, and some of the others, short and long.
#[test]
#[ignore = "slow: tests/run --full"]
fn some_shipped_scenarios_drive_through_as_they_expect() {
    require!(Cyclone::on_loopback());
    let names = shipped().into_iter().enumerate();
    let some = names.filter(|(number, name)| number % 8 == 0 || is_disturbed(name));
    drive_through(some.map(|(_, name)| name).collect(), 4);
}

mod exhaustive {
    use super::{Cyclone, drive_through, require, shipped};

    #[test]
    #[ignore = "exhaustive: tests/run --release"]
    fn all_shipped_scenarios_drive_through_as_they_expect() {
        require!(Cyclone::on_loopback());
        drive_through(shipped(), 4);
    }
}
