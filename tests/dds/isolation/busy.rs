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
    use std::thread;
    use std::time::{Duration, Instant};

    use super::super::{is_up, network_process, next_network_process, restarts, signal};
    use super::{Busy, pin};
    use crate::dds::session::Role;
    use crate::support::peer::domain;

    /// Processes beside the gateway's two.
    const OTHERS: usize = 8;
    const SECONDS: u32 = 60;

    #[test]
    fn on_a_busy_processor_a_healthy_network_process_lives_and_a_stopped_one_is_replaced() {
        let gateway = Role::new(domain()).only_on("127.0.0.1").isolated().start();
        gateway.send("turn left 1");
        gateway.wait_until("a network side", is_up);
        let process = next_network_process(gateway.id(), None);
        [gateway.id(), process].into_iter().for_each(pin);
        let others: Vec<Busy> = (0..OTHERS).map(|_| Busy::start()).collect();
        let mut slowest = Duration::ZERO;
        for second in 1..=SECONDS {
            thread::sleep(Duration::from_secs(1));
            let asked = Instant::now();
            let status = gateway.status();
            slowest = slowest.max(asked.elapsed());
            assert_eq!(status["restarts"], 0, "after {second} s: {status}");
        }
        println!(
            "{SECONDS} s beside {OTHERS} busy loops: none lost, the gateway answered within {slowest:?}"
        );
        assert_eq!(network_process(gateway.id()), Some(process));
        let stopped = Instant::now();
        signal("-STOP", process);
        next_network_process(gateway.id(), Some(process));
        println!("SIGSTOP: replaced after {:?}", stopped.elapsed());
        let status =
            gateway.wait_until("another network side", |status| status["restarts"] == 1 && is_up(status));
        println!("joined after {:?}: {status}", stopped.elapsed());
        assert_eq!(status["failure"], "no answer");
        assert_eq!(restarts(&gateway), 1);
        drop(others);
    }
}
