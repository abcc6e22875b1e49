//! Any bytes as a request to a service of the node, as clients of each middleware send them: no panic, and
//! what is answered is bounded.
//!
//! The first byte picks the service, the second the middleware and the byte order.

#![no_main]

use libfuzzer_sys::fuzz_target;
use ros_messages::autoware_adapi_v1_msgs::DoorLayout;
use ros_transport::parameters::{
    DoorLayouts, MAX_RESPONSE, Middleware, ParameterValue, Parameters, ServiceContents,
};
use ros_messages::cdr::Endian;

fuzz_target!(|bytes: &[u8]| {
    let [service, form, bytes @ ..] = bytes else { return };
    let endian = if form & 1 == 0 { Endian::Little } else { Endian::Big };
    let middleware = if form & 2 == 0 { Middleware::Cyclone } else { Middleware::Enhanced };
    let mut parameters = Parameters::default();
    parameters.set("a", true);
    parameters.set("a.b", ParameterValue::Doubles(vec![0.5, f64::NAN]));
    parameters.set("b", "text");
    let doors = DoorLayouts { service: "/doors/layout".to_owned(), doors: vec![DoorLayout::default(); 2] };
    let contents = ServiceContents { parameters, doors: Some(doors) };
    let services = contents.services("/node");
    let (service, _) = services[usize::from(*service) % services.len()];
    let Some(call) = middleware.call(bytes, endian) else { return };
    let Ok(response) = service.answer(&contents, call.request, endian) else { return };
    // The count of a list is not of its elements, nor are the numbers before the response.
    assert!(call.reply(response).as_ref().len() <= MAX_RESPONSE + 24);
});
