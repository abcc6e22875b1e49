//! A gateway with nothing but the decider, told by hand, on virtual time: a straight road of two lanes,
//! one of which has a piece tagged as a left turn.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use signal_gateway::config::files::Files;
use signal_gateway::config::{Overrides, load};
use signal_gateway::core::diagnostics::{Level, Status};
use signal_gateway::core::event::{Input, LinkState, Output};
use signal_gateway::core::gateway::Gateway;
use signal_gateway::core::time::{MonoTime, Now, WallStamp};
use signal_gateway::core::turn_signal::decision::Decision;
use signal_gateway::core::turn_signal::geometry::Pose;
use signal_gateway::core::turn_signal::inputs::Odometry;
use signal_gateway::core::turn_signal::route::Segment;
use signal_gateway::core::turn_signal::signal::{Hazard, Signal};
use signal_gateway::core::turn_signal::told::{PathPoint, Told, ToldRoute};

/// The road: lanelets 1, 2, 3 to 60, 80 and 200 m, of which 2 turns left; 11, 12, 13 to their left.
pub(crate) fn map() -> String {
    let (xs, ys) = ([0, 60, 80, 200], [-1.75, 1.75, 5.25]);
    let mut text = "<osm>\n".to_owned();
    for (row, y) in ys.iter().enumerate() {
        for (column, x) in xs.iter().enumerate() {
            text += &format!(
                "<node id='{}' lat='0' lon='0'><tag k='local_x' v='{x}'/><tag k='local_y' v='{y}'/></node>\n",
                row * 10 + column + 1
            );
        }
        for piece in 1..=3 {
            let from = row * 10 + piece;
            text += &format!("<way id='{}'><nd ref='{from}'/><nd ref='{}'/></way>\n", 100 + from, from + 1);
        }
    }
    for row in 0..2 {
        for piece in 1..=3 {
            let (left, right) = (110 + row * 10 + piece, 100 + row * 10 + piece);
            let turn = if (row, piece) == (0, 2) { "<tag k='turn_direction' v='left'/>" } else { "" };
            text += &format!(
                "<relation id='{}'><member type='way' ref='{left}' role='left'/>\
                 <member type='way' ref='{right}' role='right'/><tag k='type' v='lanelet'/>\
                 <tag k='subtype' v='road'/>{turn}</relation>\n",
                row * 10 + piece
            );
        }
    }
    text + "</osm>\n"
}

struct Texts(String);

impl Files for Texts {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match path.to_str() {
            Some("gateway.toml") => Ok(self.0.clone().into_bytes()),
            Some("map.osm") => Ok(map().into_bytes()),
            _ => Err(io::ErrorKind::NotFound.into()),
        }
    }
}

/// A command as it went out: when, ms, and what.
pub(crate) type Sent<T> = Vec<(u64, T)>;

/// The gateway and all that it put out.
pub(crate) struct Bench {
    gateway: Gateway,
    pub(crate) now: Now,
    pub(crate) turns: Sent<Signal>,
    pub(crate) hazards: Sent<Hazard>,
    pub(crate) decisions: Vec<(u64, Arc<Decision>)>,
    pub(crate) said: Vec<(Level, String)>,
}

fn at(ms: u64) -> Now {
    let wall = i64::try_from(ms).unwrap() * 1_000_000;
    Now { mono: MonoTime::from_millis(ms), wall: WallStamp::from_nanos(1_700_000_000_000_000_000 + wall) }
}

impl Bench {
    /// With these keys in `[turn_signal]`.
    pub(crate) fn new(keys: &str) -> Self {
        let text = format!("[turn_signal]\nmap = \"map.osm\"\n{keys}\n");
        let settings = load(&Texts(text), Path::new("gateway.toml"), &Overrides::default());
        let settings = settings.unwrap_or_else(|refused| panic!("{refused}"));
        let now = at(10_000);
        let mut bench = Self {
            gateway: Gateway::new(settings.gateway, LinkState::Up, now),
            now,
            turns: Vec::new(),
            hazards: Vec::new(),
            decisions: Vec::new(),
            said: Vec::new(),
        };
        bench.drain();
        bench
    }

    pub(crate) fn ms(&self) -> u64 {
        self.now.mono.as_nanos() / 1_000_000
    }

    pub(crate) fn tell(&mut self, told: Told) {
        self.gateway.handle(Input::Told(told), self.now);
        self.drain();
    }

