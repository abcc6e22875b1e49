//! Decides when a network side counts as dead, and when to start the next one.

use std::time::{Duration, Instant};

use super::threads::Threads;
use crate::process_status::network::NetworkFailure;
use ros_transport::link::Violation;

/// Time between two pings.
const PING_INTERVAL: Duration = Duration::from_millis(200);
/// Silence after which the network side's threads are checked.
const SUSPICIOUS: Duration = Duration::from_millis(400);
/// Maximum further silence while the threads could run. Together with [`SUSPICIOUS`] it is 1 s.
const MAX_IDLE: Duration = Duration::from_millis(600);
/// Time between two checks of the threads: the kernel updates a thread's run time every few milliseconds.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);
/// Maximum silence if the threads were held up, or if that cannot be determined.
const PATIENCE: Duration = Duration::from_secs(5);
/// Maximum time for a network side to join the network.
const START_PATIENCE: Duration = Duration::from_secs(10);
/// Maximum time that counts between two calls. If the whole computer is busy or was suspended, this side does
/// not run either, and the silence is not the network side's fault.
const MAX_STEP: Duration = Duration::from_millis(150);

/// Time without a sample at our own reader after which the network side's threads are checked. Within that
/// time a new reader can replace the last one and be discovered.
const QUIET: Duration = Duration::from_millis(600);
/// Maximum further time without a sample while the threads could run.
const MAX_QUIET: Duration = Duration::from_millis(900);
/// Maximum time without a sample if the threads were held up.
const QUIET_PATIENCE: Duration = Duration::from_secs(8);

/// Monitors the answers of one network side, and its samples at a reader of our own. A silent network side
/// hangs or was held up: on a single busy processor an echo has taken more than a second, and killing a
/// healthy network side costs more than waiting for it. A network side that answers but whose samples do not
/// arrive is useless too, since no peer discovers it.
#[derive(Debug)]
pub(super) struct Liveness {
    last_look: Instant,
    has_joined: bool,
    silence: Silence,
    /// Time since a sample arrived at our own reader.
    quiet: Silence,
    /// True if samples are known to arrive there on this computer.
    is_hearing_proven: bool,
    last_ping: Option<(u64, Instant)>,
    last_pong: u64,
}

/// Time without a sign of life, in counted steps.
#[derive(Debug, Default)]
struct Silence {
    /// Counted time.
    passed: Duration,
    suspicion: Option<Suspicion>,
}

/// Observations of a network side that has been silent for some time.
#[derive(Debug)]
struct Suspicion {
    /// Its threads at the last check; `None` if they could not be read.
    threads: Option<Threads>,
    /// Silence since that check.
    since: Duration,
    /// Silence during which nothing held the threads up.
    idle: Duration,
}

impl Liveness {
    /// Creates the monitor of a network side that was started at `now`.
    pub(super) fn new(is_hearing_proven: bool, now: Instant) -> Self {
        Self {
            last_look: now,
            has_joined: false,
            silence: Silence::default(),
            quiet: Silence::default(),
            is_hearing_proven,
            last_ping: None,
            last_pong: 0,
        }
    }

    /// Records that the network side has joined the network; from now on it must answer.
    pub(super) fn joined(&mut self) {
        (self.silence, self.quiet, self.has_joined) = (Silence::default(), Silence::default(), true);
    }

    /// Returns an error once the network side has been silent or unheard for too long. `threads` reads its
    /// threads if possible.
    pub(super) fn look(
        &mut self,
        now: Instant,
        threads: impl Fn() -> Option<Threads>,
    ) -> Result<(), NetworkFailure> {
        let step = now.saturating_duration_since(self.last_look).min(MAX_STEP);
        self.last_look = now;
        if !self.has_joined {
            self.silence.passed += step;
            let is_late = self.silence.passed > START_PATIENCE;
            return if is_late { Err(NetworkFailure::NoAnswer) } else { Ok(()) };
        }
        let idle = self.silence.look(step, SUSPICIOUS, &threads);
        if idle >= MAX_IDLE || self.silence.passed > PATIENCE {
            return Err(NetworkFailure::NoAnswer);
        }
        let idle = self.quiet.look(step, QUIET, &threads);
        let is_unheard = idle >= MAX_QUIET || self.quiet.passed > QUIET_PATIENCE;
        if is_unheard && self.is_hearing_proven { Err(NetworkFailure::Unheard) } else { Ok(()) }
    }

