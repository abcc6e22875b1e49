//! Compares the vehicle's report with the request sent to the vehicle.

use std::num::NonZeroU8;
use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Turn;
use gateway_base::time::{MonoTime, deadline_after};

/// Time that the vehicle may take to show a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FeedbackLimits {
    /// Time after which a difference is a warning.
    pub warn: Duration,
    /// Time after which a difference is an error; at least `warn`.
    pub error: Duration,
}

/// A state of lights that can be compared with a report; by default no light is on.
pub trait Lights: Copy + Default + Eq {
    /// True for hazard lights, whose request for on is obeyed regardless of its stamp.
    const IS_HAZARD: bool;

    /// Returns true if a light is on.
    fn is_lit(self) -> bool {
        self != Self::default()
    }

    /// Returns the name used in texts.
    fn name(self) -> &'static str;
}

impl Lights for Turn {
    const IS_HAZARD: bool = false;

    fn name(self) -> &'static str {
        self.name()
    }
}

/// Hazard lights: `true` = on.
impl Lights for bool {
    const IS_HAZARD: bool = true;

    fn name(self) -> &'static str {
        if self { "on" } else { "off" }
    }
}

/// The result of comparing the report with the request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Compliance {
    /// No state is requested, so that nothing is compared.
    #[default]
    NotRequested,
    /// The report shows the request.
    Compliant,
    /// The report differs, but not for longer than the first limit.
    Pending,
    /// The report has differed for longer than the first limit.
    Overdue,
    /// The report has differed for longer than the second limit.
    Mismatch,
    /// There has been no report for longer than the first limit.
    NoFeedback,
    /// The report shows what the driver does, or a light that was on before the first request.
    DriverOverride,
}

/// Lights that the gateway has switched on and that later reports may show. Reports lag, so a short request
/// shows after it has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum OwnLights {
    /// A light reported as on was not switched on by the gateway.
    None,
    /// The report shows or will show this many requested lights, one after another.
    Expected(NonZeroU8),
}

impl OwnLights {
    fn at_least_one(self) -> Self {
        if self == Self::None { Self::Expected(NonZeroU8::MIN) } else { self }
    }

    fn one_more(self) -> Self {
        match self {
            Self::None => Self::Expected(NonZeroU8::MIN),
            Self::Expected(count) => Self::Expected(count.saturating_add(1)),
        }
    }

    fn one_fewer(self) -> Self {
        match self {
            Self::None => Self::None,
            Self::Expected(count) => NonZeroU8::new(count.get() - 1).map_or(Self::None, Self::Expected),
        }
    }
}

/// Monitor of one function: turn indicators or hazard lights.
#[derive(Debug, Clone)]
pub struct FeedbackMonitor<T> {
    limits: FeedbackLimits,
    requested: Option<T>,
    requested_since: MonoTime,
    /// Time since which the report differs from the request.
    mismatch_since: Option<MonoTime>,
    complied_once: bool,
    own_lights: OwnLights,
    /// True if the last report shows a light on.
    reported_lit: bool,
    /// Light attributed to the driver in the last report.
    driver_light: Option<T>,
    /// Compliance after the last update.
    pub compliance: Compliance,
    /// Number of driver overrides and mismatches since start.
    pub counts: FeedbackCounts,
}

/// Number of changes of compliance since start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FeedbackCounts {
    /// Number of changes to [`Compliance::DriverOverride`].
    pub driver_overrides: u64,
    /// Number of changes to [`Compliance::Mismatch`].
    pub mismatches: u64,
}

impl<T: Lights> FeedbackMonitor<T> {
    /// Creates a monitor without a request or a report.
    pub fn new(limits: FeedbackLimits) -> Self {
        Self {
            limits,
            requested: None,
            requested_since: MonoTime::ZERO,
            mismatch_since: None,
            complied_once: false,
            own_lights: OwnLights::None,
            reported_lit: false,
            driver_light: None,
            compliance: Compliance::NotRequested,
            counts: FeedbackCounts::default(),
        }
    }

    /// Compares the report with the request. `driver` is true if the vehicle signals that the driver has
    /// taken over.
    pub fn update(&mut self, requested: Option<T>, reported: Option<T>, driver: bool, now: MonoTime) {
        let requests_light = requested.is_some_and(Lights::is_lit);
        if requested != self.requested {
            let requested_light = self.requested.is_some_and(Lights::is_lit);
            self.requested = requested;
            self.requested_since = now;
            self.complied_once = false;
            self.mismatch_since = None;
            let is_reported_lit = reported.is_some_and(Lights::is_lit);
            if requests_light && (!is_reported_lit || (self.is_own_light() && !requested_light)) {
                let own = self.own_lights;
                self.own_lights = if requested_light { own.at_least_one() } else { own.one_more() };
            }
        }
        if let Some(is_lit) = reported.map(Lights::is_lit) {
            if self.reported_lit && !is_lit {
                let keeps_one = requests_light && self.is_own_light();
                let fewer = self.own_lights.one_fewer();
                self.own_lights = if keeps_one { fewer.at_least_one() } else { fewer };
            }
            if !is_lit && !requests_light && now.since(self.requested_since) > self.limits.warn {
                self.own_lights = OwnLights::None;
            }
            self.reported_lit = is_lit;
        }
        let compliance = self.judge(reported, driver, now);
        self.counts.mismatches +=
            u64::from(compliance == Compliance::Mismatch && self.compliance != Compliance::Mismatch);
        self.set_compliance(compliance);
    }

