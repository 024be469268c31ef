//! Training samples: normalised motion vectors, and coefficients of the garment.

use super::{
    config::{ComparisonConfig, SurfaceKind},
    features::Features,
    network::{Batch, Noise, Shape},
    space::Subspace,
};
use glam::Vec3;
use rand::RngExt;
use rayon::prelude::*;
use unic_core::{
    character::Garment,
    motion::{JointSprings, MotionSpec, Normalisation, NormalisationRule, NormalisedElements},
    skeleton::Skeleton,
    surface_map::SurfaceMap,
};
use unic_eval::{PreparedClip, TrainingSet};
use unic_train::{
    MirrorMap, MotionVectors, Stream, TrainError, View, generator, mirrored, mirrored_surface, normalisation,
};

/// Normalisation of the motion vectors, as in preset `standard`.
const INPUT_SCALE: NormalisationRule = NormalisationRule {
    elements: NormalisedElements::All,
    least_std: 0.02,
    limit: Some(5.0),
};

/// All training samples, and the parts of them that the predictor needs.
pub(super) struct Samples {
    pub(super) garment: Garment,
    pub(super) surface: SurfaceKind,
    pub(super) spec: MotionSpec,
    pub(super) skeleton: Skeleton,
    pub(super) fps: f32,
    pub(super) normalisation: Normalisation,
    pub(super) features: Features,
    pub(super) space: Subspace,
    pub(super) units: Units,
    /// Largest absolute value of each coefficient, metres.
    pub(super) ranges: Vec<f32>,
    motion: Vec<MotionVectors>,
    sequences: Vec<Sequence>,
}

/// Units of the network's inputs and outputs, metres. One unit serves all coefficients, so that
/// each weighs as much as it moves the garment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Units {
    /// Unit of the previous garment.
    pub(super) garment: f32,
    /// Unit of the output.
    pub(super) output: f32,
}

/// One clip, as recorded or mirrored.
struct Sequence {
    clip: usize,
    view: View,
    /// Coefficients of each frame, metres.
    coefficients: Vec<Vec<f32>>,
}

impl Samples {
    pub(super) fn new(
        set: &TrainingSet,
        spec: &MotionSpec,
        skeleton: &Skeleton,
        config: &ComparisonConfig,
    ) -> Result<Self, TrainError> {
        let joints = skeleton.len();
        let frames = set.frames();
        let vectors = frames
            .iter()
            .map(|f| set.train[f.clip].kinematics.motion(f.frame));
        let mirrored = config
            .mirror
            .then(|| Mirrored::new(set, &spec.springs, skeleton))
            .flatten();
        let map = mirrored.as_ref().map(|m| &m.motion);
        let normalisation = normalisation(joints, spec.len(joints), INPUT_SCALE, vectors, map)?;
        let motion = set
            .train
            .iter()
            .map(|c| MotionVectors::new(c, &normalisation, map));
        let motion: Vec<MotionVectors> = motion.collect();
        let space = Subspace::fit(set, config.surface, config.space)?;
        let sequences = sequences(set, config.surface, &space, mirrored.as_ref())?;
        let fps = set.train.first().map_or(0.0, |c| c.captured.clip.fps);
        Ok(Self {
            garment: set.garment.clone(),
            surface: config.surface,
            spec: spec.clone(),
            skeleton: skeleton.clone(),
            fps,
            features: Features::new(config, joints, fps),
            units: Units::of(&sequences, config.global_feature.is_some()),
            ranges: ranges(&sequences),
            normalisation,
            space,
            motion,
            sequences,
        })
    }

    /// Draws the frames of a step evenly from all clips in both views.
    pub(super) fn draw(&self, config: &ComparisonConfig, shape: &Shape, step: u64) -> Batch {
        let mut rng = generator(config.seed, Stream::Windows, step);
        let total: usize = self.sequences.iter().map(Sequence::steps).sum();
        let mut batch = Batch {
            rows: config.frames,
            motion: Vec::new(),
            garment: Vec::new(),
            targets: Vec::new(),
            noise: Noise::draw(shape, config, step),
        };
        for _ in 0..config.frames {
            let (sequence, frame) = self.locate(rng.random_range(0..total.max(1)));
            let motion = &self.motion[sequence.clip];
            self.features
                .write(motion, sequence.view, frame, &mut batch.motion);
            let [before, now] = [frame - 1, frame].map(|t| &sequence.coefficients[t]);
            if shape.reads_garment() {
                let Units { garment, output } = self.units;
                batch.garment.extend(before.iter().map(|z| z / garment));
                let changes = now.iter().zip(before).map(|(z, b)| (z - b) / output);
                batch.targets.extend(changes);
            } else {
                batch.targets.extend(now.iter().map(|z| z / self.units.output));
            }
        }
        batch
    }

