//! The storyboard: stories, acts and events with their triggers and states.
//!
//! Elements are evaluated in the order of the document. All actions complete at once, so an event starts,
//! runs and ends within one frame. For other elements, that frame lasts from this point to their own next
//! evaluation, so that positions in the document do not matter.

use super::event_log::{ActionSource, ScenarioEvent, ScenarioOutcome};
use super::refusal::ActionRefusal;
use super::scenario::{Act, ElementState, Event, Scenario, Trigger};
use super::scenario_state::ScenarioState;
use super::trigger::TriggerState;

#[derive(Debug, Clone)]
pub(super) struct Storyboard {
    acts: Vec<ActTriggers>,
    stop: Option<TriggerState>,
    board: ElementBoard,
}

#[derive(Debug, Clone)]
struct ActTriggers {
    start: Option<TriggerState>,
    stop: Option<TriggerState>,
    events: Vec<Option<TriggerState>>,
}

#[derive(Debug, Clone)]
struct ElementBoard {
    stories: Vec<ElementProgress>,
    acts: Vec<ActProgress>,
    now: Evaluation,
}

#[derive(Debug, Clone)]
struct ActProgress {
    progress: ElementProgress,
    /// The progress of each event, with the number of its executions.
    events: Vec<(ElementProgress, u32)>,
    groups: Vec<ElementProgress>,
}

/// The evaluation of one element in one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
struct Evaluation {
    frame: u64,
    position: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum RunState {
    #[default]
    Standby,
    Running,
    Complete,
}

/// The state of an element, with the evaluations of its last transitions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct ElementProgress {
    state: RunState,
    started: Option<Evaluation>,
    ended: Option<Evaluation>,
    stopped: Option<Evaluation>,
}

impl Storyboard {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let state = |trigger: &Option<Trigger>| trigger.as_ref().map(TriggerState::new);
        let triggers = |act: &Act| ActTriggers {
            start: state(&act.start),
            stop: state(&act.stop),
            events: act.events.iter().map(|event| state(&event.start)).collect(),
        };
        let standby = |act: &Act| ActProgress {
            progress: ElementProgress::default(),
            events: vec![(ElementProgress::default(), 0); act.events.len()],
            groups: vec![ElementProgress::default(); act.groups.len()],
        };
        Self {
            acts: scenario.acts.iter().map(triggers).collect(),
            stop: state(&scenario.stop),
            board: ElementBoard {
                stories: vec![ElementProgress::default(); scenario.stories.len()],
                acts: scenario.acts.iter().map(standby).collect(),
                now: Evaluation::default(),
            },
        }
    }

    pub(super) fn step(
        &mut self,
        scenario: &Scenario,
        scenario_state: &mut ScenarioState,
    ) -> Result<(), ActionRefusal> {
        self.board.now = Evaluation { frame: self.board.now.frame + 1, position: 0 };
        self.board.start_stories();
        for (index, (triggers, act)) in self.acts.iter_mut().zip(&scenario.acts).enumerate() {
            self.board.now.position += 1;
            let first = self.board.now.position;
            triggers.step((index, act), &mut self.board, scenario, scenario_state)?;
            if scenario_state.verdict.is_some() {
                return Ok(());
            }
            // An event has the same position in each frame, whether or not it was evaluated.
            self.board.now.position = first + triggers.events.len();
            self.board.end_stories(scenario);
        }
        self.board.now.position += 1;
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
        (index, act): (usize, &Act),
        board: &mut ElementBoard,
        scenario: &Scenario,
        scenario_state: &mut ScenarioState,
    ) -> Result<(), ActionRefusal> {
        match board.acts[index].progress.state {
            RunState::Complete => return Ok(()),
            RunState::Running => {}
            RunState::Standby => {
                if fires(&mut self.start, act.start.as_ref(), board, scenario, scenario_state)? == Some(false)
                {
                    return Ok(());
                }
                board.acts[index].start(board.now);
                scenario_state.log(ScenarioEvent::ActStarted(index));
            }
        }
        if fires(&mut self.stop, act.stop.as_ref(), board, scenario, scenario_state)? == Some(true) {
            board.acts[index].stop(board.now);
            scenario_state.log(ScenarioEvent::ActEnded(index));
            return Ok(());
        }
        for (event, (trigger, planned)) in self.events.iter_mut().zip(&act.events).enumerate() {
            board.now.position += 1;
            while board.acts[index].events[event].0.state == RunState::Standby
                && fires(trigger, planned.start.as_ref(), board, scenario, scenario_state)? != Some(false)
            {
                execute(index, event, planned, board, scenario, scenario_state)?;
                if scenario_state.verdict.is_some() {
                    return Ok(());
                }
                if !scenario_state.quirks.repeats_events_at_once {
                    break;
                }
            }
        }
        board.acts[index].end_groups(act, board.now);
        let ActProgress { progress, events, .. } = &mut board.acts[index];
        if events.iter().all(|(progress, _)| progress.state == RunState::Complete) {
            progress.end(board.now, RunState::Complete);
            scenario_state.log(ScenarioEvent::ActEnded(index));
        }
        Ok(())
    }
}

