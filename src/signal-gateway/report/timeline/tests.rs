//! Lanes, folding, and hostile texts.

use super::*;

fn lane(states: usize, seconds_each: f64) -> Lane {
    let mut lane = Lane::new(Group::Raw, "x");
    for number in 0..states {
        #[allow(clippy::cast_precision_loss)]
        lane.begin(number as f64 * seconds_each, Tone::Plain, &number.to_string(), Some(number));
    }
    lane
}

fn timeline(lane: Lane, frames: Vec<CausingFrame>) -> Timeline {
    let (title, subtitle) = ("drive.log".to_owned(), "car".to_owned());
    Timeline {
        title,
        subtitle,
        length_s: 10.0,
        curves: Vec::new(),
        lanes: vec![lane],
        frames,
        remarks: Vec::new(),
    }
}

fn frame(message: &str) -> CausingFrame {
    let text = |text: &str| text.to_owned();
    CausingFrame {
        at_s: 1.0,
        stamp: text("1.000000"),
        interface: text("can0"),
        id: text("123"),
        message: text(message),
        bytes: text("01 02"),
        signals: vec![text(message)],
    }
}

#[test]
fn state_lasts_until_the_next_one_and_a_repeated_one_goes_on() {
    let mut lane = Lane::new(Group::Reports, "turn_indicators");
    for (at_s, text) in [(0.0, "a"), (1.0, "a"), (2.0, "b"), (3.0, "b")] {
        lane.begin(at_s, Tone::Plain, text, None);
    }
    lane.finish(5.0);
    let spans: Vec<_> = lane.spans.iter().map(|span| (span.from_s, span.to_s, span.text.as_str())).collect();
    assert_eq!(spans, [(0.0, 2.0, "a"), (2.0, 5.0, "b")]);
}

#[test]
fn lane_of_a_long_recording_is_bounded_and_counts_every_state() {
    for states in [MAX_SPANS, MAX_SPANS + 1, 50_000] {
        let mut lane = lane(states, 0.01);
        lane.finish(600.0);
        let counted: u64 = lane.spans.iter().map(|span| span.states).sum();
        assert_eq!(counted, states as u64, "every state is in a span");
        assert!(lane.spans.len() <= 2 * MAX_SPANS, "{states}: {}", lane.spans.len());
        let separate = lane.spans.iter().filter(|span| span.states == 1).count() as u64;
        assert_eq!(lane.folded + separate, states as u64);
        assert_eq!(lane.folded > 0, states > MAX_SPANS);
        assert!(lane.spans.windows(2).all(|pair| (pair[0].to_s - pair[1].from_s).abs() < 1e-9));
    }
}

#[test]
fn long_states_between_many_short_ones_are_kept() {
    let mut lane = lane(20_000, 0.001);
    lane.begin(100.0, Tone::Error, "long", None);
    lane.begin(200.0, Tone::Ok, "after", None);
    lane.finish(300.0);
    let long = lane.spans.iter().find(|span| span.text == "long").unwrap();
    assert_eq!((long.from_s, long.to_s, long.states), (100.0, 200.0, 1));
}

#[test]
fn only_frames_that_a_state_refers_to_are_kept() {
    let mut lane = Lane::new(Group::Raw, "x");
    lane.begin(1.0, Tone::Plain, "a", Some(1));
    lane.finish(2.0);
    let mut timeline = timeline(lane, ["A", "B", "C"].map(frame).to_vec());
    timeline.close();
    assert_eq!(timeline.frames, [frame("B")]);
    assert_eq!(timeline.lanes[0].spans[0].frame, Some(0));
    assert!(timeline.remarks.is_empty());
}

/// Texts that would break out of an element, an attribute, a script, or a placeholder of the template.
const HOSTILE: &str =
    "</script><script>alert(1)</script><!-- \"'&{{script}}{{data}} <img src=x onerror=alert(1)> \u{2028}";

#[test]
fn hostile_names_stay_texts_in_page_and_picture() {
    let mut lane = Lane::new(Group::Raw, HOSTILE);
    lane.begin(0.0, Tone::Plain, HOSTILE, Some(0));
    lane.finish(10.0);
    let mut timeline = timeline(lane, vec![frame(HOSTILE)]);
    HOSTILE.clone_into(&mut timeline.title);
    HOSTILE.clone_into(&mut timeline.subtitle);
    timeline.remarks.push(HOSTILE.to_owned());
    let page = timeline.to_html(None);
    assert_eq!(page.matches("<script").count(), 2, "the data, and the program");
    assert_eq!(page.matches("</script").count(), 2);
    assert!(!page.contains("<img") && !page.contains("<!--"));
    let (_, data) = page.split_once("id=\"data\">").unwrap();
    let (data, _) = data.split_once("</script>").unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["title"], HOSTILE);
    assert_eq!(data["lanes"][0]["spans"][0][3], HOSTILE);
    assert_eq!(data["frames"][0]["signals"][0], HOSTILE);
    let picture = timeline.chart().to_svg();
    assert!(roxmltree::Document::parse(&picture).is_ok());
    assert!(!picture.contains("<script") && !picture.contains("<img"));
}

#[test]
fn page_loads_nothing_and_forbids_it() {
    let page = timeline(lane(3, 1.0), vec![frame("A"), frame("B"), frame("C")]).to_html(None);
    assert!(page.contains("default-src 'none'"));
    for outside in
        ["http:", "https:", "src=", "href=", "url(", "@import", "fetch(", "XMLHttp", "innerHTML", "eval("]
    {
        assert!(!page.contains(outside), "{outside}");
    }
}
