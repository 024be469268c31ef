//! Characters of a costume, and their garments before they are shown.

use super::{Actor, PlaySession};
use crate::play::crowd;
use crate::play::settings::{Costume, Settling};
use crate::{Figure, ViewerError};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use unic_core::motion_matching::{Command, Controller, RootFrame};

/// Ticks between the starts of two characters of a crowd, so that they do not move as one.
const STAGGER_TICKS: usize = 9;
/// Ticks of a garment until it hangs.
const SETTLE_TICKS: usize = 30;
/// Most ticks of all garments together where somebody waits for them.
const MOST_SETTLE_TICKS_AT_ONCE: usize = 60;

impl PlaySession {
    /// Dresses a number of characters in a costume. Those who are there go on with their motion if
    /// the costume has the same. The session stays as it was where this fails.
    pub(super) fn dress(&mut self, costume: usize, characters: usize) -> Result<(), ViewerError> {
        let actors = self.actors(costume, 0..characters)?;
        let part_of_tick = self.clock - self.ticks as f64;
        // Ticks of the new rate that make the same time of play.
        let fps = self.settings.costumes[costume].database.fps();
        self.ticks = (f64::from(self.seconds()) * f64::from(fps)).round() as u64;
        self.clock = self.ticks as f64 + part_of_tick;
        self.actors = actors;
        self.costume = costume;
        self.settings.characters = characters;
        self.show(part_of_tick as f32);
        Ok(())
    }

    /// Adds characters in the present costume, or takes the last ones away. The session stays as it
    /// was where this fails.
    pub(super) fn fill(&mut self, characters: usize) -> Result<(), ViewerError> {
        let newer = self.actors(self.costume, self.actors.len()..characters)?;
        self.actors.truncate(characters);
        self.actors.extend(newer);
        self.settings.characters = characters;
        self.show(self.share);
        Ok(())
    }

    /// Makes characters of a costume whose garments hang.
    fn actors(&self, costume: usize, characters: Range<usize>) -> Result<Vec<Actor>, ViewerError> {
        let Costume { outfit, database, .. } = &self.settings.costumes[costume];
        let (expected, found) = (outfit.model().config().fps, database.fps());
        if expected != found {
            return Err(ViewerError::Rate { expected, found });
        }
        let actors = characters.map(|character| self.actor(costume, character));
        let mut actors: Vec<Actor> = actors.collect::<Result<_, _>>()?;
        self.fall_into_place(&mut actors)?;
        Ok(actors)
    }

    /// Steps new garments while their characters stand still, because a mean shape hangs as no garment
    /// does.
    fn fall_into_place(&self, actors: &mut [Actor]) -> Result<(), ViewerError> {
        let ticks = match self.settings.settling {
            Settling::Whole => SETTLE_TICKS,
            Settling::AtOnce => SETTLE_TICKS.min(MOST_SETTLE_TICKS_AT_ONCE / actors.len().max(1)),
        };
        let wind = self.wind;
        actors.par_iter_mut().try_for_each(|actor| {
            (0..ticks).try_for_each(|_| actor.figure.step(actor.controller.pose(), wind))
        })
    }

    /// Makes a character of a costume, in the motion of the one whom it replaces.
    fn actor(&self, costume: usize, character: usize) -> Result<Actor, ViewerError> {
        let outfit = Arc::clone(&self.settings.costumes[costume].outfit);
        let (controller, before) = self.motion(costume, character)?;
        Ok(Actor {
            figure: Figure::new(outfit, controller.pose(), self.wind)?,
            before,
            controller,
            place: crowd::place(character),
        })
    }

    /// Controller of a character in a costume, and its root a tick ago.
    fn motion(&self, costume: usize, character: usize) -> Result<(Controller, RootFrame), ViewerError> {
        let Costume { database, tags, .. } = &self.settings.costumes[costume];
        let is_same = Arc::ptr_eq(database, &self.costume().database);
        if let Some(actor) = self.actors.get(character).filter(|_| is_same) {
            let mut controller = actor.controller.clone();
            controller.set_tags(*tags)?;
            return Ok((controller, actor.before));
        }
        let mut controller = Controller::new(Arc::clone(database), self.settings.control);
        controller.set_tags(*tags)?;
        let root = self.root();
        controller.reset(RootFrame {
            position: root.position + crowd::place(character),
            ..root
        });
        for _ in 0..(STAGGER_TICKS * character) {
            controller.step(&Command::STAND)?;
        }
        let root = controller.state().root();
        Ok((controller, root))
    }
}
