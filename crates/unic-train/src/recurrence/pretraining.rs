//! Pretraining of a recurrent unit on several garments in the same motion.

use super::{
    human_motion::{ELEMENTS, human_elements, kept},
    pretrained::PretrainedUnit,
    sequence::Sequence,
    unit_training::UnitTraining,
    watch::{Progress, Watch},
};
use crate::{
    config::{StateSettings, TrainConfig},
    dataset::{Dataset, MotionVectors},
    device,
    error::TrainError,
    fit::Fit,
    prior::PriorTrainer,
    processor::Processor,
};
use unic_io::Capture;

/// Trains a unit that predicts the shapes of all garments of several captures at once.
///
/// Its first maps and oscillators are what the garments have in common, and become a
/// [`PretrainedUnit`].
pub struct Pretraining<'a> {
    /// Captures of one character in the same motion, each of another garment.
    pub captures: Vec<Capture>,
    /// Settings of the runs that start from the unit. Seed, sizes and steps are theirs.
    pub settings: &'a TrainConfig,
    /// Processor of the training.
    pub processor: Processor,
}

impl Pretraining<'_> {
    /// Trains the unit.
    ///
    /// # Errors
    /// Captures of different motion or of a character that is not human, settings without a
    /// recurrence, a training that diverges, a stop.
    pub fn run(self, watch: &Watch) -> Result<PretrainedUnit, TrainError> {
        let StateSettings::Displacement {
            prior_shapes,
            recurrence: Some(settings),
            ..
        } = &self.settings.model.state
        else {
            return Err(TrainError::Pretraining("settings without a recurrence"));
        };
        let data: Vec<Dataset> = (self.captures.into_iter())
            .map(|capture| Dataset::load(capture, self.settings, Fit::AllClips))
            .collect::<Result<_, _>>()?;
        let first = data.first().ok_or(TrainError::Pretraining("no capture"))?;
        let skeleton = &first.capture.character.skeleton;
        let elements =
            human_elements(skeleton).ok_or(TrainError::Pretraining("a skeleton that is not a human's"))?;
        let kept = kept(&elements, skeleton.len());
        let motion: Vec<MotionVectors> = first.motion.iter().map(|m| m.with_only(&kept)).collect();
        let garments = data
            .iter()
            .map(|data| {
                let trainer = PriorTrainer {
                    data,
                    settings: self.settings,
                    processor: self.processor,
                    folder: None,
                };
                trainer.sequences_of(&motion, *prior_shapes)
            })
            .collect::<Result<Vec<_>, _>>()?;
        let sequences = joined(garments)?;
        let training = UnitTraining {
            settings,
            start: None,
            steps: settings.steps_for(sequences.iter().map(Sequence::len).sum()),
            seed: self.settings.seed,
            fps: first.capture.manifest.fps,
            device: &device::open(self.processor)?,
            at_once: 1,
            folder: None,
        };
        let progress = Progress::new(training.steps, watch);
        let sequences: Vec<&Sequence> = sequences.iter().collect();
        let trained = training.run(&sequences, &progress)?;
        let trained = trained.ok_or(TrainError::Pretraining("garments that do not move"))?;
        let width = settings.width;
        let (values, fps) = (trained.values, training.fps);
        let mut weights: [Vec<f32>; 4] = std::array::from_fn(|i| values[2 + i].clone());
        let pairs = [0, 1]
            .into_iter()
            .flat_map(|frame| (0..ELEMENTS).map(move |i| (frame, i)));
        weights[0] = pairs
            .flat_map(|(frame, i)| {
                // A skeleton of SMPL's joints has every element.
                let index = elements[i].index.unwrap_or_default();
                values[2][(frame * kept.len() + index) * width..][..width].to_vec()
            })
            .collect();
        let normalised = |i: usize| {
            let (element, index) = (elements[i], elements[i].index.unwrap_or_default());
            [first.normalisation.mean[index], first.normalisation.std[index]].map(|x| element.scale * x)
        };
        Ok(PretrainedUnit {
            mean: (0..ELEMENTS).map(|i| normalised(i)[0]).collect(),
            std: (0..ELEMENTS).map(|i| normalised(i)[1]).collect(),
            decay_per_s: values[0].iter().map(|rate| rate.exp() * fps).collect(),
            angle_per_s: values[1].iter().map(|angle| angle * fps).collect(),
            weights,
            biases: std::array::from_fn(|i| values[7 + i].clone()),
        })
    }
}

/// Sequences with the coefficients of all garments side by side, each garment's by the root mean
/// square of its largest.
///
/// # Errors
/// Garments in different motion.
fn joined(garments: Vec<Vec<Sequence>>) -> Result<Vec<Sequence>, TrainError> {
    let mut garments = garments.into_iter();
    let mut all = garments.next().unwrap_or_default();
    scale(&mut all);
    for mut garment in garments {
        scale(&mut garment);
        let same = |(a, b): (&Sequence, &Sequence)| a.len() == b.len() && a.view == b.view;
        if all.len() != garment.len() || !all.iter().zip(&garment).all(same) {
            return Err(TrainError::Pretraining("captures of different motion"));
        }
        for (a, b) in all.iter_mut().zip(&garment) {
            let rows = (a.coefficients.chunks(a.outputs())).zip(b.coefficients.chunks(b.outputs()));
            a.coefficients = rows.flat_map(|(a, b)| [a, b].concat()).collect();
        }
    }
    Ok(all)
}

/// Divides coefficients by the root mean square of the largest one.
fn scale(sequences: &mut [Sequence]) {
    let outputs = sequences.first().map_or(0, Sequence::outputs);
    let mut squares = vec![0.0; outputs];
    for row in sequences
        .iter()
        .flat_map(|s| s.coefficients.chunks_exact(outputs.max(1)))
    {
        squares
            .iter_mut()
            .zip(row)
            .for_each(|(sum, x)| *sum += f64::from(x * x));
    }
    let frames: usize = sequences.iter().map(Sequence::len).sum();
    let largest = squares.into_iter().fold(0.0, f64::max) / frames.max(1) as f64;
    let rms = largest.sqrt().max(f64::MIN_POSITIVE) as f32;
    sequences
        .iter_mut()
        .flat_map(|s| &mut s.coefficients)
        .for_each(|x| *x /= rms);
}