    /// Odometry on the lane of lanelets 1 to 3.
    pub(crate) fn odometry(&mut self, x_m: f64, speed_mps: f64) {
        self.tell(Told::Odometry {
            odometry: Odometry { pose: Pose::new(x_m, 0.0, 0.0), speed_mps },
            stamp: self.now.wall,
        });
    }

    /// Nothing is told for so long.
    pub(crate) fn pass(&mut self, ms: u64) {
        let end = self.ms() + ms;
        loop {
            let due = self.gateway.next_deadline(self.now.mono).max(self.now.mono);
            if due >= MonoTime::from_millis(end) {
                break;
            }
            let waited = due.since(self.now.mono);
            self.now = Now { mono: due, wall: self.now.wall.after(waited) };
            self.gateway.handle(Input::Deadline, self.now);
            self.drain();
        }
        self.now = at(end);
    }

    /// The clock jumps: no deadline is handled before it has.
    pub(crate) fn jump(&mut self, ms: u64) {
        self.now = at(self.ms() + ms);
        self.gateway.handle(Input::Deadline, self.now);
        self.drain();
    }

    /// So long at one place, told ten times a second.
    pub(crate) fn stay(&mut self, x_m: f64, speed_mps: f64, ms: u64) {
        for _ in 0..ms / 100 {
            self.odometry(x_m, speed_mps);
            self.pass(100);
        }
    }

    pub(crate) fn turn(&self) -> Option<Signal> {
        self.turns.last().map(|(_, turn)| *turn)
    }

    pub(crate) fn hazard(&self) -> Option<Hazard> {
        self.hazards.last().map(|(_, hazard)| *hazard)
    }

    pub(crate) fn status(&self) -> Status {
        let statuses = self.gateway.statuses(self.now.mono);
        let mut decider = statuses.into_iter().filter(|status| status.name.ends_with("turn_signal_decider"));
        decider.next().unwrap()
    }

    pub(crate) fn value(&self, key: &str) -> String {
        let values: BTreeMap<_, _> = self.status().values.into_iter().collect();
        values.get(key).cloned().unwrap_or_else(|| panic!("no {key} in {values:?}"))
    }

    fn drain(&mut self) {
        let ms = self.ms();
        while let Some(output) = self.gateway.poll_output() {
            match output {
                Output::TurnCommand { command, stamp } => {
                    assert_eq!(stamp, self.now.wall);
                    self.turns.push((ms, command));
                }
                Output::HazardCommand { command, stamp } => {
                    assert_eq!(stamp, self.now.wall);
                    self.hazards.push((ms, command));
                }
                Output::Decision(decision) => self.decisions.push((ms, decision)),
                Output::Diagnostics { diagnostics, .. } if !diagnostics.refresh => {
                    self.said.extend(
                        diagnostics.statuses.into_iter().map(|status| (status.level, status.message)),
                    );
                }
                Output::Diagnostics { .. } => {}
                Output::TurnIndicators { .. }
                | Output::HazardLights { .. }
                | Output::WithdrawTurnIndicators
                | Output::WithdrawHazardLights
                | Output::TrafficLights(_)
                | Output::Transmit { .. }
                | Output::WouldTransmit { .. } => panic!("nothing of that is configured"),
            }
        }
    }
}

/// A route over these lanelets.
pub(crate) fn route(id: u128, lanes: &[i64]) -> Told {
    let segments = lanes.iter().map(|lane| Segment { preferred: *lane, lanes: vec![*lane] }).collect();
    let (start, goal) = (Pose::default(), Pose::new(190.0, 0.0, 0.0));
    Told::Route(Arc::new(ToldRoute { id, start, goal, segments }))
}

/// A planned path of this many points along the middle, a point each metre, from `x_m` on.
pub(crate) fn path(x_m: f64, points: u32) -> Vec<PathPoint> {
    let place = |index: u32| x_m + f64::from(index);
    let lane = |x: f64| {
        if x < 60.0 {
            1
        } else if x < 80.0 {
            2
        } else {
            3
        }
    };
    let point = |x: f64| PathPoint { pose: Pose::new(x, 0.0, 0.0), speed_mps: 5.0, lanes: vec![lane(x)] };
    (0..points).map(place).map(point).collect()
}

/// A bench that has announced the turn for two seconds, standing 20 m before it.
pub(crate) fn announcing() -> Bench {
    let mut bench = Bench::new("enabled = true");
    bench.tell(route(1, &[1, 2, 3]));
    bench.stay(36.0, 5.0, 2_000);
    assert_eq!(bench.turn(), Some(Signal::Left));
    bench
}

/// The period of the commands.
pub(crate) const PERIOD: Duration = Duration::from_millis(100);
