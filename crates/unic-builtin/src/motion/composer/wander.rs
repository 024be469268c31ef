//! Walks after a pointer that jumps about: the movements that a player asks for.

use super::{CLOSING_STEP_S, Composer};
use crate::motion::channel::{Channel, Interval};
use glam::Vec2;
use std::f64::consts::PI;
use unic_core::motion_matching::{
    Command, Facing, MouseButtons, MouseControl, RootFrame, SimulatedObject, Spring, direction_of, wrapped,
};

/// Steps a second of the walk.
const RATE: f32 = 60.0;
/// Half-lives of the springs of the velocity and of the heading, seconds: those of a controller
/// with the standard settings.
const VELOCITY_HALF_LIFE_S: f32 = 0.22;
const YAW_HALF_LIFE_S: f32 = 0.26;
/// Time at the end without a pointer, in which the character comes to a stand, seconds.
const STOP_S: f64 = 2.0;
/// Largest speeds, m/s: of walks towards the place that is faced, and of others.
const TURNED_SPEED_M_S: f32 = 2.0;
const UNTURNED_SPEED_M_S: f32 = 0.6;

impl Composer {
    pub(in crate::motion) fn wander(&mut self, seconds: f64) {
        let steps = ((seconds + STOP_S) * f64::from(RATE)) as usize;
        let mut pointer = Pointer::default();
        let mut object = SimulatedObject::at_rest(RootFrame::default());
        let [mut speed, mut strafe, mut turn_rate] = [(); 3].map(|()| Vec::with_capacity(steps + 1));
        for step in 0..=steps {
            let ahead = direction_of(object.yaw.value);
            let left = Vec2::new(ahead.y, -ahead.x);
            speed.push(object.motion.velocity.dot(ahead).into());
            strafe.push(object.motion.velocity.dot(left).into());
            turn_rate.push(object.yaw.rate.into());
            let t = step as f64 / f64::from(RATE);
            let command = match t < seconds {
                true => pointer.command(self, t, &object),
                false => Command::STAND,
            };
            advance(&mut object, &command);
        }
        let interval = Interval::new(self.now, self.now + steps as f64 / f64::from(RATE));
        self.gestures.samples(Channel::Speed, interval, speed);
        self.gestures.samples(Channel::Strafe, interval, strafe);
        self.gestures.samples(Channel::TurnRate, interval, turn_rate);
        self.now = interval.end + CLOSING_STEP_S;
    }
}

/// Follows a command for a step, by critically damped springs.
fn advance(object: &mut SimulatedObject, command: &Command) {
    let dt = 1.0 / RATE;
    let velocity = Spring::of_half_life(VELOCITY_HALF_LIFE_S);
    object.motion = velocity.drive(object.motion, command.velocity, dt);
    if let Facing::Yaw(yaw) = command.facing {
        object.goal_yaw = yaw;
    }
    let goal = object.yaw.value + wrapped(object.goal_yaw - object.yaw.value);
    object.yaw = Spring::of_half_life(YAW_HALF_LIFE_S).toward(object.yaw, goal, dt);
}

/// Pointer that jumps to places at random.
struct Pointer {
    mouse: MouseControl,
    place: Vec2,
    buttons: MouseButtons,
    /// Time at which it moves on, seconds.
    until: f64,
}

impl Default for Pointer {
    fn default() -> Self {
        Self {
            mouse: MouseControl::new(TURNED_SPEED_M_S),
            place: Vec2::ZERO,
            buttons: MouseButtons::Released,
            until: 0.0,
        }
    }
}

impl Pointer {
    fn command(&mut self, composer: &mut Composer, t: f64, object: &SimulatedObject) -> Command {
        if t >= self.until {
            self.jump(composer, t, object);
        }
        self.mouse.command(object, self.place, self.buttons)
    }

    fn jump(&mut self, composer: &mut Composer, t: f64, object: &SimulatedObject) {
        let random = &mut composer.random;
        self.until = t + random.between(0.8, 2.4);
        let yaw = random.between(-PI, PI) as f32;
        let distance = random.between(0.5, 4.0) as f32;
        self.place = object.root().position + direction_of(yaw) * distance;
        (self.buttons, self.mouse.top_speed_m_s) = match random.below(8) {
            0 => (MouseButtons::Released, TURNED_SPEED_M_S),
            1 | 2 => (MouseButtons::Left, UNTURNED_SPEED_M_S),
            _ => (
                MouseButtons::LeftAndRight,
                random.between(1.0, TURNED_SPEED_M_S.into()) as f32,
            ),
        };
    }
}
