//! One self-contained HTML page about an evaluated garment.
//!
//! A [`Report`] is plain data: text, encoded [`Picture`]s, [`Series`] of numbers, [`Table`]s.
//! [`Report::html`] lays it out as one page that opens from a disk without a network. Pictures are
//! data URIs, charts are inline SVG, and style and script are in the page. A content security
//! policy in its head forbids everything else. All text is escaped.
//!
//! The page follows the reader's choice of a light or dark colour scheme, and fits a phone. Without
//! scripts, strips of pictures replace movies.
//!
//! ```
//! use unic_report::{Chart, Order, Report, Series, Table, TableColumn, TableRow, Value};
//!
//! let drift = Chart {
//!     title: "RMSE over time".into(),
//!     x: "time, s".into(),
//!     y: "RMSE, mm".into(),
//!     series: vec![Series { name: "model".into(), points: vec![(0.5, 12.0), (1.0, 14.5)] }],
//! };
//! let scores = Table {
//!     title: "All clips".into(),
//!     columns: vec![TableColumn {
//!         name: "RMSE".into(),
//!         unit: "mm".into(),
//!         digits: 1,
//!         order: Order::LessIsBetter,
//!     }],
//!     rows: vec![TableRow { name: "model".into(), values: vec![Value::Number(13.3)] }],
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
//! This crate does not measure, draw garments or encode pictures. Names and numbers may be
//! anything: a number that is not finite is a gap in a chart and a word in a table.

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
pub use heat::{CaptionedPicture, ColourBar, HeatMap, HeatStrip};
pub use movie::{Movie, MovieFrame, MovieView};
pub use picture::{Picture, PictureFormat};
pub use report::{Definition, Fact, Facts, KeyFigure, MAX_PAGE_BYTES, Report};
pub use table::{Order, Table, TableColumn, TableRow, Value};