    /// Returns false if samples are known to arrive, but none has arrived for some time.
    pub(super) fn is_heard(&self) -> bool {
        !self.is_hearing_proven || self.quiet.passed < QUIET
    }

    /// Returns the number of the next ping, if one is due.
    pub(super) fn next_ping(&mut self, now: Instant) -> Option<u64> {
        let number = match self.last_ping {
            Some((_, at)) if now.saturating_duration_since(at) < PING_INTERVAL => return None,
            Some((number, _)) => number + 1,
            None => 1,
        };
        self.last_ping = Some((number, now));
        Some(number)
    }

    /// Records an answer, to any ping since the last answer, and whether a sample has arrived since then.
    pub(super) fn pong(&mut self, number: u64, is_heard: bool) -> Result<(), Violation> {
        let sent = self.last_ping.map_or(0, |(number, _)| number);
        if number <= self.last_pong || number > sent {
            return Err(Violation::OutOfTurn);
        }
        (self.last_pong, self.silence) = (number, Silence::default());
        if is_heard {
            (self.quiet, self.is_hearing_proven) = (Silence::default(), true);
        }
        Ok(())
    }
}

impl Silence {
    /// Adds a time step, and checks the threads if that is due. Returns the time during which nothing held
    /// them up.
    fn look(
        &mut self,
        step: Duration,
        suspicious: Duration,
        threads: impl Fn() -> Option<Threads>,
    ) -> Duration {
        self.passed += step;
        match &mut self.suspicion {
            Some(suspicion) => suspicion.look(step, threads),
            None if self.passed >= suspicious => {
                let (since, idle) = (Duration::ZERO, Duration::ZERO);
                self.suspicion = Some(Suspicion { threads: threads(), since, idle });
            }
            None => {}
        }
        self.suspicion.as_ref().map_or(Duration::ZERO, |suspicion| suspicion.idle)
    }
}

impl Suspicion {
    /// Checks the threads if that is due.
    fn look(&mut self, step: Duration, threads: impl FnOnce() -> Option<Threads>) {
        self.since += step;
        if self.since < LOOK_INTERVAL {
            return;
        }
        let threads = threads();
        if let (Some(then), Some(now)) = (&self.threads, &threads) {
            self.idle += self.since.saturating_sub(now.held_up(then, self.since));
        }
        (self.threads, self.since) = (threads, Duration::ZERO);
    }
}

/// Number of consecutive network sides without a sample on a way after which a missing sample means nothing.
const MAX_IN_VAIN: u32 = 5;

/// Whether samples are known to arrive by a certain way on this computer.
#[derive(Debug, Default)]
pub(super) struct ReturnPath {
    /// True if a missing sample indicates a fault.
    pub(super) is_proven: bool,
    in_vain: u32,
}

impl ReturnPath {
    /// Records that a sample has arrived.
    pub(super) fn note_come(&mut self) {
        (self.is_proven, self.in_vain) = (true, 0);
    }

    /// Records a network side that was ended because no sample had ever arrived.
    pub(super) fn note_in_vain(&mut self) {
        self.in_vain = self.in_vain.saturating_add(1);
        self.is_proven &= self.in_vain < MAX_IN_VAIN;
    }
}

/// Delay before the first of several consecutive restarts.
const MIN_DELAY: Duration = Duration::from_millis(100);
/// Maximum delay: reports return within a second after an attack of any length.
const MAX_DELAY: Duration = Duration::from_millis(400);
/// Age at which a network side counts as having been healthy.
const HEALTHY: Duration = Duration::from_secs(60);

/// Delay between the end of a network side and the start of the next, which doubles each time.
#[derive(Debug)]
pub(super) struct RestartDelay(Duration);

