//! Pictures for reports: data in, SVG text out, the same bytes each time. No outside fonts, no scripts.
//!
//! | file | what it is |
//! |---|---|
//! | [`timeline_chart`] | lanes of bars over time: the data, and how they are laid out |
//! | [`strip_chart`] | a path as a strip: sections and signals over metres |
//! | `bar` | one bar: a lamp state or a name |
//! | `mark` | vertical marks with their texts above the lanes |
//! | `legend` | what the looks in the picture mean |
//! | `axis` | values to pixels, ticks where people expect them |
//! | `ink` | colours that stay apart for colour-blind eyes |
//! | `text` | how wide a text is, and what fits |
//! | `svg` | elements, attributes, escaping |

mod axis;
mod bar;
mod ink;
mod legend;
mod mark;
pub mod strip_chart;
mod svg;
mod text;
pub mod timeline_chart;
