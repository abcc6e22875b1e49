//! Memory of the network process while it sends large messages.

mod slow {
    use std::time::Duration;

    use super::super::{is_up, next_network_process, status_if_there};
    use crate::dds::session::{Role, assert_no_restart};
    use crate::support::peer::{Cyclone, domain};
    use crate::support::prerequisite::require;
    use crate::support::waiting::{let_pass, wait_until};

    /// Lights and messages: 30 a second, which is as much as ten a second of 10,000 lights.
    const STREAM: &str = "lights v2i 1 3334 600";

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn ten_thousand_lights_over_v2i_fit_the_limit() {
        let cyclone = require!(Cyclone::on_loopback()).keeping(1);
        let domain = domain();
        let gateway = Role::new(domain).with_lights().only_on("127.0.0.1").isolated().start();
        let topic = "rt/external/traffic_signals";
        let _reader = cyclone.topic_reader(domain, "groups", topic, "transient_local");
        gateway.wait_until("a reader", |status| is_up(status) && status["lights"][2] == 1);
        let process = next_network_process(gateway.id(), None);
        gateway.send(STREAM);
        let (mut most_kb, mut data_kb) = (0, 0);
        wait_until("the end of the stream", || {
            let_pass(Duration::from_millis(200), "between two looks at the memory");
            most_kb = most_kb.max(status_if_there(process, "VmRSS").unwrap_or_default());
            data_kb = data_kb.max(status_if_there(process, "VmData").unwrap_or_default());
            gateway.has_sent()
        });
        let status = gateway.status();
        println!("{STREAM}: {most_kb} kB in memory, {data_kb} kB private and writable: {status}");
        assert_no_restart(&status);
        assert_eq!(status["write_errors"], 0, "{status}");
    }
}
