//! Whether the vehicle's report complies with what is requested: obeyed, not yet, not, or the driver's doing.

use std::time::Duration;

use super::Turn;
use crate::core::time::{MonoTime, deadline_after};

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

/// Whether the report complies with what is requested.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Compliance {
    /// Nothing is wanted.
    #[default]
    NotRequested,
    /// The report shows what is wanted.
    Compliant,
    /// It does not, but not for long.
    Pending,
    /// It has not for longer than the first limit.
    Overdue,
    /// It has not for longer than the second limit.
    Mismatch,
    /// There has been no report for longer than the first limit.
    NoFeedback,
    /// It shows what the driver does, or what was on before the gateway wanted anything.
    DriverOverride,
}

/// Watches one function.
#[derive(Debug, Clone)]
pub struct FeedbackMonitor<T> {
    limits: Limits,
    wanted: Option<T>,
    wanted_since: MonoTime,
    /// Since when the report has not shown what is wanted.
    mismatch_since: Option<MonoTime>,
    /// Whether the report has shown /// Whether the report has shown  request.
    complied_once: bool,
    /// How often the report may still show a light that we wanted: 0 = one that is on is not ours. The
    /// report comes late, so that short requests show after they have ended.
    own_lights: u8,
    /// Whether a light was on by the last report.
    reported_lit: bool,
    /// The light that was the driver's by the last report.
    driver_light: Option<T>,
    compliance: Compliance,
    /// Times the driver was found to do something else.
    driver_count: u64,
    /// Times the second limit was passed.
    mismatch_count: u64,
}

impl<T: Lights> FeedbackMonitor<T> {
    /// Nothing wanted, nothing seen.
    pub fn new(limits: Limits) -> Self {
        Self {
            limits,
            wanted: None,
            wanted_since: MonoTime::ZERO,
            mismatch_since: None,
            complied_once: false,
            own_lights: 0,
            reported_lit: false,
            driver_light: None,
            compliance: Compliance::NotRequested,
            driver_count: 0,
            mismatch_count: 0,
        }
    }

    /// Compares: `driver` = the vehicle itself says that the driver has taken this function.
    pub fn update(&mut self, wanted: Option<T>, reported: Option<T>, driver: bool, now: MonoTime) {
        let wants_light = wanted.is_some_and(Lights::is_lit);
        if wanted != self.wanted {
            let wanted_light = self.wanted.is_some_and(Lights::is_lit);
            self.wanted = wanted;
            self.wanted_since = now;
            self.complied_once = false;
            self.mismatch_since = None;
            if wants_light
                && (!reported.is_some_and(Lights::is_lit) || (self.own_lights > 0 && !wanted_light))
            {
                self.own_lights =
                    if wanted_light { self.own_lights.max(1) } else { self.own_lights.saturating_add(1) };
            }
        }
        if let Some(is_lit) = reported.map(Lights::is_lit) {
            if self.reported_lit && !is_lit {
                self.own_lights =
                    self.own_lights.saturating_sub(1).max(u8::from(wants_light && self.own_lights > 0));
            }
            if !is_lit && !wants_light && now.since(self.wanted_since) > self.limits.warn {
                self.own_lights = 0;
            }
            self.reported_lit = is_lit;
        }
        let before = self.compliance;
        self.compliance = self.judge(reported, driver, before, now);
        self.driver_count +=
            u64::from(self.compliance == Compliance::DriverOverride && before != Compliance::DriverOverride);
        self.mismatch_count +=
            u64::from(self.compliance == Compliance::Mismatch && before != Compliance::Mismatch);
    }

