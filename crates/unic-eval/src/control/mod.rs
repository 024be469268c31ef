//! Quality of interactive control: scripted inputs, and metrics beside their targets.

mod metrics;
mod reference;
mod report;
mod run;
mod script;
#[cfg(test)]
mod tests;
mod timing;

pub use metrics::ControlMetrics;
pub use reference::DataReference;
pub use report::{ControlReport, TARGETS, Target};
pub use run::{ControlRun, Tick};
pub use script::{Player, Script};
