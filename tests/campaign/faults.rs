//! What can happen to a recording between the control units and the gateway.

#![allow(clippy::ptr_arg)] // one signature for all

use super::dice::Dice;
use super::recording::{BUS, Content, Line, OTHER_BUS, UNKNOWN_ID, period_us};
use super::vehicle::{Message, Vehicle};

type Apply = fn(&mut Vec<Line>, &Vehicle, &mut Dice);

/// The faults by name, in the order in which they befall a recording: those that move the stamps of what
/// follows come last.
pub(crate) const FAULTS: [(&str, Apply); 19] = [
    ("frames lost", lose),
    ("frames repeated", repeat),
    ("frames in another order", reorder),
    ("frames delayed", delay),
    ("bits flipped", flip),
    ("bits flipped under a right checksum", flip_sealed),
    ("wrong length", resize),
    ("wrong counter", jump_counter),
    ("wrong checksum", break_checksum),
    ("stuck sender", freeze),
    ("classic and FD confused", confuse_fd),
    ("11 and 29 bits confused, remote frames", confuse_id),
    ("error frames, bus-off", report_errors),
    ("link lost", lose_link),
    ("on the wrong bus", change_bus),
    ("lines damaged", damage),
    ("bursts", burst),
    ("silence around a timeout", fall_silent),
    ("stamps jump", jump_stamps),
];

/// A stretch of the recording, a tenth of it at most.
fn stretch(lines: &[Line], dice: &mut Dice) -> std::ops::Range<usize> {
    let from = dice.index(0..lines.len());
    let most = lines.len() / 10 + 2;
    from..(from + dice.index(1..most)).min(lines.len())
}

/// Changes some of the frames of a stretch, those of the vehicle's messages.
fn each_frame(
    lines: &mut [Line],
    vehicle: &Vehicle,
    dice: &mut Dice,
    mut change: impl FnMut(&Message, &mut Vec<u8>, &mut Dice),
) {
    let share = *dice.pick(&[20, 50, 100]);
    let within = stretch(lines, dice);
    for line in &mut lines[within] {
        if let Content::Data { id, data, .. } = &mut line.content
            && let Some(message) = vehicle.messages.iter().find(|message| message.id == *id)
            && data.len() == message.length
            && dice.percent(share)
        {
            change(message, data, dice);
        }
    }
}

fn lose(lines: &mut Vec<Line>, _: &Vehicle, dice: &mut Dice) {
    let share = *dice.pick(&[10, 50, 100]);
    let within = stretch(lines, dice);
    let mut position = 0;
    lines.retain(|_| {
        position += 1;
        !within.contains(&(position - 1)) || !dice.percent(share)
    });
}

fn repeat(lines: &mut Vec<Line>, _: &Vehicle, dice: &mut Dice) {
    for _ in 0..dice.index(1..6) {
        let at = dice.index(0..lines.len());
        let copies = dice.index(1..4);
        lines.splice(at..at, vec![lines[at].clone(); copies]);
    }
}

fn reorder(lines: &mut Vec<Line>, _: &Vehicle, dice: &mut Dice) {
    for _ in 0..dice.index(1..6) {
        let (one, other) = (dice.index(0..lines.len()), dice.index(1..8));
        let other = (one + other).min(lines.len() - 1);
        let content = lines[one].content.clone();
        lines[one].content = std::mem::replace(&mut lines[other].content, content);
    }
}

fn delay(lines: &mut Vec<Line>, vehicle: &Vehicle, dice: &mut Dice) {
    for line in stretch(lines, dice) {
        let by = period_us(vehicle, dice.pick(&vehicle.messages)) * 8;
        lines[line].stamp_us += dice.within(0..by).cast_signed();
    }
    lines.sort_by_key(|line| line.stamp_us);
}

fn flip(lines: &mut Vec<Line>, vehicle: &Vehicle, dice: &mut Dice) {
    each_frame(lines, vehicle, dice, |_, data, dice| {
        for _ in 0..dice.index(1..4) {
            let byte = dice.index(0..data.len());
            data[byte] ^= 1 << dice.within(0..8);
        }
    });
}

fn flip_sealed(lines: &mut Vec<Line>, vehicle: &Vehicle, dice: &mut Dice) {
    each_frame(lines, vehicle, dice, |message, data, dice| {
        let byte = dice.index(0..data.len());
        data[byte] ^= 1 << dice.within(0..8);
        message.seal(data);
    });
}

fn resize(lines: &mut Vec<Line>, vehicle: &Vehicle, dice: &mut Dice) {
    each_frame(lines, vehicle, dice, |message, data, dice| {
        data.resize(dice.index(0..9), 0);
        if dice.percent(50) {
            message.seal(data);
        }
    });
}

fn jump_counter(lines: &mut Vec<Line>, vehicle: &Vehicle, dice: &mut Dice) {
    let by = dice.within(1..16).cast_signed();
    each_frame(lines, vehicle, dice, |message, data, _| {
        if let Some((field, _)) = &message.counter {
            let counter = field.get(data);
            field.set(data, counter + by);
            message.seal(data);
        }
    });
}

fn break_checksum(lines: &mut Vec<Line>, vehicle: &Vehicle, dice: &mut Dice) {
    each_frame(lines, vehicle, dice, |message, data, dice| {
        if let Some((_, field)) = &message.checksum {
            let sum = field.get(data);
            field.set(data, sum ^ dice.within(1..1 << field.width()).cast_signed());
        }
    });
}

/// From some point on a message's frames are all alike, up to another point.
fn freeze(lines: &mut Vec<Line>, vehicle: &Vehicle, dice: &mut Dice) {
    let stuck = dice.pick(&vehicle.messages);
    let mut same: Option<Vec<u8>> = None;
    for line in stretch(lines, dice) {
        if let Content::Data { id, data, .. } = &mut lines[line].content
            && *id == stuck.id
        {
            *data = same.get_or_insert_with(|| data.clone()).clone();
        }
    }
}

