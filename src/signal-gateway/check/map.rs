//! Checks the tags of a lanelet2 map that affect turn signals.

use std::path::Path;

use super::kind::CheckKind;
use super::report::CheckReport;
use crate::config::files::Files;
use crate::config::{Problem, read_lane_network};
use crate::report::text::counted;
use lanelet2_map::lane_network::LaneNetwork;
use lanelet2_map::tag_check::{MapFlaw, check_tags};
use turn_signal::compat::DeciderCompat;
use vehicle_bringup::plausibility::finding::Severity;

/// Checks a map by itself, with the default settings of the decider. Returns the problem if it cannot be
/// read.
pub fn map(files: &dyn Files, path: &Path) -> Result<CheckReport, Problem> {
    let road = read_lane_network(files, path)?;
    let mut report = CheckReport::default();
    report.line("map", summary(&path.display().to_string(), &road));
    tags(&road, DeciderCompat::Improved, &mut report);
    Ok(report)
}

/// Returns the path of a map with its numbers of lanelets and roundabouts.
pub(super) fn summary(path: &str, road: &LaneNetwork) -> String {
    let count = |count: usize, noun| counted(count.try_into().unwrap_or(u64::MAX), noun);
    let (lanes, roundabouts) = (road.lanes().count(), road.roundabouts().len());
    format!("{path}: {}, {}", count(lanes, "lanelet"), count(roundabouts, "roundabout"))
}

/// Adds the flaws of the map's tags. Flaws that the decider corrects by default are only notes.
pub(super) fn tags(road: &LaneNetwork, compat: DeciderCompat, report: &mut CheckReport) {
    for finding in check_tags(road) {
        let is_made_up_for = compat == DeciderCompat::Improved
            && matches!(finding.flaw, MapFlaw::SplitTurn { .. } | MapFlaw::UntaggedExit);
        // Only the map's author can decide whether a branch at a low angle is a turn.
        let may_be_meant = matches!(finding.flaw, MapFlaw::UntaggedLowFork { .. });
        let severity = if is_made_up_for || may_be_meant { Severity::Note } else { Severity::Warning };
        report.find(severity, CheckKind::MapTag, finding.to_string());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::Layout;
    use crate::config::files::TestFiles;
    use lanelet2_map::geometry::Point;
    use lanelet2_map::lane_network::{Lanelet, TurnDirection};

    const CROSSROADS: &str = include_str!("../../../tests/maps/crossroads.osm");

    fn checked(text: &str) -> CheckReport {
        map(&TestFiles(&[("map.osm", text)]), Path::new("map.osm")).unwrap()
    }

    #[test]
    fn flaws_of_a_map_are_warnings_with_their_lanelets() {
        let text = checked(CROSSROADS).text(Layout::default());
        let sound = "map        map.osm: 14 lanelets, 0 roundabouts\n\n0 errors, 0 warnings, 0 notes\n";
        assert_eq!(text, sound);
        let exchanged = CROSSROADS.replace("v=\"left\"", "v=\"middle\"").replace("v=\"right\"", "v=\"left\"");
        let report = checked(&exchanged);
        let (text, concerns) = (report.text(Layout::default()), report.count(Severity::Warning));
        let lines = [
            "warning    lanelet 34642 at (3773.5, 73725.0) m: tagged left, but it bends 94° to the right\n",
            "warning    lanelet 34645 at (3755.0, 73734.5) m: turns off by 73° to the left where the road forks after \
             34468, without a turn_direction\n",
            "warning    lanelet 34645 at (3755.0, 73734.5) m: its turn_direction \"middle\" names no direction: expected \
             left, right or straight, in lower case\n",
        ];
        assert!(concerns == 4 && lines.iter().all(|line| text.contains(line)), "{concerns}\n{text}");
    }

    #[test]
    fn what_the_decider_makes_up_for_is_not_a_warning() {
        let lane = |id, followers: &[i64]| Lanelet {
            id,
            turn_direction: TurnDirection::Left,
            centerline: vec![Point::new(0.0, 0.0), Point::new(9.0, 0.0), Point::new(15.0, 6.0)],
            followers: followers.to_vec(),
            ..Lanelet::default()
        };
        let road = LaneNetwork::new([lane(1, &[2]), lane(2, &[])], Vec::new());
        for (compat, concerns) in [(DeciderCompat::Improved, 0), (DeciderCompat::Upstream, 1)] {
            let mut report = CheckReport::default();
            tags(&road, compat, &mut report);
            let text = report.text(Layout::default());
            assert!(text.contains("lanelet 1 at (0.0, 0.0) m: a turn tagged left"), "{text}");
            assert_eq!(report.count(Severity::Warning), concerns, "{compat:?}");
        }
    }
}
