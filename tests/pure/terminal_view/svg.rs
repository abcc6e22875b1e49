//! A terminal as a picture: what is in its cells, with their colours.

use std::fmt::Write as _;

use ratatui::buffer::{Buffer, Cell};
use ratatui::style::{Color, Modifier};
use signal_gateway::report::palette::{self, MEANINGS};

/// Size of a cell, pixels.
const CELL: (f64, f64) = (8.4, 18.0);
const PAPER: &str = palette::PAGE.dark;
const INK: &str = palette::TEXT.dark;

/// Draws all cells, those in a row with the same style as one text.
pub(super) fn picture(buffer: &Buffer) -> String {
    let (columns, rows) = (buffer.area.width, buffer.area.height);
    let [width, height] = [f64::from(columns) * CELL.0 + 16.0, f64::from(rows) * CELL.1 + 16.0];
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
         viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"DejaVu Sans Mono, Menlo, Consolas, monospace\" font-size=\"14\">\n\
         <title>The live view of signal-gateway on a terminal</title>\n\
         <rect width=\"100%\" height=\"100%\" rx=\"8\" fill=\"{PAPER}\"/>\n"
    );
    for (row, cells) in (0_u16..).zip(buffer.content.chunks(columns.into())) {
        let mut column = 0;
        for run in cells.chunk_by(|one, other| style(one) == style(other)) {
            draw_run(&mut svg, run, f64::from(column) * CELL.0 + 8.0, f64::from(row) * CELL.1 + 8.0);
            column += u16::try_from(run.len()).unwrap();
        }
    }
    svg + "</svg>\n"
}

fn style(cell: &Cell) -> (Color, Modifier) {
    (cell.fg, cell.modifier)
}

fn draw_run(svg: &mut String, run: &[Cell], left: f64, top: f64) {
    let (color, modifier) = style(&run[0]);
    let text: String = run.iter().map(Cell::symbol).collect();
    let width = run.iter().fold(0.0, |width, _| width + CELL.0);
    let is_reversed = modifier.contains(Modifier::REVERSED);
    if is_reversed {
        let paper = hex(color);
        writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{}\" fill=\"{paper}\"/>",
            CELL.1
        )
        .unwrap();
    }
    if text.trim().is_empty() {
        return;
    }
    let ink = if is_reversed { PAPER } else { hex(color) };
    let weight = if modifier.contains(Modifier::BOLD) { " font-weight=\"bold\"" } else { "" };
    let dim = if modifier.contains(Modifier::DIM) { " opacity=\"0.6\"" } else { "" };
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    writeln!(
        svg,
        "<text x=\"{left:.1}\" y=\"{:.1}\" textLength=\"{width:.1}\" xml:space=\"preserve\" fill=\"{ink}\"{weight}{dim}>{text}</text>",
        top + 14.0
    )
    .unwrap();
}

#[allow(clippy::wildcard_enum_match_arm)] // the view has no other colours
fn hex(color: Color) -> &'static str {
    match color {
        Color::Green => palette::OK.text.dark,
        Color::Yellow => palette::WARN.text.dark,
        Color::Red => palette::ERROR.text.dark,
        Color::Cyan => palette::FOCUS.dark,
        Color::Indexed(palette::AMBER_TERMINAL) => palette::AMBER.dark,
        Color::Indexed(number) => {
            MEANINGS.iter().find(|meaning| meaning.terminal == number).unwrap().text.dark
        }
        Color::Reset => INK,
        other => panic!("{other:?} has no colour in the picture"),
    }
}