fn confuse_fd(lines: &mut Vec<Line>, _: &Vehicle, dice: &mut Dice) {
    let share = *dice.pick(&[20, 100]);
    for line in stretch(lines, dice) {
        if let Content::Data { fd, data, .. } = &mut lines[line].content
            && dice.percent(share)
        {
            *fd = true;
            if dice.percent(30) {
                data.resize(*dice.pick(&[12, 16, 64]), 0);
            }
        }
    }
}

fn confuse_id(lines: &mut Vec<Line>, _: &Vehicle, dice: &mut Dice) {
    for line in stretch(lines, dice) {
        if let Content::Data { id, extended, .. } = &mut lines[line].content {
            let (id, extended) = (*id, !*extended);
            if dice.percent(30) {
                lines[line].content = Content::Remote { id, extended: !extended };
            } else if let Content::Data { extended: of_frame, .. } = &mut lines[line].content
                && (extended || id < 0x800)
            {
                *of_frame = extended;
            }
        }
    }
}

fn report_errors(lines: &mut Vec<Line>, _: &Vehicle, dice: &mut Dice) {
    for _ in 0..dice.index(1..30) {
        let at = dice.index(0..lines.len());
        let (class, controller) =
            *dice.pick(&[(0x04, 0x08), (0x04, 0x20), (0x40, 0), (0x100, 0), (0x88, 0), (0x02, 0)]);
        let error = Content::Error { class, controller };
        let note = *dice.pick(&[
            "controller bus-off",
            "controller error-passive",
            "controller error-active tx 0 rx 0",
            "drops 12",
        ]);
        let content = if dice.percent(70) { error } else { Content::Note(note) };
        lines.insert(at, Line { content, ..lines[at].clone() });
    }
}

fn lose_link(lines: &mut Vec<Line>, _: &Vehicle, dice: &mut Dice) {
    let down = *dice.pick(&["link down", "link missing", "link failed 19"]);
    let lost = stretch(lines, dice);
    let back =
        Line { content: Content::Note("link up"), interface: BUS, stamp_us: lines[lost.end - 1].stamp_us };
    let gone = Line { content: Content::Note(down), interface: BUS, stamp_us: lines[lost.start].stamp_us };
    if dice.percent(80) {
        lines.insert(lost.end, back);
    }
    lines.insert(lost.start, gone);
}

fn change_bus(lines: &mut Vec<Line>, _: &Vehicle, dice: &mut Dice) {
    stretch(lines, dice).for_each(|line| lines[line].interface = OTHER_BUS);
}

fn damage(lines: &mut Vec<Line>, _: &Vehicle, dice: &mut Dice) {
    for line in stretch(lines, dice) {
        if dice.percent(30) {
            lines[line].content = Content::Garbage;
        }
    }
}

/// Many frames in no time: of nobody, or the same one again and again.
fn burst(lines: &mut Vec<Line>, _: &Vehicle, dice: &mut Dice) {
    let at = dice.index(0..lines.len());
    let (count, same) = (dice.index(20..200), dice.percent(50));
    let (first, gap) = (lines[at].clone(), dice.within(0..300).cast_signed());
    let copy = |step: i64| {
        let stamp_us = first.stamp_us + step * gap;
        if same { Line { stamp_us, ..first.clone() } } else { Line::unknown(stamp_us) }
    };
    lines.extend((0..count).map(|step| copy(i64::try_from(step).unwrap())));
    lines.sort_by_key(|line| line.stamp_us);
}

/// A message is not sent for as long as its timeout, give or take a millisecond or a microsecond.
fn fall_silent(lines: &mut Vec<Line>, vehicle: &Vehicle, dice: &mut Dice) {
    let silent = dice.pick(&vehicle.messages);
    let is_its = |line: &Line| matches!(line.content, Content::Data { id, .. } if id == silent.id);
    let Some(from) = (dice.index(0..lines.len())..lines.len()).find(|line| is_its(&lines[*line])) else {
        return;
    };
    let limit = silent.timeout_ns.unwrap_or(vehicle.alive_ns) / 1000;
    let silence = limit.cast_signed() + dice.pick(&[-1000, -1, 0, 1, 1000]);
    let end = lines[from].stamp_us + silence;
    // Sometimes the whole bus is silent, else just the message.
    let all = dice.percent(40);
    let mut position = 0;
    lines.retain(|line| {
        position += 1;
        let is_silenced = position > from + 1 && line.stamp_us < end && (all || is_its(line));
        !is_silenced || matches!(line.content, Content::Data { id: UNKNOWN_ID, .. })
    });
    if let Some(next) = (from + 1..lines.len()).find(|line| is_its(&lines[*line])) {
        lines[next].stamp_us = end;
        lines.sort_by_key(|line| line.stamp_us);
    }
}

/// The clock of the recorder is set, or single lines come late. Nothing is sorted afterwards.
fn jump_stamps(lines: &mut Vec<Line>, _: &Vehicle, dice: &mut Dice) {
    let jump = stretch(lines, dice);
    let late = dice.percent(40);
    let by = if late {
        -dice.within(1..1_000_000).cast_signed()
    } else {
        *dice.pick(&[
            -999_999,
            -1_000_000,
            -1_000_001,
            -60_000_000,
            200_000,
            5_000_000,
            3_600_000_001,
            90_000_000_000,
        ])
    };
    let to = if late { jump.end } else { lines.len() };
    lines[jump.start..to].iter_mut().for_each(|line| line.stamp_us += by);
}