    /// Suspends the comparison while the report cannot show this function. A light requested in the meantime
    /// counts as the gateway's when the report can show it again. For `driver` see [`Self::update`].
    pub fn suspend(&mut self, requested: Option<T>, driver: bool) {
        self.requested = None;
        self.mismatch_since = None;
        self.driver_light = None;
        self.complied_once = false;
        if requested.is_some_and(Lights::is_lit) {
            self.own_lights = self.own_lights.at_least_one();
        }
        let is_override = driver && requested.is_some();
        self.set_compliance(if is_override { Compliance::DriverOverride } else { Compliance::NotRequested });
    }

    /// Returns true if the driver has taken over this function.
    pub fn is_driver_override(&self) -> bool {
        self.compliance == Compliance::DriverOverride
    }

    /// Returns true if the gateway has switched on a light that is or may be on.
    pub fn is_own_light(&self) -> bool {
        self.own_lights != OwnLights::None
    }

    /// Returns the time at which the compliance changes without a new request or report.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let since = self.mismatch_since?;
        [deadline_after(since, self.limits.warn), deadline_after(since, self.limits.error)]
            .into_iter()
            .find(|at| *at > now)
    }

    fn set_compliance(&mut self, compliance: Compliance) {
        let is_override = compliance == Compliance::DriverOverride;
        self.counts.driver_overrides += u64::from(is_override && !self.is_driver_override());
        self.compliance = compliance;
    }

    fn judge(&mut self, reported: Option<T>, driver: bool, now: MonoTime) -> Compliance {
        let Some(requested) = self.requested else {
            (self.mismatch_since, self.driver_light) = (None, None);
            return Compliance::NotRequested;
        };
        if reported == Some(requested) && !driver {
            (self.mismatch_since, self.driver_light, self.complied_once) = (None, None, true);
            return Compliance::Compliant;
        }
        if let Some(shown) = reported {
            let is_driver_override = self.is_driver_light(requested, shown, now);
            self.driver_light = reported.filter(|_| is_driver_override);
        }
        // Without a report, a light that was the driver's stays the driver's.
        if driver || self.driver_light.is_some_and(|light| light != requested) {
            self.mismatch_since = None;
            return Compliance::DriverOverride;
        }
        let mismatch = now.since(*self.mismatch_since.get_or_insert(now));
        match reported {
            _ if mismatch <= self.limits.warn => Compliance::Pending,
            None => Compliance::NoFeedback,
            Some(_) if mismatch <= self.limits.error => Compliance::Overdue,
            Some(_) => Compliance::Mismatch,
        }
    }

    /// Returns true for a light of the driver: a light that was already the driver's, was on before the first
    /// request, or came on after the vehicle had shown the request and had time to settle.
    fn is_driver_light(&self, requested: T, shown: T, now: MonoTime) -> bool {
        if shown == requested || !shown.is_lit() {
            return false;
        }
        let settled = self.complied_once && now.since(self.requested_since) > self.limits.warn;
        self.is_driver_override() || settled || (!requested.is_lit() && !self.is_own_light())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vehicle with a delay of 150 ms shows the first request when the second request starts and ends.
    #[test]
    fn a_report_that_lags_behind_several_requests_shows_no_driver_override() {
        let limits = FeedbackLimits { warn: Duration::from_millis(1500), error: Duration::from_secs(3) };
        let mut monitor = FeedbackMonitor::new(limits);
        let requested = |ms: i64| (0..200).contains(&ms) || (220..240).contains(&ms);
        for ms in (0..700).step_by(10) {
            let at = MonoTime::from_millis(u64::try_from(ms).unwrap());
            monitor.update(Some(requested(ms)), Some(requested(ms - 150)), false, at);
            assert_ne!(monitor.compliance, Compliance::DriverOverride, "at {ms} ms");
        }
        assert!(!monitor.is_own_light());
        monitor.update(Some(false), Some(true), false, MonoTime::from_millis(700));
        assert_eq!(monitor.compliance, Compliance::DriverOverride);
    }
}
