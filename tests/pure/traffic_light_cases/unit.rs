//! A run and the states of a V2X unit: they are written at each beginning
//! (docs/spec/traffic-lights.md, "Simulated clock").

use can_signal::can::frame::CanId;
use gateway_base::time::WallStamp;
use gateway_core::gateway::GatewaySettings;
use traffic_lights::input::TrafficLightInput;

use crate::support::files::MemoryFiles;
use crate::support::virtual_gateway::VirtualGateway;

/// Two heads with a signal each, in time of a simulator; with these settings of the traffic lights, and the
/// head of the second signal.
fn settings(lights: &str, second: u8) -> GatewaySettings {
    let head = |id: u8, signal: &str| {
        format!("[[v2i]]\nid = {id}\nsignal = \"{signal}\"\nstates = {{ red = [1] }}\n")
    };
    let heads = head(11, "UNIT.FIRST") + &head(second, "UNIT.SECOND");
    let profile =
        format!("name = \"unit\"\n[bus.body]\ndbc = \"car.dbc\"\n[message.UNIT]\ntimeout_ms = 9000\n{heads}");
    let dbc = "BO_ 256 UNIT: 1 X\n SG_ FIRST : 0|4@1+ (1,0) [0|15] \"\" X\n SG_ SECOND : 4|4@1+ (1,0) [0|15] \"\" X\n\
               BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";\n";
    let gateway = format!(
        "profile = \"car.toml\"\n[can.body]\ninterface = \"can0\"\n[traffic_lights]\nscenario = \"s.toml\"\n\
         use_sim_time = true\n{lights}"
    );
    let files = MemoryFiles::vehicle(&profile, dbc).with("gateway.toml", gateway);
    files.with("s.toml", "[groups]\n100 = [11]\n200 = [12]\n300 = [13]\n").settings().gateway
}

/// The ids of the lights that the v2i channel shows.
fn shown(bench: &VirtualGateway) -> Vec<i64> {
    let lights = bench.snapshot().traffic_lights.unwrap();
    lights.channels[1].states.iter().map(|light| light.id).collect()
}

#[test]
fn each_run_begins_with_the_states_that_the_unit_holds_valid() {
    let clock = |seconds: i64| TrafficLightInput::Clock(WallStamp::from_nanos(seconds * 1_000_000_000));
    let mut bench = VirtualGateway::new(settings("", 12));
    bench.receive(CanId::Standard(256), &[0x11]);
    assert_eq!(shown(&bench), [0; 0], "before the first time nothing is written");
    bench.handle(clock(100));
    assert_eq!(shown(&bench), [11, 12]);
    bench.handle(clock(50));
    assert_eq!(shown(&bench), [11, 12], "a clock that begins anew");
    for (lights, second, expected, why) in [
        ("v2i_rate_hz = 5.0\n", 12, [11, 12], "a run that goes on"),
        ("frame_rate_hz = 10.0\n", 12, [11, 12], "a run of other settings"),
        ("frame_rate_hz = 10.0\n", 13, [11, 13], "a run that goes on with another binding"),
        ("", 12, [11, 12], "a run of other settings with another binding"),
    ] {
        bench.gateway.reconfigure(settings(lights, second), bench.now);
        assert_eq!(shown(&bench), expected, "{why}");
    }
}
