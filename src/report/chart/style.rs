//! The measures of charts.

use super::axis::Along;

/// What differs between charts over time and over metres, in pixels unless said otherwise.
pub(super) struct Style {
    pub(super) lane_class: &'static str,
    pub(super) bar_class: &'static str,
    /// Width of a lane's name, as a factor of the regular font's.
    pub(super) label_factor: f64,
    pub(super) label_gap: f64,
    pub(super) subtitle: f64,
    pub(super) header_gap: f64,
    pub(super) row: f64,
    pub(super) row_gap: f64,
    /// From the middle of a line of text down to its base line, as a factor of its size.
    pub(super) base_line: f64,
    /// Numbers stand on top of the bars, which are framed.
    pub(super) is_framed: bool,
    pub(super) caption_gap: f64,
    pub(super) legend_gap: f64,
    pub(super) sample: (f64, f64),
    pub(super) legend_line: f64,
    pub(super) right_gap: f64,
}

const TIME: Style = Style {
    lane_class: "lane",
    bar_class: "bar",
    label_factor: 1.0,
    label_gap: 14.0,
    subtitle: 9.0,
    header_gap: 6.0,
    row: 18.0,
    row_gap: 3.0,
    base_line: 0.36,
    is_framed: true,
    caption_gap: 32.0,
    legend_gap: 16.0,
    sample: (26.0, 16.0),
    legend_line: 22.0,
    right_gap: 0.0,
};

const DISTANCE: Style = Style {
    lane_class: "group",
    bar_class: "piece",
    label_factor: 1.1,
    label_gap: 12.0,
    subtitle: 8.0,
    header_gap: 0.0,
    row: 20.0,
    row_gap: 4.0,
    base_line: 4.0 / 11.0,
    is_framed: false,
    caption_gap: 20.0,
    legend_gap: 12.0,
    sample: (30.0, 20.0),
    legend_line: 24.0,
    right_gap: 20.0,
};

impl Along {
    pub(super) const fn style(self) -> &'static Style {
        match self {
            Self::Time => &TIME,
            Self::Distance => &DISTANCE,
        }
    }
}
