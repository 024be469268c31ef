//! Values that a recurrent unit starts from: those of a unit that has learned how garments follow
//! human motion.
//!
//! How a garment responds to a motion differs between garments in its shapes, and less in what it
//! remembers: when it swings, lags and comes to rest. A unit that has learned it from several
//! garments and much motion is a better start than random values where motion is short. Its last
//! map is left out: it belongs to the shapes of its garments.

use super::{
    human_motion::{ELEMENTS, Element, human_elements},
    sizes::{LEAST_RATE, Sizes},
};
use crate::error::TrainError;
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use std::{
    collections::{BTreeMap, HashMap},
    sync::LazyLock,
};
use unic_core::{
    motion::{MotionLayout, MotionSpec, Normalisation},
    skeleton::Skeleton,
};

/// The unit that comes with the program. `unic-lab pretrain` makes it.
static HUMAN: LazyLock<Option<PretrainedUnit>> =
    // A test reads the file that the program is built with.
    LazyLock::new(|| PretrainedUnit::from_bytes(include_bytes!("pretrained.safetensors")).ok());

/// Ticks per second in pretraining.
pub(super) const FPS: f32 = 30.0;

/// Names of the maps but for the last, in the order of a unit's parameters.
const MAPS: [&str; 4] = ["embedding", "drive", "memory", "hidden"];

/// A trained unit without its last map. It reads 145 numbers of each of two frames, the earlier one
/// first: height, velocity and angular velocity of the pelvis, then positions and velocities of the
/// other 23 joints, in the heading frame, in m, m/s and rad/s of a human whose legs are 0.8 m long.
#[derive(Clone, Debug, PartialEq)]
pub struct PretrainedUnit {
    /// Mean of each element in pretraining.
    pub(super) mean: Vec<f32>,
    /// Standard deviation of each element in pretraining.
    pub(super) std: Vec<f32>,
    /// Decay rate of each oscillator, 1/s.
    pub(super) decay_per_s: Vec<f32>,
    /// Angle by which each oscillator turns in a second, radians.
    pub(super) angle_per_s: Vec<f32>,
    /// Weights of the first four maps, inputs × outputs.
    pub(super) weights: [Vec<f32>; 4],
    /// Biases of these maps.
    pub(super) biases: [Vec<f32>; 4],
}

/// First values of a unit's parameters, but for the last map.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct UnitStart {
    pub(super) rates: Vec<f32>,
    pub(super) angles: Vec<f32>,
    pub(super) weights: [Vec<f32>; 4],
    pub(super) biases: [Vec<f32>; 4],
}

impl UnitStart {
    /// Values for a character's motion vectors. Returns none where no pretrained unit can read
    /// them: another layout, or a skeleton that is not recognised as a human's.
    pub(crate) fn new(
        spec: &MotionSpec,
        skeleton: &Skeleton,
        normalisation: &Normalisation,
        fps: f32,
    ) -> Option<Self> {
        let elements = human_elements(skeleton).filter(|_| spec.layout == MotionLayout::Heading)?;
        Some(HUMAN.as_ref()?.start(&elements, normalisation, fps))
    }

    /// Returns whether a unit of these sizes can start from the values.
    pub(super) fn fits(&self, sizes: Sizes) -> bool {
        let counts = sizes.maps().map(|(inputs, outputs)| inputs * outputs);
        self.rates.len() == sizes.oscillators && (self.weights.iter().zip(counts)).all(|(w, n)| w.len() == n)
    }
}

