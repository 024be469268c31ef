//! Play without a window: characters, time and what is drawn.

use super::crowd;
use super::marks::marks;
use super::palette::cloth_of;
use super::settings::{Costume, PlaySettings};
use super::steering::Steering;
use crate::{Figure, Focus, Looks, Mark, Part, SUN, Scene, Shape, ViewerError};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;
use unic_core::motion_matching::{Command, Controller, MouseControl, RootFrame, wrapped};
use unic_raster::Ground;

/// Largest speed that the mouse asks for, m/s.
const MOUSE_SPEED_M_S: f32 = 2.0;
/// Ticks between the starts of two characters of a crowd, so that they do not move as one.
const STAGGER_TICKS: usize = 9;
/// Steps for all characters together in which new garments fall into place, before they are shown.
const SETTLE_STEPS: usize = 60;
/// Most ticks of them for a character.
const MOST_SETTLE_TICKS: usize = 30;

/// Times of the last frame, seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times {
    /// Motion matching of all characters.
    pub motion_s: f32,
    /// Bodies and garments of all characters.
    pub garment_s: f32,
    /// Number of ticks in the frame.
    pub ticks: usize,
}

/// Characters under control, with the garments they wear.
pub struct PlaySession {
    settings: PlaySettings,
    costume: usize,
    looks: Looks,
    actors: Vec<Actor>,
    mouse: MouseControl,
    command: Command,
    steers_by_mouse: bool,
    /// Place that is shown between the last two ticks: 0 is the earlier one, 1 the later one.
    share: f32,
    /// Time of play in ticks. Fractions of a tick add up to the same number at every display rate.
    clock: f64,
    /// Number of ticks.
    ticks: u64,
    wind: Vec3,
    times: Times,
}

/// One character.
struct Actor {
    controller: Controller,
    /// Root at the tick before the last one.
    before: RootFrame,
    figure: Figure,
    place: Vec2,
}

impl Actor {
    /// Root between the last two ticks.
    fn shown_root(&self, share: f32) -> RootFrame {
        let (before, now) = (self.before, self.controller.state().root());
        RootFrame {
            position: before.position.lerp(now.position, share),
            yaw: before.yaw + wrapped(now.yaw - before.yaw) * share,
        }
    }
}

impl PlaySession {
    /// Puts the characters on the floor, with the first one at the origin.
    ///
    /// # Errors
    /// Costumes whose motion is of another skeleton or rate, too little memory on the device.
    pub fn new(settings: PlaySettings) -> Result<Self, ViewerError> {
        let costume = settings.costumes.first().ok_or(ViewerError::NoCostume)?;
        let looks = costume.looks();
        let mut session = Self {
            costume: 0,
            looks,
            actors: Vec::new(),
            mouse: MouseControl::new(MOUSE_SPEED_M_S),
            command: Command::STAND,
            steers_by_mouse: false,
            share: 1.0,
            clock: 0.0,
            ticks: 0,
            wind: Vec3::ZERO,
            times: Times::default(),
            settings,
        };
        let characters = session.settings.characters;
        session.dress(RootFrame::default(), 0, characters)?;
        Ok(session)
    }

    /// Costume that the characters wear.
    pub fn costume(&self) -> &Costume {
        &self.settings.costumes[self.costume]
    }

    /// Number of costumes.
    pub fn costume_count(&self) -> usize {
        self.settings.costumes.len()
    }

