//! The ROS 2 messages that the gateway sends and receives, without a dependency on ROS.
//!
//! The build generates the types from the definitions in `ros/msg`, in a module for each package, with their
//! type hashes and the texts for recordings (`build.rs`). One `Serialize` implementation serves two
//! encodings: CDR on the wire uses the order of the fields, JSON their names.
//!
//! ```
//! use gateway_base::time::WallStamp;
//! use ros_messages::autoware_vehicle_msgs::GearReport;
//! use ros_messages::cdr::{CdrBytes, Endian, read_message};
//! use ros_messages::type_hash;
//!
//! let stamp = WallStamp::from_nanos(1_500_000_000);
//! let report = GearReport { stamp: stamp.into(), report: GearReport::DRIVE };
//! let bytes = CdrBytes::encode(&report).unwrap();
//! assert_eq!(bytes.as_ref(), [1, 0, 0, 0, 0, 0x65, 0xCD, 0x1D, 2]);
//! assert_eq!(read_message::<GearReport>(bytes.as_ref(), Endian::Little), Ok(report));
//! assert!(type_hash("autoware_vehicle_msgs/msg/GearReport").unwrap().starts_with("RIHS01_"));
//! ```
//!
//! It uses `gateway_base`. The program converts the messages to the gateway's types (`io::ros::messages`).

mod bounded;
pub mod cdr;
mod elements;
mod generated;
mod geometry;
mod stamp;

pub use generated::*;
