//! A network process beside others that want its processor.

use std::process::{Child, Command};
use std::time::Duration;

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

/// Whether a process and its threads have to wait for all others.
fn set_idle(process: u32, is_idle: bool) {
    let policy = if is_idle { "--idle" } else { "--other" };
    let done = Command::new("chrt").args(["-a", policy, "-p", "0", &process.to_string()]).output().unwrap();
    assert!(done.status.success(), "{done:?}");
}

/// The time for which the main thread has waited for a processor.
fn waited_by_main_thread(process: u32) -> Duration {
    let text = std::fs::read_to_string(format!("/proc/{process}/task/{process}/schedstat")).unwrap();
    Duration::from_nanos(text.split_whitespace().nth(1).unwrap().parse().unwrap())
}

mod slow {
    use std::time::{Duration, Instant};

    use super::super::{is_up, next_network_process, restarts, signal};
    use super::{Busy, pin, set_idle, waited_by_main_thread};
    use crate::dds::session::{Role, assert_no_restart};
    use crate::support::peer::domain;
    use crate::support::waiting::let_pass;

    /// Processes beside the gateway's two.
    const OTHERS: usize = 8;
    const SECONDS: u32 = 20;
    /// So long the network process waits at a time: longer than a round that makes a participant suspect, and
    /// shorter than the gateway's patience in any case.
    const STARVED: Duration = Duration::from_millis(3500);
    const SUSPECT: Duration = Duration::from_secs(2);

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

    /// It gets a processor only when nobody else wants it, and others always do.
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_network_process_that_was_starved_keeps_its_participant() {
        let gateway = Role::new(domain()).only_on("127.0.0.1").isolated().start();
        gateway.send("turn left 1");
        gateway.wait_until("a network side", is_up);
        let process = next_network_process(gateway.id(), None);
        pin(process);
        let mut longest = Duration::ZERO;
        for _ in 0..10 {
            set_idle(process, true);
            let before = waited_by_main_thread(process);
            let others: Vec<Busy> = (0..OTHERS).map(|_| Busy::start()).collect();
            let_pass(STARVED, "in which the network process gets hardly any processor");
            drop(others);
            set_idle(process, false);
            gateway.wait_until("a network side", is_up);
            if restarts(&gateway) > 0 {
                println!("the gateway could not wait for it");
                return;
            }
            let waited = waited_by_main_thread(process).saturating_sub(before);
            println!("waited {waited:?}, {}", gateway.status());
            longest = longest.max(waited);
            assert_eq!((gateway.standstills(), &gateway.status()["rebuilds"]), (0, &0.into()));
            if waited > SUSPECT + Duration::from_millis(500) {
                break;
            }
        }
        assert!(longest > SUSPECT, "it was never starved: {longest:?}");
    }
}
