//! What a prior's recurrence learns from: the garment's frames as sequences, and their mirror images.

use super::series::{Series, displacements, pair, projected};
use crate::{
    dataset::MotionVectors,
    mirror::{View, mirrored},
    recurrence::{Sequence, mirrored_surface},
};
use glam::Vec3;
use std::ops::Range;
use unic_core::{
    character::Garment,
    surface_map::{SurfaceMap, SurfaceMapError},
};
use unic_eval::{LinearMap, PrincipalComponents, TrainingSet};

/// What a recurrence learns from.
pub(super) struct Remembered<'a> {
    pub(super) set: &'a TrainingSet,
    pub(super) motion: &'a [MotionVectors],
    pub(super) components: &'a PrincipalComponents,
    pub(super) series: &'a [Series],
    /// What each series shows; those of one motion are judged together.
    pub(super) motions: &'a [usize],
    pub(super) maps: &'a [Option<LinearMap>],
}

impl<'a> Remembered<'a> {
    /// Every series, then every mirrored one where the garment is symmetric.
    ///
    /// # Errors
    /// None for a set whose clips show its garment.
    pub(super) fn sequences(&self) -> Result<Vec<Sequence<'a>>, SurfaceMapError> {
        let direct = |place: Place| self.sequence(place, View::Direct, self.learned(place.series));
        let mut sequences: Vec<Sequence> = self.places().map(direct).collect();
        let is_mirrored = self.motion.iter().all(MotionVectors::is_mirrored);
        let map = is_mirrored
            .then(|| mirrored_surface(&self.set.garment.rest))
            .flatten();
        if let Some(map) = map {
            for place in self.places() {
                let learned = self.mirrored(place, &map)?;
                sequences.push(self.sequence(place, View::Mirrored, learned));
            }
        }
        Ok(sequences)
    }

    fn places(&self) -> impl Iterator<Item = Place> + use<'_, 'a> {
        let is_cut = self.set.train.len() == 1;
        let starts = self.series.iter().scan(0, move |next, series| {
            let start = *next;
            *next += if is_cut { series.len() } else { 0 };
            Some(start)
        });
        starts.enumerate().map(move |(series, start)| Place {
            series,
            clip: if is_cut { 0 } else { series },
            start,
        })
    }

    fn sequence(&self, place: Place, view: View, learned: Learned) -> Sequence<'a> {
        Sequence {
            motion: &self.motion[place.clip],
            view,
            frames: self.frames(place),
            targets: learned.targets,
            coefficients: learned.coefficients,
            motion_number: self.motions[place.series],
        }
    }

    /// Frames of the clip.
    fn frames(&self, place: Place) -> Range<usize> {
        place.start..place.start + self.series[place.series].len()
    }

    /// A series and what the linear map leaves of it.
    fn learned(&self, index: usize) -> Learned {
        let residual = self.series[index].residual(self.maps[index].as_ref());
        Learned {
            coefficients: in_f32(self.series[index].components()),
            targets: residual.map(|c| c as f32).collect(),
        }
    }

    /// The mirrored garment in the mirrored motion, under the mask of where it is then.
    fn mirrored(&self, place: Place, map: &SurfaceMap) -> Result<Learned, SurfaceMapError> {
        let clip = &self.set.train[place.clip];
        let garment = &self.set.garment;
        let whole = Garment::new(garment.rest.clone(), garment.weights.clone());
        let of_frame = |frame: usize| -> Result<Vec<Vec3>, SurfaceMapError> {
            let mut there = Vec::new();
            map.vectors(&displacements(&whole, clip, frame), &mut there)?;
            let there = there.into_iter().enumerate();
            Ok(there.map(|(v, u)| mirrored(u) * garment.share(v)).collect())
        };
        let mut components = projected(self.components, self.frames(place), of_frame)?;
        let coefficients = in_f32(&components);
        if let Some(linear) = &self.maps[place.series] {
            let frames = self.frames(place);
            let inputs: Vec<f64> = frames
                .flat_map(|t| pair(&self.motion[place.clip], t, View::Mirrored))
                .collect();
            let predicted = linear.apply_rows(&inputs);
            components.iter_mut().zip(predicted).for_each(|(c, p)| *c -= p);
        }
        Ok(Learned {
            coefficients,
            targets: in_f32(&components),
        })
    }
}

/// Frames × K each, metres.
struct Learned {
    coefficients: Vec<f32>,
    targets: Vec<f32>,
}

fn in_f32(values: &[f64]) -> Vec<f32> {
    values.iter().map(|c| *c as f32).collect()
}

/// Where a series stands.
#[derive(Clone, Copy)]
struct Place {
    series: usize,
    clip: usize,
    /// Its first frame in the clip.
    start: usize,
}
