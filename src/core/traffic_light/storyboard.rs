//! Acts and events: when they begin, what they do, when they are over.
//!
//! Elements are looked at in the order of the document. All actions complete at once, so an event
//! starts, runs and ends within one frame. That frame lasts, for each one who waits for it, from then
//! to its own next turn: nobody misses it for standing earlier in the document.

use super::event_log::{ActionSource, ScenarioEvent, ScenarioOutcome};
use super::refusal::Refusal;
use super::scenario::{Act, ElementState, Event, Scenario, Trigger};
use super::scenario_state::ScenarioState;
use super::trigger::TriggerMemory;

/// Where all acts and events stand, and what their triggers remember.
#[derive(Debug, Clone)]
pub(super) struct Storyboard {
    acts: Vec<ActTriggers>,
    stop: Option<TriggerMemory>,
    board: Board,
}

#[derive(Debug, Clone)]
struct ActTriggers {
    start: Option<TriggerMemory>,
    stop: Option<TriggerMemory>,
    events: Vec<Option<TriggerMemory>>,
}

#[derive(Debug, Clone)]
struct Board {
    acts: Vec<ActProgress>,
    turn: Turn,
}

#[derive(Debug, Clone)]
struct ActProgress {
    progress: Progress,
    /// With the number of executions.
    events: Vec<(Progress, u32)>,
}

/// Whose turn it is: a frame, and a position in the document.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
struct Turn {
    frame: u64,
    position: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Stand {
    #[default]
    Standby,
    Running,
    Complete,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Progress {
    stand: Stand,
    started: Option<Turn>,
    ended: Option<Turn>,
    stopped: Option<Turn>,
}

impl Storyboard {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let memory = |trigger: &Option<Trigger>| trigger.as_ref().map(TriggerMemory::new);
        let triggers = |act: &Act| ActTriggers {
            start: memory(&act.start),
            stop: memory(&act.stop),
            events: act.events.iter().map(|event| memory(&event.start)).collect(),
        };
        let standby = |act: &Act| ActProgress {
            progress: Progress::default(),
            events: vec![(Progress::default(), 0); act.events.len()],
        };
        Self {
            acts: scenario.acts.iter().map(triggers).collect(),
            stop: memory(&scenario.stop),
            board: Board { acts: scenario.acts.iter().map(standby).collect(), turn: Turn::default() },
        }
    }

    /// One frame.
    pub(super) fn step(
        &mut self,
        scenario: &Scenario,
        scenario_state: &mut ScenarioState,
    ) -> Result<(), Refusal> {
        self.board.turn = Turn { frame: self.board.turn.frame + 1, position: 0 };
        for (index, triggers) in self.acts.iter_mut().enumerate() {
            self.board.turn.position += 1;
            let first = self.board.turn.position;
            triggers.step(index, &mut self.board, scenario, scenario_state)?;
            if scenario_state.verdict.is_some() {
                return Ok(());
            }
            // An event has the same position in each frame, whether it was looked at or not.
            self.board.turn.position = first + triggers.events.len();
        }
        self.board.turn.position += 1;
        if fires(&mut self.stop, scenario.stop.as_ref(), &self.board, scenario, scenario_state)? == Some(true)
        {
            scenario_state.end(ScenarioOutcome::Stopped);
        }
        Ok(())
    }
}

impl ActTriggers {
    fn step(
        &mut self,
        index: usize,
        board: &mut Board,
        scenario: &Scenario,
        scenario_state: &mut ScenarioState,
    ) -> Result<(), Refusal> {
        let Some(act) = scenario.acts.get(index) else { return Ok(()) };
        match board.act(index).map(|act| act.progress.stand) {
            None | Some(Stand::Complete) => return Ok(()),
            Some(Stand::Running) => {}
            Some(Stand::Standby) => {
                if fires(&mut self.start, act.start.as_ref(), board, scenario, scenario_state)? == Some(false)
                {
                    return Ok(());
                }
                board.start_act(index);
                scenario_state.note(ScenarioEvent::ActStarted { act: index });
            }
        }
        if fires(&mut self.stop, act.stop.as_ref(), board, scenario, scenario_state)? == Some(true) {
            board.stop_act(index);
            scenario_state.note(ScenarioEvent::ActEnded { act: index });
            return Ok(());
        }
        for (event, (trigger, planned)) in self.events.iter_mut().zip(&act.events).enumerate() {
            board.turn.position += 1;
            if board.is_waiting(index, event)
                && fires(trigger, planned.start.as_ref(), board, scenario, scenario_state)? != Some(false)
            {
                execute((index, event), planned, board, scenario, scenario_state)?;
            }
            if scenario_state.verdict.is_some() {
                return Ok(());
            }
        }
        if board.end_act(index) {
            scenario_state.note(ScenarioEvent::ActEnded { act: index });
        }
        Ok(())
    }
}

fn execute(
    (act, event): (usize, usize),
    planned: &Event,
    board: &mut Board,
    scenario: &Scenario,
    scenario_state: &mut ScenarioState,
) -> Result<(), Refusal> {
    scenario_state.note(ScenarioEvent::EventStarted { act, event });
    board.execute(act, event, planned.most_executions);
    for (number, action) in planned.actions.iter().enumerate() {
        scenario_state.perform(scenario, action, ActionSource::Event { act, event, action: number })?;
        if scenario_state.verdict.is_some() {
            break;
        }
    }
    Ok(())
}

/// Whether a trigger fires; none when there is no trigger.
fn fires(
    memory: &mut Option<TriggerMemory>,
    trigger: Option<&Trigger>,
    board: &Board,
    scenario: &Scenario,
    scenario_state: &mut ScenarioState,
) -> Result<Option<bool>, Refusal> {
    let (Some(memory), Some(trigger)) = (memory, trigger) else { return Ok(None) };
    let element = |name: &str, state| board.element_is(scenario, name, state);
    memory.fires(trigger, scenario, scenario_state, element).map(Some)
}

impl Board {
    fn act(&self, act: usize) -> Option<&ActProgress> {
        self.acts.get(act)
    }