impl Default for RestartDelay {
    fn default() -> Self {
        Self(MIN_DELAY)
    }
}

impl RestartDelay {
    /// Returns the delay after the end of a network side of this age; `None` if it never joined the network.
    pub(super) fn next(&mut self, age: Option<Duration>) -> Duration {
        if age.is_some_and(|age| age >= HEALTHY) {
            self.0 = MIN_DELAY;
        }
        let delay = self.0;
        self.0 = (delay * 2).min(MAX_DELAY);
        delay
    }
}

#[cfg(test)]
mod tests {
    use super::super::threads::tests::threads;
    use super::*;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// Returns the time, ms, at which a network side that stops answering after three seconds is found deaf.
    /// Checks are `pause` ms apart; `threads` gives its threads at each.
    fn found_deaf(pause: u64, threads: impl Fn(u64) -> Option<Threads>) -> u64 {
        let start = Instant::now();
        let mut liveness = Liveness::new(false, start);
        liveness.joined();
        let mut looks = (0..60_000).step_by(usize::try_from(pause).unwrap());
        let deaf = looks.find(|at| {
            let now = start + ms(*at);
            if let Some(ping) = liveness.next_ping(now).filter(|_| *at <= 3_000) {
                liveness.pong(ping, true).unwrap();
            }
            liveness.look(now, || threads(*at)) == Err(NetworkFailure::NoAnswer)
        });
        deaf.unwrap() - 3_000
    }

    /// One thread in this state that runs and waits for these thousandths of the time.
    fn thread(state: &str, ran: u64, waited: u64) -> impl Fn(u64) -> Option<Threads> {
        move |at| Some(threads(&[(state, &format!("{} {} 1", 1 + at * ran * 1000, at * waited * 1000))]))
    }

    #[test]
    fn one_that_could_run_is_deaf_after_a_second_of_silence() {
        for pause in [1, 10, 50, 100] {
            let time = found_deaf(pause, thread("T", 0, 0));
            assert!((900..=1_000).contains(&time), "stopped, looks every {pause} ms: {time} ms");
            let time = found_deaf(pause, thread("R", 1000, 0));
            assert!((900..=1_000).contains(&time), "hangs, looks every {pause} ms: {time} ms");
        }
    }

    #[test]
    fn time_in_which_it_waited_for_a_processor_is_not_its_silence() {
        assert_eq!(found_deaf(50, thread("R", 500, 500)), 1_550, "hangs beside another that is busy");
        assert_eq!(found_deaf(50, thread("S", 100, 900)), 5_000, "nine others");
        assert_eq!(found_deaf(50, thread("R", 0, 0)), 5_000, "never has its turn");
        assert_eq!(found_deaf(50, thread("D", 0, 0)), 5_000, "waits for a disk");
    }

    #[test]
    fn threads_that_cannot_be_read_have_the_longest_patience() {
        assert_eq!(found_deaf(50, |_| None), 5_000);
        let now_and_then = |at| (at % 200 == 0).then(|| threads(&[("S", "1 0 1")]));
        assert_eq!(found_deaf(100, now_and_then), 5_000, "two readings in a row are needed");
    }

    #[test]
    fn a_way_that_no_sample_comes_any_more_is_a_sign_for_five_network_sides() {
        let mut way = ReturnPath::default();
        (0..10).for_each(|_| way.note_in_vain());
        assert!(!way.is_proven);
        for count in [4, 5] {
            way.note_come();
            (0..count).for_each(|_| way.note_in_vain());
            assert_eq!(way.is_proven, count < 5, "{count}");
        }
    }

    #[test]
    fn an_answer_ends_the_suspicion() {
        let start = Instant::now();
        let mut liveness = Liveness::new(false, start);
        liveness.joined();
        for at in (0..60_000).step_by(100) {
            let now = start + ms(at);
            let ping = liveness.next_ping(now);
            if let Some(ping) = ping.filter(|_| at % 800 == 0) {
                liveness.pong(ping, true).unwrap();
            }
            assert_eq!(liveness.look(now, || thread("S", 1, 0)(at)), Ok(()), "{at} ms");
        }
    }

