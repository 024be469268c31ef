//! One self-contained HTML page about an evaluated garment.
//!
//! A [`Report`] is plain data: text, encoded [`Picture`]s, [`Series`] of numbers, [`Table`]s.
//! [`Report::html`] lays it out as one page that opens from a disk without a network: pictures are
//! data URIs, charts are inline SVG, the style and the few lines of script are in the page, and a
//! content security policy in its head forbids everything else. All text is escaped. The page is
//! light or dark as the reader's system is, fits a phone, and shows strips of pictures where
//! scripts do not run.
//!
//! ```
//! use unic_report::{Chart, Column, Order, Report, Row, Series, Table, Value};
//!
//! let drift = Chart {
//!     title: "RMSE over time".into(),
//!     x: "time, s".into(),
//!     y: "RMSE, mm".into(),
//!     series: vec![Series { name: "model".into(), points: vec![(0.5, 12.0), (1.0, 14.5)] }],
//! };
//! let scores = Table {
//!     title: "All clips".into(),
//!     columns: vec![Column { name: "RMSE".into(), unit: "mm".into(), digits: 1, order: Order::LessIsBetter }],
//!     rows: vec![Row { name: "model".into(), values: vec![Value::Number(13.3)] }],
//! };
//! let report = Report {
//!     title: "T-shirt".into(),
//!     lead: "The model is 13.3 mm away from the simulation.".into(),
//!     drift: Some(drift),
//!     tables: vec![scores],
//!     ..Report::default()
//! };
//! let page = report.html();
//! assert!(page.starts_with("<!DOCTYPE html>") && page.contains("13.3"));
//! ```
//!
//! What it does not do: measure, draw garments or encode pictures. Names and numbers may be
//! anything: what is not finite is a gap in a chart and a word in a table.

#![forbid(unsafe_code)]

mod axis;
mod chart;
mod heat;
mod movie;
mod page;
mod picture;
mod report;
mod table;

pub use chart::{Chart, Series};
pub use heat::{ColourBar, HeatMap, HeatStrip};
pub use movie::{Frame, Movie, View};
pub use picture::{Picture, PictureFormat};
pub use report::{Definition, Facts, KeyFigure, MAX_PAGE_BYTES, Report};
pub use table::{Column, Order, Row, Table, Value};