    fn is_waiting(&self, act: usize, event: usize) -> bool {
        let event = self.act(act).and_then(|act| act.events.get(event));
        event.is_some_and(|(progress, _)| progress.stand == Stand::Standby)
    }

    fn start_act(&mut self, act: usize) {
        if let Some(act) = self.acts.get_mut(act) {
            act.progress.start(self.turn);
        }
    }

    fn stop_act(&mut self, act: usize) {
        if let Some(act) = self.acts.get_mut(act) {
            act.progress.stop(self.turn);
            act.events.iter_mut().for_each(|(progress, _)| progress.stop(self.turn));
        }
    }

    /// When all its events are done; whether they are.
    fn end_act(&mut self, act: usize) -> bool {
        let Some(act) = self.acts.get_mut(act) else { return false };
        let is_done = act.events.iter().all(|(progress, _)| progress.stand == Stand::Complete);
        if is_done {
            act.progress.end(self.turn, Stand::Complete);
        }
        is_done
    }

    fn execute(&mut self, act: usize, event: usize, most: u32) {
        if let Some((progress, executions)) = self.acts.get_mut(act).and_then(|act| act.events.get_mut(event))
        {
            *executions = executions.saturating_add(1);
            progress.start(self.turn);
            let then = if *executions >= most { Stand::Complete } else { Stand::Standby };
            progress.end(self.turn, then);
        }
    }

    /// An action has the state of its event.
    fn element_is(&self, scenario: &Scenario, name: &str, state: ElementState) -> bool {
        scenario.acts.iter().zip(&self.acts).any(|(act, run)| {
            let events = act.events.iter().zip(&run.events);
            act.name == name && run.progress.is(state, self.turn)
                || events.into_iter().any(|(event, (progress, _))| {
                    (event.name == name || event.action_names.iter().any(|action| action == name))
                        && progress.is(state, self.turn)
                })
        })
    }
}

impl Progress {
    fn start(&mut self, turn: Turn) {
        (self.stand, self.started) = (Stand::Running, Some(turn));
    }

    fn end(&mut self, turn: Turn, then: Stand) {
        (self.stand, self.ended) = (then, Some(turn));
    }

    fn stop(&mut self, turn: Turn) {
        if self.stand != Stand::Complete {
            (self.stand, self.stopped) = (Stand::Complete, Some(turn));
        }
    }

    /// As the element at that position sees it.
    fn is(&self, state: ElementState, turn: Turn) -> bool {
        let just = |mark: Option<Turn>| mark.is_some_and(|mark| mark.is_seen_at(turn));
        match state {
            ElementState::Standby => self.stand == Stand::Standby,
            ElementState::Running => self.stand == Stand::Running || just(self.started),
            ElementState::Complete => self.stand == Stand::Complete,
            ElementState::StartTransition => just(self.started),
            ElementState::EndTransition => just(self.ended),
            ElementState::StopTransition => just(self.stopped),
        }
    }
}

impl Turn {
    /// From then on until that position's next turn but one.
    fn is_seen_at(self, turn: Self) -> bool {
        let same = self.frame == turn.frame && self.position < turn.position;
        let next = self.frame + 1 == turn.frame && self.position >= turn.position;
        same || next
    }
}
