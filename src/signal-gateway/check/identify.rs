//! Finds the built-in profiles that fit frames of an unknown vehicle, for `identify`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use super::vehicle_status::{bound_messages, report_names};
use crate::config::built_in::BuiltIn;
use crate::config::files::Disk;
use crate::config::{Refused, fingerprints, load_profile};
use can_signal::can::{BusIndex, Frame, IdMatch, IdTable};
use gateway_base::time::{MonoTime, WallStamp};
use vehicle_bringup::plausibility::evidence::ProfileEvidence;
use vehicle_bringup::plausibility::fingerprint::{Fingerprint, PlatformList, PlatformMatch};
use vehicle_bringup::plausibility::fit::{Fit, FitVerdict, Support, fit};

/// Number of frames for which a checksum or counter must hold before it decides.
const MIN_PROOF: u64 = 100;

/// Collects the evidence for each profile on each interface, frame by frame.
#[derive(Debug)]
pub struct Identifier {
    profiles: Vec<KnownProfile>,
    lists: &'static [PlatformList],
    /// Positions of the profiles that bind an identifier.
    bound: IdTable<usize>,
    /// Identifiers of which one frame counts: heartbeats, and all messages of invented vehicles.
    watched: IdTable<IdMatch>,
    interfaces: Vec<InterfaceEvidence>,
    first: Option<WallStamp>,
    now: MonoTime,
    frames: u64,
}

/// A built-in profile and its evidence before the first frame.
#[derive(Debug)]
struct KnownProfile {
    name: &'static str,
    vehicle: String,
    reports: Vec<&'static str>,
    bus: String,
    evidence: ProfileEvidence,
    heartbeats: Vec<IdMatch>,
    /// Identifiers without which the profile is not a candidate: all bound messages of an invented vehicle,
    /// which no real bus is taken for; otherwise none.
    required: Vec<IdMatch>,
    identifier_lists: Vec<&'static PlatformList>,
}

#[derive(Debug, Default)]
struct InterfaceEvidence {
    name: String,
    /// Evidence by the position of the profile.
    evidence: BTreeMap<usize, ProfileEvidence>,
    /// Watched identifiers that were received.
    received: BTreeSet<IdMatch>,
    fingerprint: Fingerprint,
}

/// A profile with received messages.
#[derive(Debug)]
pub struct ProfileCandidate<'a> {
    /// Name of the profile.
    pub profile: &'static str,
    /// Name of the vehicle.
    pub vehicle: &'a str,
    /// Names of the reports that it provides.
    pub reports: &'a [&'static str],
    /// Name of its bus.
    pub bus: &'a str,
    /// The interface on which it fits best.
    pub interface: &'a str,
    /// Evidence for and against the profile.
    pub fit: Fit,
    /// All counts for the profile.
    pub evidence: &'a ProfileEvidence,
}

impl Identifier {
    /// Creates an identifier for the built-in profiles. Fails only if one of them is invalid.
    pub fn new() -> Result<Self, Refused> {
        let paths = BuiltIn::Profile.names().filter_map(|name| Some((name, BuiltIn::Profile.path(name)?)));
        let profiles =
            paths.map(|(name, path)| KnownProfile::load(name, &path)).collect::<Result<Vec<_>, _>>()?;
        let bound = profiles.iter().enumerate().flat_map(|(position, profile)| {
            let ids: BTreeSet<_> = profile.evidence.ids().map(|(_, ids)| ids).collect();
            ids.into_iter().map(move |ids| (ids, position))
        });
        let bound = bound.collect();
        let watched = profiles.iter().flat_map(|profile| profile.heartbeats.iter().chain(&profile.required));
        let watched: BTreeSet<_> = watched.copied().collect();
        let watched = watched.into_iter().map(|ids| (ids, ids)).collect();
        let lists = fingerprints::lists()?;
        let (interfaces, first, now, frames) = (Vec::new(), None, MonoTime::ZERO, 0);
        Ok(Self { profiles, lists, bound, watched, interfaces, first, now, frames })
    }

    /// Adds the next frame of an interface.
    pub fn frame(&mut self, interface: &str, frame: &Frame, stamp: WallStamp) {
        self.frames += 1;
        let first = *self.first.get_or_insert(stamp);
        let nanos = stamp.as_nanos().saturating_sub(first.as_nanos());
        let at = MonoTime::ZERO.after(Duration::from_nanos(u64::try_from(nanos).unwrap_or(0)));
        self.now = self.now.max(at);
        let id = frame.id();
        if !self.interfaces().any(|known| known == interface) {
            let name = interface.to_owned();
            self.interfaces.push(InterfaceEvidence { name, ..InterfaceEvidence::default() });
        }
        let Some(interface) = self.interfaces.iter_mut().find(|known| known.name == interface) else {
            return;
        };
        if interface.fingerprint.frame(frame) {
            interface.received.extend(self.watched.get(id));
        }
        for profile in self.bound.get(id) {
            let fresh = || self.profiles[*profile].evidence.clone();
            let evidence = interface.evidence.entry(*profile).or_insert_with(fresh);
            // Every built-in profile has one bus.
            evidence.frame(BusIndex(0), frame, self.now);
        }
    }

