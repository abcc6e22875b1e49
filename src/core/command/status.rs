//! What diagnostics say of commands: one task a function, and one for sending.

use super::accord::{Accord, Lights};
use super::arbitration::Why;
use super::control_mode::Mode;
use super::flow::{CommandFlow, Finding, FunctionFinding};
use super::intake::{IntakeCounts, Opinion, Refusal};
use super::sender::{SendCounts, SendTrouble};
use super::settings::CommandSource;
use super::{Turn, hazard_name};
use crate::core::bus::Bus;
use crate::core::diagnostics::{Level, Status};
use crate::core::time::MonoTime;

/// Level and words of one status.
type Said = (Level, String);

/// What a function is called, and how its states are.
trait Spoken: Lights {
    fn spoken(self) -> &'static str;
}

impl Spoken for Turn {
    fn spoken(self) -> &'static str {
        self.name()
    }
}

impl Spoken for bool {
    fn spoken(self) -> &'static str {
        hazard_name(self)
    }
}

impl CommandFlow {
    /// `turn_indicators_command`, `hazard_lights_command` and `command_transmission`.
    pub fn statuses(&self, node: &str, buses: &[Bus], now: MonoTime) -> Vec<Status> {
        let state = self.state();
        let Finding { decision, turn, hazard, .. } = state;
        let turn_said = of_function(turn, (decision.demand.turn, decision.wanted.turn, decision.turn));
        let mut hazard_said =
            of_function(hazard, (decision.demand.hazard, decision.wanted.hazard, decision.hazard));
        if state.button_given_up && hazard_said.0 != Level::Error {
            hazard_said = (Level::Error, "the hazard button was pressed in vain".to_owned());
        }
        let turn_values = (self.turn.counts(), self.turn.age(now), self.turn_watch.counts());
        let hazard_values = (self.hazard.counts(), self.hazard.age(now), self.hazard_watch.counts());
        let status = |task: &str, (level, message): Said, values| Status {
            name: format!("{node}: {task}"),
            level,
            message,
            values,
        };
        vec![
            status(
                "turn_indicators_command",
                turn_said,
                values(turn, decision.demand.turn, decision.turn, turn_values),
            ),
            status(
                "hazard_lights_command",
                hazard_said,
                values(hazard, decision.demand.hazard, decision.hazard, hazard_values),
            ),
            status("command_transmission", self.transmission(buses), self.transmission_values()),
        ]
    }

    /// The present state in one sentence: what is asked for, why, and in which mode.
    pub fn explanation(&self) -> String {
        let Finding { decision, mode, .. } = self.state();
        format!(
            "turn indicators {} ({}), hazard lights {} ({}), control mode {}",
            asked(decision.demand.turn),
            decision.turn.text(),
            asked(decision.demand.hazard),
            decision.hazard.text(),
            mode_text(*mode),
        )
    }

    fn transmission(&self, buses: &[Bus]) -> Said {
        let state = self.state();
        let name = |at: usize| self.binding.messages.get(at).map_or("", |message| message.name.as_str());
        if let Some(bus) = state.cut_off.and_then(|bus| buses.get(usize::from(bus.0))) {
            return (Level::Error, format!("nothing can be sent on {}", bus.settings().name));
        }
        if let (Some(at), true) = (state.rival, self.is_live()) {
            return (Level::Error, format!("somebody else sends {} as well", name(at)));
        }
        match (state.trouble, state.mode) {
            (Some(SendTrouble::Broken), _) => (Level::Error, "frames cannot be sent".to_owned()),
            (_, Mode::Undefined(raw)) => (Level::Error, format!("undefined control mode {raw}")),
            (Some(SendTrouble::Delayed), _) => (Level::Warn, "frames are delayed".to_owned()),
            (None, Mode::Unknown) => {
                (Level::Warn, "control mode unknown: nothing is asked of the vehicle".to_owned())
            }
            (None, Mode::Known(_)) if !self.is_live() => (Level::Ok, "dry run: nothing is sent".to_owned()),
            (None, Mode::Known(mode)) => (Level::Ok, format!("control mode {}", mode.name())),
        }
    }

