//! Characters of a costume, and their garments before they are shown.

use super::{Actor, PlaySession};
use crate::play::crowd;
use crate::play::settings::{Costume, Settling};
use crate::{Figure, ViewerError};
use rayon::prelude::*;
use std::sync::Arc;
use unic_core::motion_matching::{Command, Controller, RootFrame};

/// Ticks between the starts of two characters of a crowd, so that they do not move as one.
const STAGGER_TICKS: usize = 9;
/// Ticks of a garment until it hangs.
const SETTLE_TICKS: usize = 30;
/// Most ticks of all garments together where somebody waits for them.
const MOST_SETTLE_TICKS_AT_ONCE: usize = 60;

impl PlaySession {
    /// Makes the characters of a costume around a root. The session stays as it was where this fails.
    pub(super) fn dress(
        &mut self,
        root: RootFrame,
        costume: usize,
        characters: usize,
    ) -> Result<(), ViewerError> {
        let Costume { outfit, database, .. } = &self.settings.costumes[costume];
        let (expected, found) = (outfit.model().config().fps, database.fps());
        if expected != found {
            return Err(ViewerError::Rate { expected, found });
        }
        let characters = characters.max(1);
        let actors = (0..characters).map(|character| {
            let place = crowd::place(character);
            let position = root.position + place;
            self.actor(costume, character, RootFrame { position, ..root })
        });
        let mut actors: Vec<Actor> = actors.collect::<Result<_, _>>()?;
        self.fall_into_place(&mut actors)?;
        // Ticks of the new rate that make the same time of play.
        self.ticks = (f64::from(self.seconds()) * f64::from(found)).round() as u64;
        self.actors = actors;
        self.costume = costume;
        self.settings.characters = characters;
        self.clock = self.ticks as f64;
        self.show(1.0);
        Ok(())
    }

    /// Steps new garments while their characters stand still, because a mean shape hangs as no garment
    /// does.
    fn fall_into_place(&self, actors: &mut [Actor]) -> Result<(), ViewerError> {
        let ticks = match self.settings.settling {
            Settling::Whole => SETTLE_TICKS,
            Settling::AtOnce => SETTLE_TICKS.min(MOST_SETTLE_TICKS_AT_ONCE / actors.len()),
        };
        let wind = self.wind;
        actors.par_iter_mut().try_for_each(|actor| {
            (0..ticks).try_for_each(|_| actor.figure.step(actor.controller.pose(), wind))
        })
    }

    /// Makes a character of a costume.
    fn actor(&self, costume: usize, character: usize, root: RootFrame) -> Result<Actor, ViewerError> {
        let Costume {
            outfit,
            database,
            tags,
        } = &self.settings.costumes[costume];
        let mut controller = Controller::new(Arc::clone(database), self.settings.control);
        controller.set_tags(*tags)?;
        controller.reset(root);
        for _ in 0..(STAGGER_TICKS * character) {
            controller.step(&Command::STAND)?;
        }
        let figure = Figure::new(Arc::clone(outfit), controller.pose(), self.wind)?;
        Ok(Actor {
            before: controller.state().root(),
            controller,
            figure,
            place: crowd::place(character),
        })
    }
}