fn execute(
    act: usize,
    event: usize,
    planned: &Event,
    board: &mut ElementBoard,
    scenario: &Scenario,
    scenario_state: &mut ScenarioState,
) -> Result<(), ActionRefusal> {
    scenario_state.log(ScenarioEvent::EventStarted { act, event });
    let (progress, executions) = &mut board.acts[act].events[event];
    *executions = executions.saturating_add(1);
    progress.start(board.now);
    let is_last = *executions >= planned.max_executions;
    progress.end(board.now, if is_last { RunState::Complete } else { RunState::Standby });
    for (number, action) in planned.actions.iter().enumerate() {
        scenario_state.perform(scenario, action, ActionSource::Event { act, event, action: number })?;
        if scenario_state.verdict.is_some() {
            break;
        }
    }
    Ok(())
}

/// Evaluates a trigger; `None` if there is no trigger.
fn fires(
    state: &mut Option<TriggerState>,
    trigger: Option<&Trigger>,
    board: &ElementBoard,
    scenario: &Scenario,
    scenario_state: &mut ScenarioState,
) -> Result<Option<bool>, ActionRefusal> {
    let (Some(state), Some(trigger)) = (state, trigger) else { return Ok(None) };
    let remembers = scenario_state.quirks.remembers_element_states;
    let element = |name: &str, state| board.element_is(scenario, name, state, remembers);
    state.fires(trigger, scenario, scenario_state, element).map(Some)
}

impl ElementBoard {
    /// Returns whether the named element is in a state, or, with `remembers`, ever was. An action has the
    /// state of its event.
    fn element_is(&self, scenario: &Scenario, name: &str, state: ElementState, remembers: bool) -> bool {
        let is = |progress: &ElementProgress| {
            if remembers { progress.has_been(state) } else { progress.is(state, self.now) }
        };
        let mut stories = scenario.stories.iter().zip(&self.stories);
        stories.any(|(story, progress)| story.name == name && is(progress))
            || scenario.acts.iter().zip(&self.acts).any(|(act, run)| {
                let events = act.events.iter().zip(&run.events);
                let mut groups = act.groups.iter().zip(&run.groups);
                act.name == name && is(&run.progress)
                    || groups.any(|(group, progress)| group.name == name && is(progress))
                    || events.into_iter().any(|(event, (progress, _))| {
                        (event.name == name || event.action_names.iter().any(|action| action == name))
                            && is(progress)
                    })
            })
    }

    fn start_stories(&mut self) {
        for story in self.stories.iter_mut().filter(|story| story.state == RunState::Standby) {
            story.start(self.now);
        }
    }

    /// Ends the stories whose acts are all complete.
    fn end_stories(&mut self, scenario: &Scenario) {
        for (progress, story) in self.stories.iter_mut().zip(&scenario.stories) {
            let mut acts = self.acts.get(story.acts.clone()).unwrap_or_default().iter();
            if progress.state == RunState::Running && acts.all(|act| act.progress.state == RunState::Complete)
            {
                progress.end(self.now, RunState::Complete);
            }
        }
    }
}

impl ActProgress {
    fn start(&mut self, now: Evaluation) {
        self.progress.start(now);
        self.groups.iter_mut().for_each(|group| group.start(now));
    }

    /// Ends the groups whose events are all complete.
    fn end_groups(&mut self, act: &Act, now: Evaluation) {
        for (progress, group) in self.groups.iter_mut().zip(&act.groups) {
            let mut events = self.events.get(group.events.clone()).unwrap_or_default().iter();
            if progress.state == RunState::Running
                && events.all(|(event, _)| event.state == RunState::Complete)
            {
                progress.end(now, RunState::Complete);
            }
        }
    }

    fn stop(&mut self, now: Evaluation) {
        let events = self.events.iter_mut().map(|(progress, _)| progress);
        for progress in events.chain(&mut self.groups).chain([&mut self.progress]) {
            if progress.state != RunState::Complete {
                (progress.state, progress.stopped) = (RunState::Complete, Some(now));
            }
        }
    }
}

impl ElementProgress {
    fn start(&mut self, now: Evaluation) {
        (self.state, self.started) = (RunState::Running, Some(now));
    }

    fn end(&mut self, now: Evaluation, then: RunState) {
        (self.state, self.ended) = (then, Some(now));
    }

    /// Returns whether the element is in a state, as seen by the element under evaluation.
    fn is(&self, state: ElementState, now: Evaluation) -> bool {
        let just = |transition: Option<Evaluation>| transition.is_some_and(|at| at.is_recent(now));
        match state {
            ElementState::Standby => self.state == RunState::Standby,
            ElementState::Running => self.state == RunState::Running || just(self.started),
            ElementState::Complete => self.state == RunState::Complete,
            ElementState::StartTransition => just(self.started),
            ElementState::EndTransition => just(self.ended),
            ElementState::StopTransition => just(self.stopped),
            ElementState::SkipTransition => false,
        }
    }

    /// Returns whether the element was ever in a state.
    fn has_been(&self, state: ElementState) -> bool {
        match state {
            ElementState::Standby => true,
            ElementState::Running | ElementState::StartTransition => self.started.is_some(),
            ElementState::Complete => self.state == RunState::Complete,
            ElementState::EndTransition => self.ended.is_some(),
            ElementState::StopTransition => self.stopped.is_some(),
            ElementState::SkipTransition => false,
        }
    }
}

impl Evaluation {
    /// Returns whether the element at the position of `now` has not been evaluated between this and `now`.
    fn is_recent(self, now: Self) -> bool {
        let same = self.frame == now.frame && self.position < now.position;
        let next = self.frame + 1 == now.frame && self.position >= now.position;
        same || next
    }
}