    /// Returns true if more frames would hardly change the result: only one profile fits, and it has a valid
    /// checksum or counter, or a side that was on.
    pub fn is_sure(&self) -> bool {
        let candidates = self.candidates();
        let mut fitting = candidates.iter().filter(|candidate| candidate.fits());
        let (Some(first), None) = (fitting.next(), fitting.next()) else { return false };
        let is_strong = |support: &Support| {
            matches!(support, Support::Integrity { frames: MIN_PROOF.., .. } | Support::Sides { .. })
        };
        first.fit.support.iter().any(is_strong)
    }

    /// Returns the number of frames added.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Returns the time since the first frame.
    pub fn length(&self) -> Duration {
        self.now.since(MonoTime::ZERO)
    }

    /// Returns the names of the interfaces, in the order of their first frames.
    pub fn interfaces(&self) -> impl Iterator<Item = &str> {
        self.interfaces.iter().map(|interface| interface.name.as_str())
    }

    /// Returns the number of profiles that were tried.
    pub fn profiles(&self) -> usize {
        self.profiles.len()
    }

    /// Returns the platforms indicated by the identifiers on each interface, even before any indicator was
    /// used.
    pub fn platforms(&self) -> impl Iterator<Item = (&str, Vec<PlatformMatch<'static>>)> {
        let found = |interface: &'_ InterfaceEvidence| interface.fingerprint.platforms(self.lists);
        self.interfaces.iter().map(move |interface| (interface.name.as_str(), found(interface)))
    }

    /// Returns the names of the profiles that name a list.
    pub fn profiles_of(&self, list: &PlatformList) -> Vec<&'static str> {
        let has_list =
            |profile: &&KnownProfile| profile.identifier_lists.iter().any(|own| own.name == list.name);
        self.profiles.iter().filter(has_list).map(|profile| profile.name).collect()
    }

    /// Returns the profiles with received messages, best first, each on the interface that it fits best.
    pub fn candidates<'a>(&'a self) -> Vec<ProfileCandidate<'a>> {
        let candidate = |(position, profile): (usize, &'a KnownProfile)| {
            let is_complete = |interface: &&InterfaceEvidence| {
                profile.required.iter().all(|ids| interface.received.contains(ids))
            };
            let fits = self.interfaces.iter().filter(is_complete).filter_map(move |interface| {
                let evidence = interface.evidence.get(&position)?;
                let mut heartbeats = profile.heartbeats.clone();
                heartbeats.retain(|ids| interface.received.contains(ids));
                let lists = profile.identifier_lists.iter().copied();
                let platform = interface.fingerprint.compare_best(lists);
                Some((interface, evidence, fit(evidence, &heartbeats, platform)?))
            });
            let (interface, evidence, fit) = fits.max_by_key(|(_, _, fit)| (fit.verdict, fit.score))?;
            Some(ProfileCandidate {
                profile: profile.name,
                vehicle: &profile.vehicle,
                reports: &profile.reports,
                bus: &profile.bus,
                interface: &interface.name,
                fit,
                evidence,
            })
        };
        let mut candidates: Vec<_> = self.profiles.iter().enumerate().filter_map(candidate).collect();
        candidates.sort_by_key(|candidate| std::cmp::Reverse((candidate.fit.verdict, candidate.fit.score)));
        candidates
    }

    /// Returns the candidates that nothing contradicts, best first.
    pub fn possible(&self) -> Vec<ProfileCandidate<'_>> {
        let mut candidates = self.candidates();
        candidates.retain(|candidate| candidate.fit.verdict > FitVerdict::No);
        candidates
    }
}

impl ProfileCandidate<'_> {
    /// Returns true if the profile fits better than chance explains.
    pub fn fits(&self) -> bool {
        self.fit.verdict == FitVerdict::Fits
    }
}

impl KnownProfile {
    fn load(name: &'static str, path: &Path) -> Result<Self, Refused> {
        let settings = load_profile(&Disk, path)?;
        let databases: Vec<_> = settings.dbcs.iter().map(|dbc| &dbc.database).collect();
        let gateway = &settings.gateway;
        let evidence = ProfileEvidence::new(&gateway.lights, &gateway.v2i.table, &databases);
        let heartbeats =
            gateway.buses.iter().flat_map(|bus| bus.heartbeat_messages.iter().copied()).collect();
        // Every built-in profile has one bus.
        let bus = gateway.buses.first().map_or_else(String::new, |bus| bus.name.clone());
        let identifier_lists =
            settings.dbcs.iter().flat_map(|dbc| dbc.identifier_lists.iter().copied()).collect();
        let required = if settings.provenance.is_invented() {
            bound_messages(&settings).into_iter().map(|message| message.ids).collect()
        } else {
            Vec::new()
        };
        let (reports, vehicle) = (report_names(&settings), settings.vehicle);
        Ok(Self { name, vehicle, reports, bus, evidence, heartbeats, required, identifier_lists })
    }
}
