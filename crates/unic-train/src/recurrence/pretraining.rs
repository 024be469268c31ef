//! Pretraining of a recurrent unit on several garments in the same motion.

use super::{
    head::HeadStart,
    human_motion::{ELEMENTS, Element, human_elements, kept},
    pretrained::{FPS, PretrainedUnit},
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
use std::{array, collections::BTreeSet};
use unic_core::{
    motion::{Normalisation, motion_len},
    skeleton::Skeleton,
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
    /// Captures of another frame rate than 30; captures that differ in motion, character or
    /// symmetry; a character without all of SMPL's joints; a garment that does not move; settings
    /// without a recurrence; a training that diverges; a stop.
    pub fn run(self, watch: &Watch) -> Result<PretrainedUnit, TrainError> {
        let StateSettings::Displacement {
            prior_shapes,
            recurrence: Some(settings),
            ..
        } = &self.settings.model.state
        else {
            return Err(TrainError::Pretraining("settings without a recurrence"));
        };
        // The unit reads elements that the skeletons of all humans have.
        let mut without_springs = self.settings.clone();
        without_springs.model.springs = Vec::new();
        let data = (self.captures.into_iter())
            .map(|capture| Dataset::load(capture, &without_springs, Fit::AllClips))
            .collect::<Result<Vec<Dataset>, _>>()?;
        let first = data.first().ok_or(TrainError::Pretraining("no capture"))?;
        if !data.iter().all(|other| is_like(first, other)) {
            return Err(TrainError::Pretraining(
                "captures of different motion or characters",
            ));
        }
        if first.capture.manifest.fps != FPS {
            return Err(TrainError::Pretraining(
                "captures of other than 30 frames per second",
            ));
        }
        let skeleton = &first.capture.character.skeleton;
        let elements = HumanElements::find(skeleton)?;
        let kept = kept(&elements.elements, skeleton.len());
        let motion: Vec<MotionVectors> = first.motion.iter().map(|m| m.with_only(&kept)).collect();
        let sequences = |data| {
            let trainer = PriorTrainer {
                data,
                settings: self.settings,
                processor: self.processor,
                folder: None,
            };
            trainer.sequences_of(&motion, *prior_shapes)
        };
        let sequences = joined(data.iter().map(sequences).collect::<Result<_, _>>()?)?;
        let training = UnitTraining {
            settings,
            start: None,
            head: HeadStart::Random,
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
        Ok(elements.unit(&trained.values, &first.normalisation, training.fps))
    }
}

/// Returns whether two captures have the same motion vectors, frame rate and joints.
fn is_like(first: &Dataset, other: &Dataset) -> bool {
    let joints = [first, other].map(|data| data.capture.character.skeleton.joints());
    first.capture.manifest.fps == other.capture.manifest.fps
        && joints[0] == joints[1]
        && first.motion == other.motion
}

/// Elements of the motion vectors of a skeleton that has all of SMPL's joints.
struct HumanElements {
    elements: [Element; ELEMENTS],
    /// Index of each element in a motion vector. All are different.
    indices: [usize; ELEMENTS],
    /// Numbers in a motion vector.
    len: usize,
}

impl HumanElements {
    fn find(skeleton: &Skeleton) -> Result<Self, TrainError> {
        let wrong = || TrainError::Pretraining("a skeleton without all of SMPL's joints");
        let elements = human_elements(skeleton).ok_or_else(wrong)?;
        let found: BTreeSet<usize> = elements.iter().filter_map(|e| e.index).collect();
        if found.len() < ELEMENTS {
            return Err(wrong());
        }
        Ok(Self {
            // Every element has an index, or fewer would have been found.
            indices: elements.map(|e| e.index.unwrap_or_default()),
            elements,
            len: motion_len(skeleton.len()),
        })
    }

    /// The unit with these values of parameters, in the order of a unit's fields, without its last
    /// map.
    fn unit(&self, values: &[Vec<f32>], normalisation: &Normalisation, fps: f32) -> PretrainedUnit {
        const MAPS: usize = 5;
        let (weights, biases) = values[2..].split_at(MAPS);
        let width = biases[0].len();
        let rows = [0, self.len].into_iter();
        let rows = rows.flat_map(|frame| self.indices.map(|index| frame + index));
        let embedding = rows.flat_map(|row| weights[0][row * width..][..width].to_vec());
        let scaled = |numbers: &[f32]| -> Vec<f32> {
            let pairs = self.elements.iter().zip(&self.indices);
            pairs
                .map(|(element, index)| element.scale * numbers[*index])
                .collect()
        };
        PretrainedUnit {
            mean: scaled(&normalisation.mean),
            std: scaled(&normalisation.std),
            decay_per_s: values[0].iter().map(|rate| rate.exp() * fps).collect(),
            angle_per_s: values[1].iter().map(|angle| angle * fps).collect(),
            weights: [
                embedding.collect(),
                weights[1].clone(),
                weights[2].clone(),
                weights[3].clone(),
            ],
            biases: array::from_fn(|i| biases[i].clone()),
        }
    }
}

/// Sequences with the coefficients of all garments side by side. Those of a garment are divided by
/// the root mean square of its largest coefficient.
///
/// # Errors
/// Garments of which some are mirrored and others are not; a garment that does not move.
fn joined(garments: Vec<Vec<Sequence>>) -> Result<Vec<Sequence>, TrainError> {
    if garments.iter().flatten().any(|s| s.outputs() == 0) {
        return Err(TrainError::Pretraining("a garment that does not move"));
    }
    let mut garments = garments.into_iter();
    let mut all = garments.next().unwrap_or_default();
    scale(&mut all);
    for mut garment in garments {
        scale(&mut garment);
        if all.len() != garment.len() {
            return Err(TrainError::Pretraining("symmetric and asymmetric garments"));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mirror::View;

    fn sequence(motion: &MotionVectors, coefficients: Vec<f32>) -> Sequence<'_> {
        Sequence {
            motion,
            view: View::Direct,
            frames: 0..2,
            linear: vec![0.0; coefficients.len()],
            coefficients,
            motion_number: 0,
        }
    }

    #[test]
    fn garments_lie_side_by_side_in_units_of_their_largest_coefficient() {
        let motion = MotionVectors::of_plain(1, vec![0.0; 2]);
        let of = |numbers: &[f32]| vec![sequence(&motion, numbers.to_vec())];
        let all = joined(vec![of(&[3.0, 1.0, -3.0, 0.0]), of(&[0.5, 0.5])]).unwrap();
        let expected = [1.0, 1.0 / 3.0, 1.0, -1.0, 0.0, 1.0];
        for (a, b) in all[0].coefficients.iter().zip(expected) {
            assert!((a - b).abs() < 1e-6, "{:?}", all[0].coefficients);
        }
        assert!(joined(vec![of(&[1.0, 1.0]), of(&[])]).is_err());
        let twice = vec![of(&[1.0, 1.0]), [of(&[1.0, 1.0]), of(&[1.0, 1.0])].concat()];
        assert!(joined(twice).is_err());
    }
}