impl PretrainedUnit {
    /// Values for motion vectors with these elements.
    fn start(&self, elements: &[Element; ELEMENTS], normalisation: &Normalisation, fps: f32) -> UnitStart {
        let (width, len) = (self.biases[0].len(), normalisation.mean.len());
        let mut start = UnitStart {
            rates: (self.decay_per_s.iter())
                .map(|rate| (rate / fps).max(LEAST_RATE).ln())
                .collect(),
            angles: self.angle_per_s.iter().map(|angle| angle / fps).collect(),
            weights: self.weights.clone(),
            biases: self.biases.clone(),
        };
        let mut embedding = vec![0.0; 2 * len * width];
        for (row, weights) in self.weights[0].chunks_exact(width).enumerate() {
            let (frame, i) = (row / ELEMENTS, row % ELEMENTS);
            let map = elements[i].rescaled(normalisation, self.mean[i], self.std[i]);
            let biases = start.biases[0].iter_mut().zip(weights);
            biases.for_each(|(bias, w)| *bias += w * map.offset);
            // Two of SMPL's joints may be one of this skeleton's, so that weights are added.
            if let Some(index) = elements[i].index {
                let out = &mut embedding[(frame * len + index) * width..][..width];
                out.iter_mut()
                    .zip(weights)
                    .for_each(|(x, w)| *x += w * map.factor);
            }
        }
        start.weights[0] = embedding;
        let states = start.weights[2]
            .chunks_exact_mut(self.biases[2].len())
            .enumerate();
        for (row, weights) in states {
            let k = row % self.decay_per_s.len();
            let factor = self.response(k, FPS) / self.response(k, fps);
            weights.iter_mut().for_each(|w| *w *= factor);
        }
        start
    }

    /// Magnitude of an oscillator's state under a constant drive of 1, √(1 − |λ|²) / |1 − λ|. It
    /// grows with the number of ticks in which the oscillator forgets.
    fn response(&self, oscillator: usize, fps: f32) -> f32 {
        let decay = (-(self.decay_per_s[oscillator] / fps).max(LEAST_RATE)).exp();
        let angle = self.angle_per_s[oscillator] / fps;
        let gap = (1.0 - decay * angle.cos()).hypot(decay * angle.sin());
        (1.0 - decay * decay).sqrt() / gap
    }

