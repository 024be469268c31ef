//! The rows that a model must beat, each fitted on training clips alone.
//!
//! | name | what it predicts |
//! |---|---|
//! | `hold` | the true previous frame, carried along by the root in the heading frame |
//! | `mean_shape` | the mean training frame, in the heading frame |
//! | `skinning` | the rest shape by linear blend skinning |
//! | `skinning_mean` | the mean displacement of the training frames on top of that |
//! | `skinning_first` | the displacement of the clip's own frame 0 on top of that |
//! | `ridge` | the displacement by ridge regression from two motion vectors |
//! | `ridge_handled` | the same with the intersection handling of the model, where it has one |
//! | `linear_dynamics` | `ridge` with the previous displacement as a further input |
//!
//! `ridge_handled` is what a model's share of vertices inside the body is compared with: no other
//! baseline handles intersections ([`fit_with`]).
//!
//! Beside a displacement model stands one more row, `prior`: the model's own prior without its
//! field and its state ([`PriorPredictor`](crate::PriorPredictor)). It is fitted as the model is, and
//! tells how much of the model's error the field has taken away.
//!
//! A displacement is u of x_i = LBS_i(rest) + R_i u_i, R_i the blended rotation of vertex i. The
//! regressions predict its [`COMPONENTS`] leading principal components. Their strength is chosen by
//! the free-running error on the capture's validation clips, or without any by leaving out one
//! training clip at a time. Components, means and scales are those of all training clips in every
//! fold: only the regression itself is fitted again, which costs sums instead of passes over the
//! data.

mod components;
mod fit;
mod hold;
mod mean_shape;
mod ridge;
mod skinning;
#[cfg(test)]
mod tests;

pub use components::{COMPONENTS, ComponentModel, MOST_GRAM_FRAMES};
pub use hold::Hold;
pub use mean_shape::MeanShape;
pub use ridge::ComponentRegression;
pub use skinning::Skinning;

use crate::{
    evaluate::Row,
    handled::{HandledPredictor, Handler},
    training::TrainingSet,
};
use std::sync::Arc;

/// Name of ridge regression's row.
pub const RIDGE: &str = "ridge";

/// Name of the row of ridge regression with intersections handled as a model handles them.
pub const RIDGE_HANDLED: &str = "ridge_handled";

/// Fits all baselines, in the order of the table; none handles intersections.
pub fn fit(set: &TrainingSet) -> Vec<Row> {
    fit_with(set, None)
}

/// Fits all baselines, in the order of the table, with [`RIDGE_HANDLED`] where there is a handler.
pub fn fit_with(set: &TrainingSet, handler: Option<Handler>) -> Vec<Row> {
    let components = Arc::new(ComponentModel::fit(set));
    let series = components.series_set(set);
    let garment = &components.garment;
    let ridge = ComponentRegression::ridge(&components, &series);
    let handled = handler.map(|handler| HandledPredictor::new(ridge.clone(), handler));
    let linear_dynamics = ComponentRegression::linear_dynamics(&components, &series);
    let mut rows = vec![
        Row::baseline("hold", Hold),
        Row::baseline("mean_shape", MeanShape::fit(set)),
        Row::baseline("skinning", Skinning::rest(garment)),
        Row::baseline("skinning_mean", Skinning::mean(garment, set)),
        Row::baseline("skinning_first", Skinning::first(garment)),
        Row::baseline(RIDGE, ridge),
    ];
    rows.extend(handled.map(|handled| Row::baseline(RIDGE_HANDLED, handled)));
    rows.push(Row::baseline("linear_dynamics", linear_dynamics));
    rows
}
