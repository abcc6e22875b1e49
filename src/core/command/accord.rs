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
    /// How often the report may still show a light that we wanted: 0 = one that is on is not ours. The
    /// report comes late, so that short wishes show after they have ended.
    ours: u8,
    /// Whether a light was on by the last report.
    shown_lit: bool,
    /// The light that was the driver's by the last report.
    drivers_light: Option<T>,
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
            ours: 0,
            shown_lit: false,
            drivers_light: None,
            accord: Accord::Free,
            driver_count: 0,
            disobeyed_count: 0,
        }
    }

    /// Compares: `driver` = the vehicle itself says that the driver has taken this function.
    pub fn update(&mut self, wanted: Option<T>, reported: Option<T>, driver: bool, now: MonoTime) {
        let wants_light = wanted.is_some_and(Lights::is_lit);
        if wanted != self.wanted {
            let wanted_light = self.wanted.is_some_and(Lights::is_lit);
            self.wanted = wanted;
            self.wanted_since = now;
            self.obeyed_once = false;
            self.apart_since = None;
            if wants_light && (!reported.is_some_and(Lights::is_lit) || (self.ours > 0 && !wanted_light)) {
                self.ours = if wanted_light { self.ours.max(1) } else { self.ours.saturating_add(1) };
            }
        }
        if let Some(is_lit) = reported.map(Lights::is_lit) {
            if self.shown_lit && !is_lit {
                self.ours = self.ours.saturating_sub(1).max(u8::from(wants_light && self.ours > 0));
            }
            if !is_lit && !wants_light && now.since(self.wanted_since) > self.limits.warn {
                self.ours = 0;
            }
            self.shown_lit = is_lit;
        }
        let before = self.accord;
        self.accord = self.judge(reported, driver, before, now);
        self.driver_count += u64::from(self.accord == Accord::Driver && before != Accord::Driver);
        self.disobeyed_count += u64::from(self.accord == Accord::Disobeyed && before != Accord::Disobeyed);
    }

    /// Compares nothing for now, because the report cannot show this function. A light that is wanted
    /// meanwhile may be on when it can, and is ours then. `driver` as of [`Self::update`].
    pub fn suspend(&mut self, wanted: Option<T>, driver: bool) {
        self.wanted = None;
        self.apart_since = None;
        self.drivers_light = None;
        self.obeyed_once = false;
        self.ours = self.ours.max(u8::from(wanted.is_some_and(Lights::is_lit)));
        let is_drivers = driver && wanted.is_some();
        self.driver_count += u64::from(is_drivers && self.accord != Accord::Driver);
        self.accord = if is_drivers { Accord::Driver } else { Accord::Free };
    }

    /// As updated last.
    pub fn accord(&self) -> Accord {
        self.accord
    }

    /// Whether the driver has this function.
    pub fn is_drivers(&self) -> bool {
        self.accord == Accord::Driver
    }

    /// Whether a light that is on, or may be, was lit on our wish.
    pub fn is_ours(&self) -> bool {
        self.ours > 0
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
            self.drivers_light = None;
            return Accord::Free;
        };
        if reported == Some(wanted) && !driver {
            self.apart_since = None;
            self.drivers_light = None;
            self.obeyed_once = true;
            return Accord::Obeyed;
        }
        if let Some(shown) = reported {
            let is_drivers = self.is_drivers_doing(wanted, shown, before, now);
            self.drivers_light = reported.filter(|_| is_drivers);
        }
        // While nothing is reported, a light that was the driver's is.
        if driver || self.drivers_light.is_some_and(|light| light != wanted) {
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
        before == Accord::Driver || settled || (!wanted.is_lit() && self.ours == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vehicle that takes 150 ms shows the first wish when the second one comes and ends.
    #[test]
    fn a_report_that_lags_behind_several_wishes_does_not_show_the_drivers_doing() {
        let limits = Limits { warn: Duration::from_millis(1500), error: Duration::from_secs(3) };
        let mut watch = Watch::new(limits);
        let wish = |ms: i64| (0..200).contains(&ms) || (220..240).contains(&ms);
        for ms in (0..700).step_by(10) {
            let at = MonoTime::from_millis(u64::try_from(ms).unwrap());
            watch.update(Some(wish(ms)), Some(wish(ms - 150)), false, at);
            assert_ne!(watch.accord(), Accord::Driver, "at {ms} ms");
        }
        assert!(!watch.is_ours());
        watch.update(Some(false), Some(true), false, MonoTime::from_millis(700));
        assert_eq!(watch.accord(), Accord::Driver);
    }
}
