//! The command `unic play`: a dressed character that is steered.

mod costumes;
mod record;

use crate::{
    args::{PlayArgs, Switch},
    failure::Usage,
    output::print_status,
};
use anyhow::Result;
use costumes::Wardrobe;
use unic_core::motion_matching::ControllerSettings;
use unic_viewer::{AdapterKind, Material, PlaySettings, Settling, ViewerError, play_in_window};

/// Opens the window, or records a movie.
///
/// # Errors
/// Unusable options or inputs, no window, an interruption.
pub(crate) fn run(args: &PlayArgs) -> Result<()> {
    record::check(args)?;
    let wardrobe = Wardrobe::read(args)?;
    let settings = Settings {
        characters: args.characters,
        control: ControllerSettings::new(args.responsiveness),
        skin: args.looks.skin(),
        gpu_garments: args.gpu_garments,
        settling: match args.record.record {
            Some(_) => Settling::Whole,
            None => Settling::AtOnce,
        },
    };
    if let Some(path) = &args.record.record {
        return record::run(&args.record, path, wardrobe, settings);
    }
    let played = play_in_window(move |device| settings.play(&wardrobe, Some(device.context())));
    played.map_err(|error| match error {
        // Nothing is wrong with the files: this machine has no window.
        ViewerError::Window(_) => {
            let hint = "`unic play --record FILE.gif` draws without a window";
            Usage(format!("{error}; {hint}")).into()
        }
        error => error.into(),
    })
}

/// Options of a play beside its costumes.
#[derive(Clone, Copy, Debug)]
struct Settings {
    characters: usize,
    control: ControllerSettings,
    skin: Material,
    gpu_garments: Option<Switch>,
    settling: Settling,
}

impl Settings {
    /// Makes the settings of a play on a device, or without one.
    fn play(
        self,
        wardrobe: &Wardrobe,
        device: Option<&unic_viewer::GpuContext>,
    ) -> Result<PlaySettings, ViewerError> {
        let is_for_garments = |context: &&unic_viewer::GpuContext| match self.gpu_garments {
            Some(switch) => switch == Switch::On,
            // A driver on the processor is slower than our own code for it.
            None => AdapterKind::of(context) == AdapterKind::Hardware,
        };
        let device = device.filter(is_for_garments);
        let costumes = match wardrobe.costumes(device) {
            // Nobody has asked for the device.
            Err(error) if device.is_some() && self.gpu_garments.is_none() => {
                print_status(&format!("{error}; the garments are computed on the processor"));
                wardrobe.costumes(None)
            }
            other => other,
        };
        Ok(PlaySettings {
            costumes: costumes?,
            characters: self.characters,
            control: self.control,
            skin: self.skin,
            settling: self.settling,
        })
    }
}