    /// Reads a unit from the bytes of a safetensors file.
    ///
    /// # Errors
    /// Bytes of another file, tensors of other sizes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, TrainError> {
        let wrong = |found: &str| TrainError::PretrainedUnit(found.to_owned());
        let file = SafeTensors::deserialize(bytes).map_err(|e| wrong(&e.to_string()))?;
        let tensor = |name: &str| -> Result<Vec<f32>, TrainError> {
            let view = file.tensor(name).map_err(|e| wrong(&e.to_string()))?;
            let numbers = view.data().chunks_exact(4);
            // Chunks of four bytes convert to arrays of four.
            let values: Vec<f32> = numbers
                .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
                .collect();
            match view.dtype() == Dtype::F32 && values.iter().all(|x| x.is_finite()) {
                true => Ok(values),
                false => Err(wrong(&format!("tensor {name} that is not of finite f32"))),
            }
        };
        let each = |part: &str| -> Result<[Vec<f32>; 4], TrainError> {
            let [a, b, c, d] = MAPS.map(|map| tensor(&format!("{map}.{part}")));
            Ok([a?, b?, c?, d?])
        };
        let unit = Self {
            mean: tensor("mean")?,
            std: tensor("std")?,
            decay_per_s: tensor("decay_per_s")?,
            angle_per_s: tensor("angle_per_s")?,
            weights: each("weight")?,
            biases: each("bias")?,
        };
        match unit.has_sizes() {
            true => Ok(unit),
            false => Err(wrong("tensors of other sizes")),
        }
    }

    /// Bytes of a safetensors file.
    ///
    /// # Errors
    /// Tensors of other sizes.
    pub fn to_bytes(&self) -> Result<Vec<u8>, TrainError> {
        let mut tensors = BTreeMap::from([
            ("mean".to_owned(), &self.mean),
            ("std".to_owned(), &self.std),
            ("decay_per_s".to_owned(), &self.decay_per_s),
            ("angle_per_s".to_owned(), &self.angle_per_s),
        ]);
        for (i, map) in MAPS.into_iter().enumerate() {
            tensors.insert(format!("{map}.weight"), &self.weights[i]);
            tensors.insert(format!("{map}.bias"), &self.biases[i]);
        }
        let wrong = |e: safetensors::SafeTensorError| TrainError::PretrainedUnit(e.to_string());
        let views = tensors
            .iter()
            .map(|(name, values)| {
                let view = TensorView::new(Dtype::F32, vec![values.len()], bytemuck::cast_slice(values));
                view.map(|view| (name.clone(), view))
            })
            .collect::<Result<Vec<_>, _>>()
            .map_err(wrong)?;
        safetensors::serialize(views, None::<HashMap<String, String>>).map_err(wrong)
    }

    fn has_sizes(&self) -> bool {
        let sizes = Sizes {
            inputs: 2 * ELEMENTS,
            width: self.biases[0].len(),
            oscillators: self.decay_per_s.len(),
            outputs: 0,
        };
        let maps = sizes.maps().into_iter().zip(&self.weights).zip(&self.biases);
        let mut fit = maps.map(|(((inputs, outputs), weights), biases)| {
            weights.len() == inputs * outputs && biases.len() == outputs
        });
        fit.all(|fits| fits)
            && [&self.mean, &self.std].map(Vec::len) == [ELEMENTS; 2]
            && self.angle_per_s.len() == sizes.oscillators
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        noise::normal,
        stream::{Stream, generator},
    };
    use glam::Vec3;
    use unic_core::{
        motion::{JointSprings, motion_len},
        skeleton::{ADULT_JOINTS, SMPL_JOINT_NAMES, SMPL_PARENTS, SkeletonParts},
    };

    /// An adult of SMPL's joints, `size` times as large.
    fn human(size: f32, names: &[&str]) -> Skeleton {
        let mut joints = vec![Vec3::ZERO; SMPL_JOINT_NAMES.len()];
        for (j, position) in ADULT_JOINTS {
            joints[j] = size * Vec3::from(position);
        }
        Skeleton::new(SkeletonParts {
            names: names.iter().map(|n| (*n).to_owned()).collect(),
            parents: SMPL_PARENTS.to_vec(),
            joints,
            ..SkeletonParts::default()
        })
        .unwrap()
    }

    fn normalisation(seed: u64, joints: usize) -> Normalisation {
        let mut rng = generator(seed, Stream::Parameters, 0);
        let mut draw = || -> Vec<f32> { (0..motion_len(joints)).map(|_| normal(&mut rng)).collect() };
        Normalisation {
            mean: draw(),
            std: draw().into_iter().map(|x| 0.1 + x.abs()).collect(),
            limit: None,
        }
    }

    fn unit() -> &'static PretrainedUnit {
        HUMAN.as_ref().expect("the unit that comes with the program")
    }

    #[test]
    fn the_unit_of_the_program_fits_the_preset_and_survives_its_file() {
        let again = PretrainedUnit::from_bytes(&unit().to_bytes().unwrap()).unwrap();
        assert_eq!(&again, unit());
        let skeleton = human(1.0, &SMPL_JOINT_NAMES);
        let elements = human_elements(&skeleton).unwrap();
        let start = unit().start(&elements, &normalisation(1, skeleton.len()), 30.0);
        let sizes = |width| Sizes {
            inputs: 2 * motion_len(skeleton.len()),
            width,
            oscillators: 128,
            outputs: 64,
        };
        assert!(start.fits(sizes(256)) && !start.fits(sizes(128)));
        let mut short = unit().clone();
        short.mean.pop();
        assert!(PretrainedUnit::from_bytes(&short.to_bytes().unwrap()).is_err());
        assert!(PretrainedUnit::from_bytes(b"no safetensors").is_err());
    }

    #[test]
    fn the_embedding_reads_metres_whatever_the_normalisation() {
        let skeleton = human(1.0, &SMPL_JOINT_NAMES);
        let elements = human_elements(&skeleton).unwrap();
        let len = motion_len(skeleton.len());
        let normalisation = normalisation(2, skeleton.len());
        let start = unit().start(&elements, &normalisation, 30.0);
        let mut rng = generator(3, Stream::Parameters, 0);
        let pair: Vec<f32> = (0..2 * len).map(|_| normal(&mut rng)).collect();
        let width = unit().biases[0].len();
        let (mut expected, mut found) = (unit().biases[0].clone(), start.biases[0].clone());
        for (weights, x) in start.weights[0].chunks_exact(width).zip(&pair) {
            found.iter_mut().zip(weights).for_each(|(y, w)| *y += w * x);
        }
        for (row, weights) in unit().weights[0].chunks_exact(width).enumerate() {
            let (frame, i) = (row / ELEMENTS, row % ELEMENTS);
            let index = elements[i].index.unwrap();
            let change = normalisation.std[index] * pair[frame * len + index];
            // A mean far from those of pretraining is limited to five deviations.
            let mean = elements[i].scale * normalisation.mean[index] - unit().mean[i];
            let z = elements[i].scale * change / unit().std[i] + (mean / unit().std[i]).clamp(-5.0, 5.0);
            expected.iter_mut().zip(weights).for_each(|(y, w)| *y += w * z);
        }
        let size = expected.iter().map(|x| x.abs()).fold(0.0, f32::max);
        for (a, b) in expected.iter().zip(&found) {
            assert!((a - b).abs() < 1e-4 * size, "{a} {b}");
        }
    }

    #[test]
    fn a_giant_whose_motion_is_scaled_starts_from_the_same_values() {
        let [small, large] = [1.0, 2.0].map(|size| human(size, &SMPL_JOINT_NAMES));
        let elements = [&small, &large].map(|s| human_elements(s).unwrap());
        let plain = normalisation(4, small.len());
        let mut scaled = plain.clone();
        for e in elements[0].iter().filter(|e| e.scale != 1.0) {
            let i = e.index.unwrap();
            scaled.mean[i] = 2.0 * plain.mean[i];
            scaled.std[i] = 2.0 * plain.std[i];
        }
        let starts = [
            unit().start(&elements[0], &plain, 30.0),
            unit().start(&elements[1], &scaled, 30.0),
        ];
        let size = starts[0].biases[0].iter().map(|x| x.abs()).fold(0.0, f32::max);
        for (a, b) in (starts[0].biases[0].iter()).zip(&starts[1].biases[0]) {
            assert!((a - b).abs() < 1e-4 * size);
        }
        // 60 ticks a second: half the rate and half the angle a tick, and the memory reads of a
        // constant drive what it reads at 30.
        let faster = unit().start(&elements[0], &plain, 60.0);
        for (slow, fast) in starts[0].angles.iter().zip(&faster.angles) {
            assert!((slow - 2.0 * fast).abs() < 1e-6);
        }
        for (slow, fast) in starts[0].rates.iter().zip(&faster.rates) {
            let [slow, fast] = [slow, fast].map(|rate| rate.exp());
            assert!(
                (slow - 2.0 * fast).abs() < 1e-4 || fast < 1.01 * LEAST_RATE,
                "{slow} {fast}"
            );
        }
        let width = unit().biases[2].len();
        for k in [0, 5, 127] {
            let read = |start: &UnitStart, fps| start.weights[2][k * width] * unit().response(k, fps);
            let [slow, fast] = [read(&starts[0], 30.0), read(&faster, 60.0)];
            assert!((slow - fast).abs() < 1e-3 * slow.abs(), "{slow} {fast}");
        }
        assert_eq!(starts[0].weights[2], unit().weights[2]);
    }

    #[test]
    fn skeletons_that_are_not_human_start_at_random() {
        let spec = |layout| MotionSpec {
            layout,
            velocity: unic_core::motion::VelocityScheme::Backward,
            contact_joints: [7, 10, 8, 11],
            contact_rest_heights_m: [0.0; 4],
            springs: JointSprings::default(),
        };
        let start = |names: &[&str], layout| {
            let skeleton = human(1.0, names);
            UnitStart::new(&spec(layout), &skeleton, &normalisation(5, skeleton.len()), 30.0).is_some()
        };
        let numbered: Vec<String> = (0..SMPL_JOINT_NAMES.len()).map(|j| format!("bone{j}")).collect();
        let numbered: Vec<&str> = numbered.iter().map(String::as_str).collect();
        assert!(start(&SMPL_JOINT_NAMES, MotionLayout::Heading));
        assert!(!start(&SMPL_JOINT_NAMES, MotionLayout::Paper));
        assert!(!start(&numbered, MotionLayout::Heading));
    }
}