    /// Returns the sequence and the frame of a step index.
    fn locate(&self, mut index: usize) -> (&Sequence, usize) {
        for sequence in &self.sequences {
            if index < sequence.steps() {
                return (sequence, index + 1);
            }
            index -= sequence.steps();
        }
        // Not reached: `index` is below the sum of the steps of all sequences.
        (&self.sequences[0], 1)
    }
}

impl Sequence {
    /// Returns the number of frames that have a frame before them.
    fn steps(&self) -> usize {
        self.coefficients.len().saturating_sub(1)
    }
}

impl Units {
    /// Measures the units. `is_change` is whether the output is the change of the garment.
    fn of(sequences: &[Sequence], is_change: bool) -> Self {
        let pairs = || sequences.iter().flat_map(|s| s.coefficients.windows(2));
        let now = |k: usize| largest_rms(pairs().map(|p| p[k].as_slice()));
        let change = || {
            let changes: Vec<Vec<f32>> = pairs()
                .map(|p| p[1].iter().zip(&p[0]).map(|(b, a)| b - a).collect())
                .collect();
            largest_rms(changes.iter().map(Vec::as_slice))
        };
        Self {
            garment: now(0),
            output: if is_change { change() } else { now(1) },
        }
    }
}

/// Returns the largest RMS of any coefficient, or 1 where nothing moves.
fn largest_rms<'a>(all: impl Iterator<Item = &'a [f32]>) -> f32 {
    let (mut squares, mut count) = (Vec::new(), 0usize);
    for z in all {
        squares.resize(z.len(), 0.0);
        (squares.iter_mut().zip(z)).for_each(|(s, z)| *s += f64::from(*z).powi(2));
        count += 1;
    }
    let most = squares.into_iter().fold(0.0, f64::max);
    let rms = (most / count.max(1) as f64).sqrt() as f32;
    // The unit is a divisor. Subnormal numbers would overflow the quotient.
    if rms > f32::MIN_POSITIVE { rms } else { 1.0 }
}

/// Returns the largest absolute value of each coefficient, metres.
fn ranges(sequences: &[Sequence]) -> Vec<f32> {
    let mut ranges = Vec::new();
    for z in sequences.iter().flat_map(|s| &s.coefficients) {
        ranges.resize(z.len(), 0.0);
        (ranges.iter_mut().zip(z)).for_each(|(range, z)| *range = f32::max(*range, z.abs()));
    }
    ranges
}

/// Mirror maps of motion vectors and garments.
struct Mirrored {
    motion: MirrorMap,
    garment: SurfaceMap,
}

impl Mirrored {
    /// Builds the maps. Returns `None` where skeleton or garment are not symmetric.
    fn new(set: &TrainingSet, springs: &JointSprings, skeleton: &Skeleton) -> Option<Self> {
        Some(Self {
            motion: MirrorMap::new(springs, skeleton)?,
            garment: mirrored_surface(&set.garment.rest)?,
        })
    }
}

/// Projects all clips onto the subspace, as recorded and, with a mirror map, mirrored.
fn sequences(
    set: &TrainingSet,
    surface: SurfaceKind,
    space: &Subspace,
    mirror: Option<&Mirrored>,
) -> Result<Vec<Sequence>, TrainError> {
    let coefficients = |clip: &PreparedClip, view: View| -> Result<Vec<Vec<f32>>, TrainError> {
        let frame = |t: usize| -> Result<Vec<f32>, TrainError> {
            let here = surface.of_frame(&set.garment, clip, t);
            match (view, mirror) {
                (View::Mirrored, Some(mirror)) => {
                    let mut there: Vec<Vec3> = Vec::new();
                    mirror.garment.interpolate_vectors(&here, &mut there)?;
                    there.iter_mut().for_each(|u| *u = mirrored(*u));
                    Ok(space.project(&there))
                }
                _ => Ok(space.project(&here)),
            }
        };
        (0..clip.len()).into_par_iter().map(frame).collect()
    };
    let views: &[View] = match mirror {
        Some(_) => &[View::Direct, View::Mirrored],
        None => &[View::Direct],
    };
    let all = views
        .iter()
        .flat_map(|&view| (set.train.iter().enumerate()).map(move |(clip, prepared)| (clip, prepared, view)));
    all.map(|(clip, prepared, view)| {
        Ok(Sequence {
            clip,
            view,
            coefficients: coefficients(prepared, view)?,
        })
    })
    .collect()
}