    #[test]
    fn one_that_starts_has_more_time() {
        let start = Instant::now();
        let mut liveness = Liveness::new(false, start);
        let stopped = || thread("T", 0, 0)(0);
        assert!((1..=100).all(|tick| liveness.look(start + ms(tick * 100), stopped).is_ok()));
        assert_eq!(liveness.look(start + ms(10_100), stopped), Err(NetworkFailure::NoAnswer));
    }

    #[test]
    fn time_in_which_nobody_polled_is_not_its_silence() {
        let start = Instant::now();
        let mut liveness = Liveness::new(false, start);
        liveness.joined();
        for pause in 1..=6 {
            assert_eq!(
                liveness.look(start + ms(pause * 60_000), || thread("T", 0, 0)(0)),
                Ok(()),
                "look {pause}"
            );
        }
        assert_eq!(
            liveness.look(start + ms(7 * 60_000), || thread("T", 0, 0)(0)),
            Err(NetworkFailure::NoAnswer)
        );
    }

    /// Returns the time, ms after three seconds, at which a network side that answers is found unheard, if it
    /// is.
    fn found_unheard(is_proven: bool, is_heard: impl Fn(u64) -> bool, ran: u64, waited: u64) -> Option<u64> {
        let start = Instant::now();
        let mut liveness = Liveness::new(is_proven, start);
        liveness.joined();
        let mut looks = (0..60_000).step_by(50);
        looks.find(|at| {
            let now = start + ms(*at);
            if let Some(ping) = liveness.next_ping(now) {
                liveness.pong(ping, is_heard(*at)).unwrap();
            }
            liveness.look(now, || thread("R", ran, waited)(*at)) == Err(NetworkFailure::Unheard)
        })
    }

    #[test]
    fn one_that_answers_and_is_not_heard_is_of_no_use_where_one_was_heard() {
        let until_3_s = |at| at <= 3_000;
        assert_eq!(found_unheard(false, until_3_s, 1000, 0), Some(4_450));
        assert_eq!(found_unheard(false, until_3_s, 500, 500), Some(5_350), "beside another that is busy");
        assert_eq!(found_unheard(false, until_3_s, 100, 1_000), Some(11_000), "whatever held it up");
        assert_eq!(found_unheard(true, |_| false, 1000, 0), Some(1_500), "one before it was heard");
        assert_eq!(found_unheard(false, |_| false, 1000, 0), None, "where none ever was");
        assert_eq!(found_unheard(true, |at| at % 1_000 == 0, 1000, 0), None, "now and then");
    }

    #[test]
    fn answers_to_pings_that_were_not_sent_or_answered_before_are_violations() {
        let now = Instant::now();
        let mut liveness = Liveness::new(false, now);
        assert_eq!(liveness.pong(1, true), Err(Violation::OutOfTurn));
        assert_eq!(liveness.next_ping(now), Some(1));
        assert_eq!(liveness.next_ping(now), None);
        assert_eq!(liveness.next_ping(now + PING_INTERVAL), Some(2));
        assert_eq!(liveness.next_ping(now + PING_INTERVAL * 2), Some(3));
        assert_eq!(liveness.pong(2, true), Ok(()));
        for number in [0, 1, 2, 4, u64::MAX] {
            assert_eq!(liveness.pong(number, true), Err(Violation::OutOfTurn), "{number}");
        }
        assert_eq!(liveness.pong(3, true), Ok(()));
    }

    #[test]
    fn delays_grow_until_one_was_healthy() {
        let mut delay = RestartDelay::default();
        let mut after = |age: Option<u64>| delay.next(age.map(Duration::from_secs)).as_millis();
        let first: Vec<_> = (0..7).map(|_| after(Some(1))).collect();
        assert_eq!(first, [100, 200, 400, 400, 400, 400, 400]);
        assert_eq!(after(None), 400);
        assert_eq!([after(Some(60)), after(Some(59))], [100, 200]);
    }
}
