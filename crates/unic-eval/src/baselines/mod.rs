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
//! | `linear_dynamics` | the same with the previous displacement as a further input |
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

use crate::{evaluate::Row, training::TrainingSet};
use std::sync::Arc;

/// Fits all baselines, in the order of the table.
pub fn fit(set: &TrainingSet) -> Vec<Row> {
    let components = Arc::new(ComponentModel::fit(set));
    let series = components.series_set(set);
    let garment = &components.garment;
    let linear_dynamics = ComponentRegression::linear_dynamics(&components, &series);
    vec![
        Row::baseline("hold", Hold),
        Row::baseline("mean_shape", MeanShape::fit(set)),
        Row::baseline("skinning", Skinning::rest(garment)),
        Row::baseline("skinning_mean", Skinning::mean(garment, set)),
        Row::baseline("skinning_first", Skinning::first(garment)),
        Row::baseline("ridge", ComponentRegression::ridge(&components, &series)),
        Row::baseline("linear_dynamics", linear_dynamics),
    ]
}
