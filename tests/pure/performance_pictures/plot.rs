//! A picture of how figures grow with a size, on logarithmic axes: a panel for each unit, one above the
//! other. Figures that hardly grow have a linear axis, from zero.

use std::fmt::Write as _;

use signal_gateway::report::palette::{self, Paint};

/// Width of the picture, as of all pictures; left and right end of the axes; height of a panel's axes.
const WIDTH: f64 = 880.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 600.0;
const HEIGHT: f64 = 190.0;
/// Above the axes of a panel, and below them.
const ABOVE: f64 = 34.0;
const BELOW: f64 = 56.0;
/// Colours, dashes and marks of lines: no line shows by its colour alone.
const LINES: [(Paint, &str, &str); 6] = [
    (palette::LEFT.text, "", "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z"),
    (palette::RIGHT.text, "6 3", "M-4 -4h8v8h-8z"),
    (palette::HAZARD.text, "2 3", "M0 -5l5 9h-10z"),
    (palette::OK.text, "9 3 2 3", "M0 -5l5 5l-5 5l-5 -5z"),
    (palette::SOFT, "4 2", "M0 5l5 -9h-10z"),
    (palette::ERROR.text, "12 4", "M-5 -2h3v-3h4v3h3v4h-3v3h-4v-3h-3z"),
];

/// Figures of one thing, by size.
pub(super) struct Line {
    pub(super) name: String,
    pub(super) points: Vec<(f64, f64)>,
}

/// Lines with the same unit.
pub(super) struct Panel {
    /// Quantity and unit, such as `time, s`.
    pub(super) quantity: String,
    pub(super) lines: Vec<Line>,
}

/// Greatest ratio of the figures on a linear axis.
const STEADY: f64 = 10.0;

/// An axis over an interval of pixels, from one round value to another around all figures.
struct Axis {
    is_linear: bool,
    /// Both ends; of a logarithmic axis their logarithms.
    ends: (f64, f64),
    pixels: (f64, f64),
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, pixels: (f64, f64)) -> Self {
        let (least, most) = least_and_most(values);
        // A value a hair beyond an end stays where it is.
        let (least, most) = (least * 1.01, most * 0.99);
        let below = round_values(least).filter(|value| *value <= least).fold(0.0, f64::max);
        let above = round_values(most).filter(|value| *value >= most).fold(f64::INFINITY, f64::min);
        Self { is_linear: false, ends: (below.log10(), above.log10()), pixels }
    }

    /// An axis for figures, linear where they hardly grow.
    fn of_figures(values: impl Iterator<Item = f64> + Clone, pixels: (f64, f64)) -> Self {
        let (least, most) = least_and_most(values.clone());
        if most > STEADY * least {
            return Self::new(values, pixels);
        }
        let step = step(most);
        Self { is_linear: true, ends: (0.0, (most / step).ceil() * step), pixels }
    }

    fn at(&self, value: f64) -> f64 {
        let value = if self.is_linear { value } else { value.log10() };
        let share = (value - self.ends.0) / (self.ends.1 - self.ends.0);
        self.pixels.0 + share * (self.pixels.1 - self.pixels.0)
    }

    fn end(&self) -> f64 {
        10_f64.powf(self.ends.1)
    }

    /// 1, 2 and 5 times powers of ten, or the powers alone where there are many.
    fn ticks(&self) -> Vec<f64> {
        let (low, high) = self.ends;
        if self.is_linear {
            let step = step(high);
            let next = |value: &f64| Some(value + step);
            return std::iter::successors(Some(0.0), next)
                .take_while(|value| *value < high * 1.001)
                .collect();
        }
        let (from, to) = (10_f64.powf(low) * 0.999, 10_f64.powf(high) * 1.001);
        let powers = std::iter::successors(Some(low.floor()), |power| Some(power + 1.0))
            .take_while(|power| *power <= high);
        let is_power = |value: f64| (value.log10() - value.log10().round()).abs() < 1e-6;
        let ticks = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * 10_f64.powf(power)));
        ticks.filter(|tick| (from..=to).contains(tick) && (high - low < 2.5 || is_power(*tick))).collect()
    }
}

fn least_and_most(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, 0.0_f64), |(least, most), value| (least.min(value), most.max(value)))
}

/// The step of a linear axis that ends above a value: at most five of them.
fn step(most: f64) -> f64 {
    round_values(most / 5.0).find(|step| *step >= most / 5.0 * 0.999).unwrap()
}

/// 1, 2 and 5 times powers of ten around a value.
fn round_values(value: f64) -> impl Iterator<Item = f64> {
    let power = value.log10().floor();
    [power, power + 1.0].into_iter().flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * 10_f64.powf(power)))
}

