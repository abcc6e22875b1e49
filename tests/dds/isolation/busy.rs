//! A network process beside others that want its processor.

use std::process::{Child, Command};

/// The processor that all share.
const PROCESSOR: &str = "0";

/// A process that always wants the processor.
struct Busy(Child);

impl Busy {
    fn start() -> Self {
        let mut command = Command::new("taskset");
        Self(command.args(["-c", PROCESSOR, "sh", "-c", "while :; do :; done"]).spawn().unwrap())
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        let _ended = (self.0.kill(), self.0.wait());
    }
}

fn pin(process: u32) {
    let process = process.to_string();
    assert!(
        Command::new("taskset")
            .args(["-a", "-c", "-p", PROCESSOR, &process])
            .output()
            .unwrap()
            .status
            .success()
    );
}

mod slow {
    use std::time::{Duration, Instant};

    use super::super::{is_up, next_network_process, restarts, signal};
    use super::{Busy, pin};
    use crate::dds::session::{Role, assert_no_restart};
    use crate::support::peer::domain;
    use crate::support::waiting::let_pass;

    /// Processes beside the gateway's two.
    const OTHERS: usize = 8;
    const SECONDS: u32 = 60;

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn on_a_busy_processor_a_healthy_network_process_lives_and_a_stopped_one_is_replaced() {
        let gateway = Role::new(domain()).only_on("127.0.0.1").isolated().start();
        gateway.send("turn left 1");
        gateway.wait_until("a network side", is_up);
        let process = next_network_process(gateway.id(), None);
        [gateway.id(), process].into_iter().for_each(pin);
        let others: Vec<Busy> = (0..OTHERS).map(|_| Busy::start()).collect();
        let mut slowest = Duration::ZERO;
        for _ in 0..SECONDS {
            let_pass(Duration::from_secs(1), "in which the network process must not be replaced");
            let asked = Instant::now();
            let status = gateway.status();
            slowest = slowest.max(asked.elapsed());
            // The thread that it is compared with has the same processor.
            assert_no_restart(&status);
        }
        let before = restarts(&gateway);
        println!(
            "{SECONDS} s beside {OTHERS} busy loops: {before} lost, the gateway answered within {slowest:?}"
        );
        let process = next_network_process(gateway.id(), None);
        let stopped = Instant::now();
        signal("-STOP", process);
        next_network_process(gateway.id(), Some(process));
        println!("SIGSTOP: replaced after {:?}", stopped.elapsed());
        let status = gateway.wait_until("another network side", |status| {
            status["restarts"].as_u64().unwrap() > before && is_up(status)
        });
        println!("joined after {:?}: {status}", stopped.elapsed());
        assert_eq!(status["failure"], "no answer");
        drop(others);
    }
}
