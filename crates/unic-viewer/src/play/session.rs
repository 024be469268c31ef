//! Play without a window: characters, time and what is drawn.

mod dress;
mod scene;

use super::crowd;
use super::settings::{Costume, PlaySettings};
use super::steering::Steering;
use crate::{Figure, Looks, Shading, ViewerError};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::time::Instant;
use unic_core::motion_matching::{Command, Controller, MouseControl, RootFrame, wrapped};

/// Largest speed that the mouse asks for, m/s.
const MOUSE_SPEED_M_S: f32 = 2.0;

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
        let looks = Looks {
            skin: settings.skin,
            cloth: costume.outfit.cloth,
            shading: Shading::Lit,
        };
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
        session.dress(0, session.settings.characters.max(1))?;
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

    /// Dresses all characters in another costume, in which they go on with their motion. Numbers
    /// beyond the last costume begin again. Characters of another skeleton stand where these were.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn wear(&mut self, costume: usize) -> Result<(), ViewerError> {
        let costume = costume % self.settings.costumes.len();
        self.dress(costume, self.characters())?;
        self.looks.cloth = self.costume().outfit.cloth;
        Ok(())
    }

    /// Index of the costume.
    pub fn costume_index(&self) -> usize {
        self.costume
    }

    /// Changes the number of characters, to one at least. New ones start behind the first one.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn set_characters(&mut self, characters: usize) -> Result<(), ViewerError> {
        self.fill(characters.max(1))
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
}
