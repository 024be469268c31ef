//! Metrics and baselines for garment animation.
//!
//! A [`Predictor`] predicts garment positions. [`evaluate()`] runs any number of them over clips of
//! a capture and measures every frame. One-step errors do not show how errors grow in free running,
//! so that both [`Mode`]s are measured. All numbers stand beside those of the [`baselines`], which
//! are fitted on the training clips alone.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use unic_eval::{baselines, evaluate, training_set};
//! use unic_io::{Capture, Split};
//!
//! let capture = Capture::open("captures/tshirt".as_ref())?;
//! let mut predictors = baselines::fit(&training_set(&capture)?);
//! let clips = capture.clip_names(Split::Test).to_vec();
//! let evaluation = evaluate(&capture, &mut predictors, &clips, &mut |_| Ok(()))?;
//! println!("{evaluation}");
//! println!("{}", serde_json::to_string_pretty(&evaluation)?);
//! # Ok(())
//! # }
//! ```
//!
//! | subject | items |
//! |---|---|
//! | evaluation of predictors | [`evaluate()`], [`Protocol`], [`Event`], [`Evaluation`] |
//! | interface of predictors | [`Predictor`], [`NamedPredictor`] |
//! | models and simple methods | [`ModelPredictor`], [`PriorPredictor`], [`baselines`] |
//! | intersection handling for any predictor | [`HandledPredictor`] |
//! | wrinkles that come and go, a judge | [`BandMetrics`], [`JudgeReport`], [`ControlPredictor`] |
//! | metrics of one's own | [`Observer`], [`Dump`], and the example `own_metric` |
//! | drift, sudden stops, disturbances | [`lasting`] |
//! | motion that a capture does not cover | [`Coverage`] |
//! | linear algebra of the fits | [`PrincipalComponents`], [`Moments`] |
//!
//! The sums behind the metrics can be used alone: [`ClipMetrics`] takes measured frames, and
//! [`PooledMetrics`] pools clips.
//!
//! ```
//! use unic_eval::{ClipMetrics, FrameSums, Mode};
//!
//! // Two vertices, each 3 mm off, for two seconds at 30 fps.
//! let frame = FrameSums { vertices: 2, squared: 2.0 * 0.003_f64.powi(2), ..FrameSums::default() };
//! let mut clip = ClipMetrics::new(30.0, Mode::FreeRunning);
//! (1..=60).for_each(|t| clip.add(t, &frame));
//! let metrics = clip.finish().metrics();
//! assert!((metrics.rmse_mm - 3.0).abs() < 1e-9);
//! assert_eq!(metrics.drift_mm.len(), 2);
//! assert_eq!(metrics.rmse_mm_at_5s, None);
//! ```

pub mod baselines;
mod clip_evaluator;
mod code;
pub mod control;
mod coverage;
mod dump;
mod error;
mod evaluate;
mod event;
mod handled;
mod kinematics;
pub mod lasting;
mod life;
mod measure;
mod metrics;
mod model;
mod pca;
mod predictor;
mod regression;
mod report;
#[cfg(test)]
mod synthetic;
mod training;

pub use code::CodeCertainty;
pub use coverage::{Coverage, CoverageReport, Excess, KindShare, Place, Stretch, Unit, capture_clips};
pub use dump::Dump;
pub use error::{Error, Result};
pub use evaluate::{Protocol, evaluate, evaluate_by};
pub use event::{Event, Observer};
pub use handled::{HandledPredictor, IntersectionHandler};
pub use kinematics::{ClipKinematics, PreparedClip};
pub use life::{
    BandMetrics, BendingRatio, ControlError, ControlPredictor, JudgeReport, Liveliness, LivingMeasure,
    SelfCrossingShares, WrinkleFilter,
};
pub use measure::{FrameContext, MeasureScratch, Nearest, Prediction};
pub use metrics::{ClipMetrics, FrameSums, Metrics, PooledMetrics};
pub use model::{FrameRateError, ModelPredictor, PriorPredictor};
pub use pca::{PrincipalComponents, SampleMatrix, mean};
pub use predictor::{CONTROL, MODEL, Mode, NamedPredictor, PRIOR, Predictor, PredictorError};
pub use regression::{LinearMap, Moments};
pub use report::{ByMode, Evaluation, Scores};
pub use training::{
    Displacements, FrameIndex, RootRelativePositions, TrainingSet, motion_numbers, training_set,
    training_set_of,
};