    /// Compares nothing for now, because the report cannot show this function. A light that is wanted
    /// meanwhile may be on when it can, and is ours then. `driver` as of [`Self::update`].
    pub fn suspend(&mut self, wanted: Option<T>, driver: bool) {
        self.wanted = None;
        self.mismatch_since = None;
        self.driver_light = None;
        self.complied_once = false;
        self.own_lights = self.own_lights.max(u8::from(wanted.is_some_and(Lights::is_lit)));
        let is_driver_override = driver && wanted.is_some();
        self.driver_count += u64::from(is_driver_override && self.compliance != Compliance::DriverOverride);
        self.compliance =
            if is_driver_override { Compliance::DriverOverride } else { Compliance::NotRequested };
    }

    /// As updated last.
    pub fn compliance(&self) -> Compliance {
        self.compliance
    }

    /// Whether the driver has this function.
    pub fn is_driver_override(&self) -> bool {
        self.compliance == Compliance::DriverOverride
    }

    /// Whether a light that is on, or may be, was lit on /// Whether a light that is on, or may be, was lit on
    /// request.
    pub fn is_own_light(&self) -> bool {
        self.own_lights > 0
    }

    /// Times the driver was found to do something else, and times the vehicle did not obey.
    pub fn counts(&self) -> (u64, u64) {
        (self.driver_count, self.mismatch_count)
    }

    /// When the compliance changes with nothing happening.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let since = self.mismatch_since?;
        [deadline_after(since, self.limits.warn), deadline_after(since, self.limits.error)]
            .into_iter()
            .find(|at| *at > now)
    }

    fn judge(&mut self, reported: Option<T>, driver: bool, before: Compliance, now: MonoTime) -> Compliance {
        let Some(wanted) = self.wanted else {
            self.mismatch_since = None;
            self.driver_light = None;
            return Compliance::NotRequested;
        };
        if reported == Some(wanted) && !driver {
            self.mismatch_since = None;
            self.driver_light = None;
            self.complied_once = true;
            return Compliance::Compliant;
        }
        if let Some(shown) = reported {
            let is_driver_override = self.is_driver_light(wanted, shown, before, now);
            self.driver_light = reported.filter(|_| is_driver_override);
        }
        // While nothing is reported, a light that was the driver's is.
        if driver || self.driver_light.is_some_and(|light| light != wanted) {
            self.mismatch_since = None;
            return Compliance::DriverOverride;
        }
        let apart = now.since(*self.mismatch_since.get_or_insert(now));
        match reported {
            _ if apart <= self.limits.warn => Compliance::Pending,
            None => Compliance::NoFeedback,
            Some(_) if apart <= self.limits.error => Compliance::Overdue,
            Some(_) => Compliance::Mismatch,
        }
    }

    /// A light that nobody here wants is the driver's if he had it before, if it was on before we wanted
    /// anything, or if it came on after the vehicle had shown /// anything, or if it came on after the vehicle had
    /// shown  request and had time to settle.
    fn is_driver_light(&self, wanted: T, shown: T, before: Compliance, now: MonoTime) -> bool {
        if shown == wanted || !shown.is_lit() {
            return false;
        }
        let settled = self.complied_once && now.since(self.wanted_since) > self.limits.warn;
        before == Compliance::DriverOverride || settled || (!wanted.is_lit() && self.own_lights == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vehicle that takes 150 ms shows the first wish when the second one comes and ends.
    #[test]
    fn a_report_that_lags_behind_several_wishes_does_not_show_the_drivers_doing() {
        let limits = Limits { warn: Duration::from_millis(1500), error: Duration::from_secs(3) };
        let mut watch = FeedbackMonitor::new(limits);
        let requested = |ms: i64| (0..200).contains(&ms) || (220..240).contains(&ms);
        for ms in (0..700).step_by(10) {
            let at = MonoTime::from_millis(u64::try_from(ms).unwrap());
            watch.update(Some(requested(ms)), Some(requested(ms - 150)), false, at);
            assert_ne!(watch.compliance(), Compliance::DriverOverride, "at {ms} ms");
        }
        assert!(!watch.is_own_light());
        watch.update(Some(false), Some(true), false, MonoTime::from_millis(700));
        assert_eq!(watch.compliance(), Compliance::DriverOverride);
    }
}