/// A number with a comma between thousands.
pub(super) fn number(value: f64) -> String {
    let text = format!("{}", (value * 1e6).round() / 1e6);
    let (whole, rest) =
        text.split_once('.').map_or((text.as_str(), None), |(whole, rest)| (whole, Some(rest)));
    let groups: Vec<_> =
        whole.as_bytes().rchunks(3).rev().map(|group| std::str::from_utf8(group).unwrap()).collect();
    groups.join(",") + &rest.map_or_else(String::new, |rest| format!(".{rest}"))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

/// The picture; `size` is what its lower axis measures.
pub(super) fn picture(title: &str, size: &str, panels: &[Panel]) -> String {
    let mut drawn = Drawing::default();
    drawn.text((16.0, 28.0), 16.0, "start\" font-weight=\"bold", palette::TEXT, title);
    let mut top = 40.0;
    for panel in panels {
        drawn.panel(panel, size, top + ABOVE);
        top += ABOVE + HEIGHT + BELOW;
    }
    let note = if drawn.has_proportion {
        "Both axes are logarithmic. A thin dotted line is what would grow in proportion to the size."
    } else {
        "The axis of sizes is logarithmic."
    };
    drawn.text((LEFT, top + 6.0), 11.0, "start", palette::SOFT, note);
    let height = top + 20.0;
    let mut rules: Vec<_> = drawn
        .paints
        .iter()
        .map(|(property, paint)| format!(".{property}-{} {{ {property}: {}; }}", paint.name, paint.dark))
        .collect();
    rules.push(format!(".fill-card {{ fill: {}; }}", palette::CARD.dark));
    rules.sort();
    rules.dedup();
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
         font-family=\"sans-serif\" role=\"img\">\n<title>{}</title>\n\
         <style>@media (prefers-color-scheme: dark) {{ {} }}</style>\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"{}\" class=\"fill-card\"/>\n{}</svg>\n",
        escaped(title),
        rules.join(" "),
        palette::CARD.light,
        drawn.svg
    )
}

#[derive(Default)]
struct Drawing {
    svg: String,
    has_proportion: bool,
    paints: Vec<(&'static str, Paint)>,
}

impl Drawing {
    fn paint(&mut self, property: &'static str, paint: Paint) -> String {
        self.paints.push((property, paint));
        format!("{property}=\"{}\" class=\"{property}-{}\"", paint.light, paint.name)
    }

    fn text(&mut self, (x, y): (f64, f64), size: f64, anchor: &str, paint: Paint, text: &str) {
        let fill = self.paint("fill", paint);
        let text = escaped(text);
        writeln!(self.svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\" {fill}>{text}</text>").unwrap();
    }

    fn path(&mut self, path: &str, paint: Paint, more: &str) {
        let stroke = self.paint("stroke", paint);
        writeln!(self.svg, "<path d=\"{path}\" fill=\"none\" {stroke} {more}/>").unwrap();
    }

    fn panel(&mut self, panel: &Panel, size: &str, top: f64) {
        let bottom = top + HEIGHT;
        let points = || panel.lines.iter().flat_map(|line| &line.points);
        let across = Axis::new(points().map(|point| point.0), (LEFT, RIGHT));
        let up = Axis::of_figures(points().map(|point| point.1), (bottom, top));
        for tick in across.ticks() {
            let x = across.at(tick);
            self.path(&format!("M{x:.1} {top:.1}V{bottom:.1}"), palette::LINE, "");
            self.text((x, bottom + 16.0), 11.0, "middle", palette::SOFT, &number(tick));
        }
        for tick in up.ticks() {
            let y = up.at(tick);
            self.path(&format!("M{LEFT} {y:.1}H{RIGHT}"), palette::LINE, "");
            self.text((LEFT - 6.0, y + 4.0), 11.0, "end", palette::SOFT, &number(tick));
        }
        self.path(&format!("M{LEFT} {top}V{bottom}H{RIGHT}"), palette::SOFT, "");
        self.text((LEFT, top - 10.0), 12.0, "start", palette::TEXT, &panel.quantity);
        self.text((f64::midpoint(LEFT, RIGHT), bottom + 34.0), 12.0, "middle", palette::TEXT, size);
        for (index, (line, (paint, dashes, mark))) in panel.lines.iter().zip(LINES).enumerate() {
            let place = |point: &(f64, f64)| (across.at(point.0), up.at(point.1));
            let path: Vec<_> = line.points.iter().map(place).map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
            let dashed = format!("stroke-width=\"1.5\" stroke-dasharray=\"{dashes}\"");
            self.path(&format!("M{}", path.join("L")), paint, &dashed);
            let (first, last) = (line.points[0], line.points[line.points.len() - 1]);
            if !up.is_linear {
                // In proportion to the size, as far as the panel reaches.
                let end = (last.0 / first.0).min(up.end() / first.1);
                let (from, to) = (place(&first), place(&(first.0 * end, first.1 * end)));
                let path = format!("M{:.1} {:.1}L{:.1} {:.1}", from.0, from.1, to.0, to.1);
                self.path(&path, paint, "stroke-width=\"0.8\" stroke-dasharray=\"1 3\"");
                self.has_proportion = true;
            }
            let legend = (RIGHT + 40.0, top + 10.0 + 20.0 * f64::from(u32::try_from(index).unwrap()));
            self.path(&format!("M{:.1} {:.1}h40", legend.0 - 20.0, legend.1), paint, &dashed);
            for (x, y) in line.points.iter().map(place).chain([legend]) {
                let fill = self.paint("fill", paint);
                writeln!(self.svg, "<path d=\"{mark}\" transform=\"translate({x:.1} {y:.1})\" {fill}/>")
                    .unwrap();
            }
            self.text((legend.0 + 28.0, legend.1 + 4.0), 12.0, "start", palette::TEXT, &line.name);
        }
    }
}
