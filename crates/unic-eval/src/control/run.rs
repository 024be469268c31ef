//! Runs of a controller under a script, tick by tick.

use super::script::{Player, Script};
use glam::Vec3;
use unic_core::{
    Pose,
    motion_matching::{Command, Controller, ControllerError, RootFrame, StepReport},
    transform::Rigid,
};

/// One tick of a run.
#[derive(Clone, Debug)]
pub struct Tick {
    /// Command of the tick.
    pub command: Command,
    /// Root frame of the simulated object.
    pub object: RootFrame,
    /// Root frame of the character as shown.
    pub root: RootFrame,
    /// Pose as shown.
    pub pose: Pose,
    /// World positions of the joints as shown, metres.
    pub joints: Vec<Vec3>,
    /// Feet that are locked: left and right.
    pub locked: [bool; 2],
    /// Frame of the database that plays.
    pub frame: usize,
    /// Events.
    pub report: StepReport,
}

/// Run of one script.
#[derive(Clone, Debug)]
pub struct ControlRun {
    /// Script.
    pub script: Script,
    /// Ticks a second.
    pub fps: f32,
    /// Ticks.
    pub ticks: Vec<Tick>,
    /// Normalised features of every search.
    pub queries: Vec<Vec<f32>>,
}

impl ControlRun {
    /// Runs a script from rest. The same script and seed give the same bytes.
    ///
    /// # Errors
    /// A command that is not finite, which no script gives.
    pub fn new(controller: &mut Controller, script: Script, seed: u64) -> Result<Self, ControllerError> {
        controller.reset(RootFrame::default());
        let fps = controller.database().fps();
        let mut player = Player::new(script, seed);
        let mut run = Self {
            script,
            fps,
            ticks: Vec::new(),
            queries: Vec::new(),
        };
        for tick in 0..(script.seconds() * fps) as usize {
            let command = player.command(tick as f32 / fps, controller.state().object());
            let report = controller.step(&command)?;
            if report.search != unic_core::motion_matching::SearchOutcome::NotDue {
                run.queries.push(controller.query().to_vec());
            }
            run.ticks.push(recorded(controller, command, report));
        }
        Ok(run)
    }
}

fn recorded(controller: &Controller, command: Command, report: StepReport) -> Tick {
    let mut world: Vec<Rigid> = Vec::new();
    let skeleton = controller.database().skeleton();
    skeleton.forward_kinematics(controller.pose(), &mut world);
    Tick {
        command,
        object: controller.state().object().root(),
        root: controller.state().root(),
        pose: controller.pose().clone(),
        joints: world.iter().map(|joint| joint.translation).collect(),
        locked: controller.locked_feet(),
        frame: controller.state().frame(),
        report,
    }
}
