//! MCAP recordings: what the gateway received and published, in the files of `rosbag2`.
//!
//! | file | what it does |
//! |---|---|
//! | [`encoder`] | inputs and outputs of the gateway ─► messages of channels |
//! | [`mod@file`] | messages ─► chunks of a file, which ends between two chunks whatever happens |
//! | [`bag`] | a folder of such files with its `metadata.yaml`: a bag |
//! | [`recorder`] | the bags of a folder, and the thread that writes them |
//!
//! Messages have the bytes that DDS carries. Frames are `can_msgs/msg/Frame`, and CAN FD frames
//! `ros2_socketcan_msgs/msg/FdFrame`: `/<bus>/from_can_bus` as received, `/<bus>/to_can_bus` as sent, and
//! `/<bus>/to_can_bus_dry_run` as they would have been sent.

pub mod bag;
pub mod encoder;
pub mod file;
pub mod recorder;

#[cfg(test)]
mod tests;
