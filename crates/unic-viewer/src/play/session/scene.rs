//! Scene of a play.

use super::{Actor, PlaySession};
use crate::play::marks::marks;
use crate::play::palette::cloth_of;
use crate::{Focus, Looks, Mark, Part, SUN, Scene, Shape};
use unic_raster::Ground;

impl PlaySession {
    /// Bodies and garments of all characters.
    pub fn parts(&self) -> Vec<Part<'_>> {
        let looks = |character| Looks {
            cloth: cloth_of(character, self.looks.cloth),
            ..self.looks
        };
        let actors = self.actors.iter().enumerate();
        let parts = actors.flat_map(|(i, actor)| actor.figure.parts(looks(i)));
        parts.collect()
    }

    /// Does something with the scene of the play as it is now.
    pub fn with_scene<T>(&self, work: impl FnOnce(&Scene) -> T) -> T {
        let parts = self.parts();
        work(&Scene {
            parts: &parts,
            marks: &self.marks(),
            ground: Ground::Height(0.0),
            to_key: SUN,
            focus: Self::focus(&parts),
        })
    }

    /// Region of the characters.
    fn focus(parts: &[Part]) -> Focus {
        // Garments on a device are near their bodies.
        let positions = parts.iter().flat_map(|part| match part.shape {
            Shape::Host(vertices) => vertices,
            Shape::Device { .. } => &[],
        });
        let focus = Focus::around(positions.map(|vertex| vertex.position));
        Focus {
            radius: focus.radius + 0.1,
            ..focus
        }
    }

    /// Marks on the floor: the path that the object is about to take, and the target of the mouse
    /// if it steers.
    pub fn marks(&self) -> Vec<Mark> {
        let target = |actor: &Actor| {
            let object = actor.controller.state().object().root();
            self.steers_by_mouse.then(|| self.mouse.target(&object))
        };
        let first = self.actors.first();
        first.map_or(Vec::new(), |actor| marks(&actor.controller, target(actor)))
    }
}
