//! Faces stretched through a part of the body between corners that are outside.

use super::{
    cloth::Cloth,
    pokes::{Poke, View},
};
use crate::parallel::for_each_chunk;
use glam::{Mat3, Vec3};

/// Faces that one thread takes at a time.
const CHUNK: usize = 64;

/// A face stretched less than this follows the skin well enough for the body's vertices to find it.
const LEAST_STRETCH: f32 = 1.1;

/// A face whose points stay this close to its corners, stretched as far as cloth is, spans nothing that is seen, metres.
const LEAST_RADIUS_M: f32 = 0.009;

/// Where a face is looked at: the middles of its edges, barycentric.
const PLACES: [Vec3; 3] = [
    Vec3::new(0.5, 0.5, 0.0),
    Vec3::new(0.0, 0.5, 0.5),
    Vec3::new(0.5, 0.0, 0.5),
];

/// What the faces stretched through the body have to be lifted by.
///
/// A knee that comes through a skirt pushes the skirt's vertices out to all sides. The faces between them lie so
/// deep in the knee that its vertices find none of them, or others beside it; so the faces look for themselves.
#[derive(Clone, Debug)]
pub(super) struct Spans {
    /// Of the cloth; of a fine one none.
    wide: Vec<u32>,
    /// By wide face.
    found: Vec<Option<Poke>>,
}

impl Spans {
    pub(super) fn new(cloth: &Cloth) -> Self {
        let wide = cloth.wide(LEAST_RADIUS_M);
        Self {
            found: vec![None; wide.len()],
            wide,
        }
    }

    /// Those that were found.
    pub(super) fn iter(&self) -> impl Iterator<Item = Poke> {
        self.found.iter().flatten().copied()
    }

    /// Looks from all that are near the body.
    pub(super) fn find(&mut self, view: &View) {
        let wide = &self.wide;
        for_each_chunk(&mut self.found, CHUNK, |first, found| {
            for (&face, found) in wide[first..].iter().zip(found) {
                *found = view.span(face);
            }
        });
    }
}

impl View<'_> {
    /// The longest way out of the body from the middles of a stretched face's edges.
    fn span(&self, face: u32) -> Option<Poke> {
        let slots = self.cloth.corners(face).map(|slot| slot as usize);
        let corners = slots.map(|slot| self.corrected[slot]);
        if !self.cloth.is_stretched(face, LEAST_STRETCH, corners) {
            return None;
        }
        let span = Mat3::from_cols(corners[0], corners[1], corners[2]);
        let skins = slots.map(|slot| self.contacts[slot].face);
        let corner = self.body.parts().packets().vertices()[slots[0]];
        let lifted = [self.cloth.number(face), corner];
        let ways = PLACES.iter().filter_map(|&weights| {
            let p = span * weights;
            // Over the skin under all corners nothing is spanned: most faces ask no more.
            if skins.iter().all(|&skin| self.body.surface().is_above(skin, p)) {
                return None;
            }
            let out = self.rule.out_of_depth(self.body, lifted, p, skins[0])?;
            Some((weights, out - p))
        });
        Poke::longest(face, ways)
    }
}
