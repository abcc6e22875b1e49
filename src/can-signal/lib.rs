//! CAN frames and buses, DBC files, and validation of received signals.
//!
//! - [`can`]: a bus with its frames, link, controller and condition;
//! - [`dbc`]: DBC files, parsed statement by statement, and the codecs of their signals;
//! - [`validation`]: integrity, age and meaning of received signals.
//!
//! ```
//! use can_signal::can::frame::MAX_DATA;
//!
//! let text = r#"
//! BO_ 291 LIGHTS: 2 BCM
//!  SG_ Turn : 8|2@1+ (1,0) [0|3] "" DASH
//! VAL_ 291 Turn 1 "left" 2 "right" ;
//! "#;
//! let database = can_signal::dbc::parse(text.as_bytes());
//! let message = database.message("LIGHTS").ok_or("no such message")?;
//! let turn = message.signal("Turn").ok_or("no such signal")?;
//!
//! let mut data = [0; MAX_DATA];
//! data[1] = 0b10;
//! assert_eq!((turn.codec.value(&data), &*turn.values[1].1), (2, "right"));
//! # Ok::<(), &str>(())
//! ```
//!
//! Nothing here opens a socket or reads a clock: frames and times are arguments. The crate depends on
//! `gateway_base`; every flow of the vehicle depends on this crate.

pub mod can;
pub mod dbc;
pub mod validation;