    fn transmission_values(&self) -> Vec<(&'static str, String)> {
        let each = |count: fn(SendCounts) -> u64| {
            let texts = self.send_counts().map(|(name, counts)| format!("{name} {}", count(counts)));
            texts.collect::<Vec<_>>().join(", ")
        };
        let source = match self.settings.source {
            CommandSource::Topic => "topic",
            CommandSource::Decider => "decider",
        };
        vec![
            ("tx", if self.is_live() { "on" } else { "off" }.to_owned()),
            ("source", source.to_owned()),
            ("control_mode", mode_text(self.state().mode)),
            ("undefined_control_modes", self.undefined_modes.to_string()),
            ("frames", each(|counts| counts.sent)),
            ("with_authority", each(|counts| counts.with_authority)),
            ("queue_full", each(|counts| counts.queue_full)),
            ("refused", each(|counts| counts.refused)),
            ("echoed", each(|counts| counts.echoed)),
            ("foreign", each(|counts| counts.foreign)),
        ]
    }
}

fn asked<T: Spoken>(demand: Option<T>) -> &'static str {
    demand.map_or("left to the vehicle", Spoken::spoken)
}

fn mode_text(mode: Mode) -> String {
    match mode {
        Mode::Known(mode) => mode.name().to_owned(),
        Mode::Undefined(raw) => format!("undefined ({raw})"),
        Mode::Unknown => "unknown".to_owned(),
    }
}

/// `(demand, wanted, why)` of one function.
fn of_function<T: Spoken>(
    finding: &FunctionFinding<T>,
    (demand, wanted, why): (Option<T>, Option<T>, Why),
) -> Said {
    let reports = || finding.reported.map_or("nothing", Spoken::spoken);
    let wants = || asked(wanted);
    let is_silent = matches!(finding.opinion, Opinion::Silent(_));
    match (finding.refusal, finding.accord) {
        (Some(Refusal::Undefined(raw)), _) => (Level::Error, format!("undefined command {raw} is ignored")),
        (_, Accord::Disobeyed) => {
            (Level::Error, format!("commanded {}, but the vehicle reports {}", wants(), reports()))
        }
        (_, _) if is_silent && why != Why::NotGranted => {
            (Level::Error, format!("the command has fallen silent: {}", asked(demand)))
        }
        (Some(Refusal::StampBackwards), _) => {
            (Level::Warn, "a command with an older stamp is rejected".to_owned())
        }
        (None, _) if finding.is_unsteady => {
            (Level::Warn, "the command changes all the time: more than one sender?".to_owned())
        }
        (None, Accord::Late) => {
            (Level::Warn, format!("commanded {}, but the vehicle reports {} still", wants(), reports()))
        }
        (None, Accord::Unproven) => (Level::Warn, format!("commanded {}, and no report shows it", wants())),
        (None, Accord::Driver) => {
            (Level::Warn, format!("commanded {}, left to the driver: {}", wants(), reports()))
        }
        (None, Accord::Free | Accord::Obeyed | Accord::Settling) if why == Why::NeverCommanded => {
            (Level::Warn, "no command has come".to_owned())
        }
        (None, Accord::Free | Accord::Obeyed | Accord::Settling) => {
            (Level::Ok, format!("{}, {}", asked(demand), why.text()))
        }
    }
}

/// Counts of the topic, age of its last message, counts of the watch.
type Counted = (IntakeCounts, Option<std::time::Duration>, (u64, u64));

fn values<T: Spoken>(
    finding: &FunctionFinding<T>,
    demand: Option<T>,
    why: Why,
    (counts, age, (driver, disobeyed)): Counted,
) -> Vec<(&'static str, String)> {
    let said = match finding.opinion {
        Opinion::Never => "never",
        Opinion::None => "no opinion",
        Opinion::Wanted(wish) => wish.spoken(),
        Opinion::Silent(_) => "silent",
    };
    vec![
        ("command", said.to_owned()),
        ("asked", asked(demand).to_owned()),
        ("because", why.text().to_owned()),
        ("reported", finding.reported.map_or("unknown", Spoken::spoken).to_owned()),
        ("command_age_s", age.map_or("-".to_owned(), |age| format!("{:.1}", age.as_secs_f64()))),
        ("commands", counts.received.to_string()),
        ("no_command", counts.no_command.to_string()),
        ("undefined", counts.undefined.to_string()),
        ("stamps_backwards", counts.backwards.to_string()),
        ("of_the_past", counts.past.to_string()),
        ("driver_took_over", driver.to_string()),
        ("not_obeyed", disobeyed.to_string()),
    ]
}
