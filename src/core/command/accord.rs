//! How the vehicle's report stands to what is wanted: obeyed, not yet, not, or the driver's doing.

use std::time::Duration;

use super::Turn;
use crate::core::bus::past;
use crate::core::time::MonoTime;

/// How long the vehicle may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Limits {
    /// Until a difference is worth a warning.
    pub warn: Duration,
    /// Until it is an error; not below `warn`.
    pub error: Duration,
}

/// A state of lights that may be compared.
pub trait Lights: Copy + Eq {
    /// Whether a light is on.
    fn is_lit(self) -> bool;
}

impl Lights for Turn {
    fn is_lit(self) -> bool {
        self != Self::Off
    }
}

impl Lights for bool {
    fn is_lit(self) -> bool {
        self
    }
}

/// How the report stands to what is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Accord {
    /// Nothing is wanted.
    #[default]
    Free,
    /// The report shows what is wanted.
    Obeyed,
    /// It does not, but not for long.
    Settling,
    /// It has not for longer than the first limit.
    Late,
    /// It has not for longer than the second limit.
    Disobeyed,
    /// There has been no report for longer than the first limit.
    Unproven,
    /// It shows what the driver does, or what was on before the gateway wanted anything.
    Driver,
}

/// Watches one function.
#[derive(Debug, Clone)]
pub struct Watch<T> {
    limits: Limits,
    wanted: Option<T>,
    wanted_since: MonoTime,
    /// Since when the report has not shown what is wanted.
    apart_since: Option<MonoTime>,
    /// Whether the report has shown this wish.
    obeyed_once: bool,
    /// Whether a light that is on was lit on our wish.
    ours: bool,
    /// Whether a light has been reported since that wish.
    shown_lit: bool,
    accord: Accord,
    /// Times the driver was found to do something else.
    driver_count: u64,
    /// Times the second limit was passed.
    disobeyed_count: u64,
}

impl<T: Lights> Watch<T> {
    /// Nothing wanted, nothing seen.
    pub fn new(limits: Limits) -> Self {
        Self {
            limits,
            wanted: None,
            wanted_since: MonoTime::ZERO,
            apart_since: None,
            obeyed_once: false,
            ours: false,
            shown_lit: false,
            accord: Accord::Free,
            driver_count: 0,
            disobeyed_count: 0,
        }
    }

    /// Compares: `driver` = the vehicle itself says that the driver has taken this function.
    pub fn update(&mut self, wanted: Option<T>, reported: Option<T>, driver: bool, now: MonoTime) {
        if wanted != self.wanted {
            self.wanted = wanted;
            self.wanted_since = now;
            self.obeyed_once = false;
            self.apart_since = None;
            if wanted.is_some_and(Lights::is_lit) && !reported.is_some_and(Lights::is_lit) {
                (self.ours, self.shown_lit) = (true, false);
            }
        }
        self.shown_lit |= reported.is_some_and(Lights::is_lit);
        // A wish that was short may show only after it has ended.
        let is_over = self.shown_lit || now.since(self.wanted_since) > self.limits.warn;
        if is_over && reported.is_some_and(|state| !state.is_lit()) && !wanted.is_some_and(Lights::is_lit) {
            self.ours = false;
        }
        let before = self.accord;
        self.accord = self.judge(reported, driver, before, now);
        self.driver_count += u64::from(self.accord == Accord::Driver && before != Accord::Driver);
        self.disobeyed_count += u64::from(self.accord == Accord::Disobeyed && before != Accord::Disobeyed);
    }

    /// Compares nothing for now, because the report cannot show this function. A light that is wanted
    /// meanwhile may be on when it can, and is ours then.
    pub fn suspend(&mut self, wanted: Option<T>) {
        self.wanted = None;
        self.apart_since = None;
        self.obeyed_once = false;
        self.ours |= wanted.is_some_and(Lights::is_lit);
        self.accord = Accord::Free;
    }

    /// As updated last.
    pub fn accord(&self) -> Accord {
        self.accord
    }

    /// Whether the driver has this function.
    pub fn is_drivers(&self) -> bool {
        self.accord == Accord::Driver
    }

    /// Times the driver was found to do something else, and times the vehicle did not obey.
    pub fn counts(&self) -> (u64, u64) {
        (self.driver_count, self.disobeyed_count)
    }

    /// When the accord changes with nothing happening.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let since = self.apart_since?;
        [past(since, self.limits.warn), past(since, self.limits.error)].into_iter().find(|at| *at > now)
    }

    fn judge(&mut self, reported: Option<T>, driver: bool, before: Accord, now: MonoTime) -> Accord {
        let Some(wanted) = self.wanted else {
            self.apart_since = None;
            return Accord::Free;
        };
        if reported == Some(wanted) && !driver {
            self.apart_since = None;
            self.obeyed_once = true;
            return Accord::Obeyed;
        }
        if driver || reported.is_some_and(|shown| self.is_drivers_doing(wanted, shown, before, now)) {
            self.apart_since = None;
            return Accord::Driver;
        }
        let apart = now.since(*self.apart_since.get_or_insert(now));
        match reported {
            _ if apart <= self.limits.warn => Accord::Settling,
            None => Accord::Unproven,
            Some(_) if apart <= self.limits.error => Accord::Late,
            Some(_) => Accord::Disobeyed,
        }
    }

    /// A light that nobody here wants is the driver's if he had it before, if it was on before we wanted
    /// anything, or if it came on after the vehicle had shown our wish and had time to settle.
    fn is_drivers_doing(&self, wanted: T, shown: T, before: Accord, now: MonoTime) -> bool {
        if shown == wanted || !shown.is_lit() {
            return false;
        }
        let settled = self.obeyed_once && now.since(self.wanted_since) > self.limits.warn;
        before == Accord::Driver || settled || (!wanted.is_lit() && !self.ours)
    }
}
