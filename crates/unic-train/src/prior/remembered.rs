//! What a prior's recurrence learns from: the garment's frames as sequences, and their mirror images.

use super::series::{Series, displacements, pair};
use crate::{
    dataset::MotionVectors,
    mirror::{View, mirrored},
    recurrence::{Sequence, mirrored_surface},
};
use rayon::prelude::*;
use unic_core::surface_map::SurfaceMap;
use unic_eval::{LinearMap, PrincipalComponents, TrainingSet};

/// What a recurrence learns from.
pub(super) struct Remembered<'a> {
    pub(super) set: &'a TrainingSet,
    pub(super) motion: &'a [MotionVectors],
    pub(super) components: &'a PrincipalComponents,
    pub(super) series: &'a [Series],
    pub(super) maps: &'a [Option<LinearMap>],
}

impl<'a> Remembered<'a> {
    /// Every series, then every mirrored one where the garment is symmetric.
    pub(super) fn sequences(&self) -> Vec<Sequence<'a>> {
        let mut sequences: Vec<Sequence> = self.places().map(|p| self.sequence(p, View::Direct)).collect();
        let is_mirrored = self.motion.iter().all(MotionVectors::is_mirrored);
        let map = is_mirrored
            .then(|| mirrored_surface(&self.set.garment.rest))
            .flatten();
        if let Some(map) = map {
            let mirrored = |p| Sequence {
                targets: self.mirrored_targets(p, &map),
                ..self.sequence(p, View::Mirrored)
            };
            sequences.extend(self.places().map(mirrored));
        }
        sequences
    }

    /// Series, its clip and its first frame there.
    fn places(&self) -> impl Iterator<Item = (usize, usize, usize)> + use<'_, 'a> {
        let is_cut = self.set.train.len() == 1;
        let starts = self.series.iter().scan(0, move |next, series| {
            let start = *next;
            *next += if is_cut { series.inputs.len() } else { 0 };
            Some(start)
        });
        let clip = move |index: usize| if is_cut { 0 } else { index };
        starts
            .enumerate()
            .map(move |(index, start)| (index, clip(index), start))
    }

    fn sequence(&self, (index, clip, start): (usize, usize, usize), view: View) -> Sequence<'a> {
        let (series, map) = (&self.series[index], self.maps[index].as_ref());
        let left = |t: usize| {
            let predicted = series.predicted(map, t);
            let pairs = series.components[t].iter().zip(predicted);
            pairs.map(|(c, p)| (c - p) as f32).collect::<Vec<_>>()
        };
        Sequence {
            motion: &self.motion[clip],
            view,
            frames: start..start + series.inputs.len(),
            targets: (0..series.inputs.len()).flat_map(left).collect(),
            fold: index,
        }
    }

    /// What the linear map leaves of the mirrored garment in the mirrored motion.
    fn mirrored_targets(&self, (index, clip, start): (usize, usize, usize), map: &SurfaceMap) -> Vec<f32> {
        let frames = start..start + self.series[index].inputs.len();
        let left = |frame: usize| {
            let mut there = Vec::new();
            let displacements = displacements(self.set, clip, frame);
            (map.vectors(&displacements, &mut there)).expect("a map of this garment's own mesh");
            let sample: Vec<f32> = there.iter().flat_map(|u| mirrored(*u).to_array()).collect();
            let pair = pair(&self.motion[clip], frame, View::Mirrored);
            let linear = self.maps[index].as_ref().map(|m| m.apply(&pair));
            let components = self.components.project(&sample);
            (components.iter().enumerate())
                .map(|(k, c)| (c - linear.as_ref().map_or(0.0, |p| p[k])) as f32)
                .collect::<Vec<f32>>()
        };
        frames.into_par_iter().flat_map_iter(left).collect()
    }
}
