//! Baselines: simple methods that a model must beat, fitted on training clips alone.
//!
//! | name | prediction |
//! |---|---|
//! | `hold` | true previous frame, moved rigidly with the heading frame |
//! | `mean_shape` | mean of the training frames, moved rigidly with the heading frame |
//! | `skinning` | rest shape by linear blend skinning |
//! | `skinning_mean` | `skinning` plus the mean displacement of the training frames |
//! | `skinning_first` | `skinning` plus the displacement of the clip's own frame 0 |
//! | `ridge` | displacement by ridge regression from two motion vectors |
//! | `ridge_handled` | `ridge` with the model's intersection handling, where it has one |
//! | `linear_dynamics` | `ridge` with the previous displacement as a further input |
//!
//! A model's share of vertices inside the body is compared with `ridge_handled`: no other baseline
//! handles intersections ([`fit_with`]).
//!
//! An evaluation of a displacement model has one more baseline, `prior`: the model's own prior
//! without field and state ([`PriorPredictor`](crate::PriorPredictor)). The difference between the
//! two is what the field contributes.
//!
//! The displacement u_i of vertex i is defined by x_i = LBS_i(rest) + R_i u_i, with R_i the
//! rotation of its blended skinning transform. The regressions predict the first [`COMPONENTS`]
//! principal components of u. Their regularisation strength has the least free-running error on the
//! capture's validation clips. Without such clips it is chosen by leave-one-clip-out
//! cross-validation. All folds share the components, means and scales of all training clips. Only
//! the regression is fitted for each fold, which needs sums and no pass over the data.

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
    handled::{HandledPredictor, IntersectionHandler},
    predictor::NamedPredictor,
    training::TrainingSet,
};
use std::sync::Arc;

/// Name of the ridge regression.
pub const RIDGE: &str = "ridge";

/// Name of the ridge regression whose intersections are handled as a model's are.
pub const RIDGE_HANDLED: &str = "ridge_handled";

/// Fits all baselines, in the order of the table above. None handles intersections.
pub fn fit(set: &TrainingSet) -> Vec<NamedPredictor> {
    fit_with(set, None)
}

/// Fits all baselines, in the order of the table above. [`RIDGE_HANDLED`] is among them where there
/// is a handler.
pub fn fit_with(set: &TrainingSet, handler: Option<IntersectionHandler>) -> Vec<NamedPredictor> {
    let components = Arc::new(ComponentModel::fit(set));
    let series = components.series_set(set);
    let garment = &components.garment;
    let ridge = ComponentRegression::ridge(&components, &series);
    let handled = handler.map(|handler| HandledPredictor::new(ridge.clone(), handler));
    let linear_dynamics = ComponentRegression::linear_dynamics(&components, &series);
    let mut baselines = vec![
        NamedPredictor::baseline("hold", Hold),
        NamedPredictor::baseline("mean_shape", MeanShape::fit(set)),
        NamedPredictor::baseline("skinning", Skinning::rest(garment)),
        NamedPredictor::baseline("skinning_mean", Skinning::mean(garment, set)),
        NamedPredictor::baseline("skinning_first", Skinning::first(garment)),
        NamedPredictor::baseline(RIDGE, ridge),
    ];
    baselines.extend(handled.map(|handled| NamedPredictor::baseline(RIDGE_HANDLED, handled)));
    baselines.push(NamedPredictor::baseline("linear_dynamics", linear_dynamics));
    baselines
}
