//! Memory of the network process while it sends large messages.

mod slow {
    use std::thread;
    use std::time::{Duration, Instant};

    use super::super::{is_up, next_network_process, restarts, status_of};
    use crate::dds::session::Role;
    use crate::support::peer::{Cyclone, Reading, domain};
    use crate::support::prerequisite::require;

    /// Lights and messages: 30 a second, which is as much as ten a second of 10,000 lights.
    const STREAM: &str = "lights v2i 1 3334 600";

    #[test]
    fn ten_thousand_lights_over_v2i_fit_the_limit() {
        let cyclone = require!(Cyclone::on_loopback()).keeping(1);
        let domain = domain();
        let gateway = Role::new(domain).with_lights().only_on("127.0.0.1").isolated().start();
        let groups =
            Reading { kind: "groups", topic: "rt/external/traffic_signals", durability: "transient_local" };
        let _reader = cyclone.reader(domain, &[groups]);
        gateway.wait_until("a reader", |status| is_up(status) && status["lights"][2] == 1);
        let process = next_network_process(gateway.id(), None);
        gateway.send(STREAM);
        let begun = Instant::now();
        let (mut most_kb, mut data_kb) = (0, 0);
        while begun.elapsed() < Duration::from_secs(20) {
            thread::sleep(Duration::from_millis(200));
            most_kb = most_kb.max(status_of(process, "VmRSS"));
            data_kb = data_kb.max(status_of(process, "VmData"));
        }
        let status = gateway.status();
        println!("{STREAM}: {most_kb} kB in memory, {data_kb} kB private and writable: {status}");
        assert_eq!(restarts(&gateway), 0, "{status}");
        assert_eq!(status["write_errors"], 0, "{status}");
    }
}