    /// Dresses all characters in another costume where they stand. Numbers beyond the last costume
    /// begin again.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn wear(&mut self, costume: usize) -> Result<(), ViewerError> {
        let costume = costume % self.settings.costumes.len();
        self.dress(self.root(), costume, self.settings.characters)?;
        let shading = self.looks.shading;
        self.looks = Looks {
            shading,
            ..self.costume().looks()
        };
        Ok(())
    }

    /// Index of the costume.
    pub fn costume_index(&self) -> usize {
        self.costume
    }

    /// Changes the number of characters.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn set_characters(&mut self, characters: usize) -> Result<(), ViewerError> {
        self.dress(self.root(), self.costume, characters)
    }

    /// Number of characters.
    pub fn characters(&self) -> usize {
        self.actors.len()
    }

    /// Looks of all characters.
    pub fn looks_mut(&mut self) -> &mut Looks {
        &mut self.looks
    }

    /// Sets the velocity of the air, m/s, world space.
    pub fn set_wind(&mut self, wind: Vec3) {
        self.wind = wind;
    }

    /// Velocity of the air, m/s, world space.
    pub fn wind(&self) -> Vec3 {
        self.wind
    }

    /// Starts all garments again, from their mean shapes.
    ///
    /// # Errors
    /// Never, for poses of the controllers.
    pub fn restart_garments(&mut self) -> Result<(), ViewerError> {
        let wind = self.wind;
        self.actors
            .iter_mut()
            .try_for_each(|actor| actor.figure.reset(actor.controller.pose(), wind))
    }

    /// Root of the first character, as shown between the ticks.
    pub fn root(&self) -> RootFrame {
        let first = self.actors.first();
        first.map_or(RootFrame::default(), |actor| actor.shown_root(self.share))
    }

    /// Middle of all characters, as shown, with the yaw of the first one.
    pub fn centre(&self) -> RootFrame {
        let roots = self.actors.iter().map(|actor| actor.shown_root(self.share));
        RootFrame {
            position: roots.map(|root| root.position).sum::<Vec2>() / self.actors.len().max(1) as f32,
            yaw: self.root().yaw,
        }
    }

    /// Time of play, seconds.
    pub fn seconds(&self) -> f32 {
        self.ticks as f32 / self.fps()
    }

    /// Times of the last frame.
    pub fn times(&self) -> Times {
        self.times
    }

    /// Command of the last tick.
    pub fn command(&self) -> Command {
        self.command
    }

    fn fps(&self) -> f32 {
        self.costume().database.fps()
    }

    /// Makes the characters of a costume around a root. The session stays as it was where this fails.
    fn dress(&mut self, root: RootFrame, costume: usize, characters: usize) -> Result<(), ViewerError> {
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

    /// Steps new garments while their characters stand still, because a mean shape hangs as no garment does.
    ///
    /// A crowd gets fewer ticks, so that it appears at once.
    fn fall_into_place(&self, actors: &mut [Actor]) -> Result<(), ViewerError> {
        let ticks = (SETTLE_STEPS / actors.len()).min(MOST_SETTLE_TICKS);
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

    /// Lets the characters stand for `seconds`, so that garments fall into place.
    ///
    /// # Errors
    /// Those of [`advance`](Self::advance).
    pub fn settle(&mut self, seconds: f32) -> Result<(), ViewerError> {
        for _ in 0..(seconds * self.fps()) as usize {
            self.tick(&mut Steering::Command(Command::STAND))?;
        }
        self.clock = self.ticks as f64;
        self.show(1.0);
        Ok(())
    }

    /// Advances by `seconds` of play, which may be less or more than a tick.
    ///
    /// # Errors
    /// Commands that are not finite.
    pub fn advance(&mut self, seconds: f32, mut steering: Steering) -> Result<(), ViewerError> {
        self.times = Times::default();
        self.clock += f64::from(seconds.max(0.0)) * f64::from(self.fps());
        while (self.ticks + 1) as f64 <= self.clock {
            self.tick(&mut steering)?;
        }
        self.show((self.clock - self.ticks as f64) as f32);
        Ok(())
    }

    fn tick(&mut self, steering: &mut Steering) -> Result<(), ViewerError> {
        let start = Instant::now();
        self.steers_by_mouse = matches!(steering, Steering::Mouse { .. });
        let object = *self.actors[0].controller.state().object();
        self.command = match steering {
            Steering::Command(command) => *command,
            Steering::Mouse { pointer, buttons } => self.mouse.command(&object, *pointer, *buttons),
            Steering::Script(script) => script(self.seconds(), &object),
        };
        let (leader, command) = (object.root(), self.command);
        for (i, actor) in self.actors.iter_mut().enumerate() {
            let follower = actor.controller.state().object().root();
            let command = match i {
                0 => command,
                _ => crowd::follow(leader, &command, follower, actor.place),
            };
            actor.before = actor.controller.state().root();
            actor.controller.step(&command)?;
        }
        let moved = Instant::now();
        let wind = self.wind;
        self.actors
            .par_iter_mut()
            .try_for_each(|actor| actor.figure.step(actor.controller.pose(), wind))?;
        self.times.motion_s += (moved - start).as_secs_f32();
        self.times.garment_s += moved.elapsed().as_secs_f32();
        self.times.ticks += 1;
        self.ticks += 1;
        Ok(())
    }

    fn show(&mut self, share: f32) {
        self.share = share;
        self.actors
            .par_iter_mut()
            .for_each(|actor| actor.figure.interpolate(share));
    }

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
