//! Published protocols of `unic eval --protocol`, and the conversion of their data sets.

use crate::{
    args::{EvalArgs, ProtocolName},
    motion_source::character as character_of,
    output::print_status,
};
use anyhow::{Result, bail};
use std::num::NonZeroUsize;
use unic_eval::{ByMode, Evaluation, Metrics, Mode, Protocol};
use unic_io::{
    Capture, check, counted,
    datasets::{Dataset, convert},
};

/// Number of frames of the VTO protocol (manifold-aware transformers, Eurographics 2024).
const VTO_FRAMES: Option<NonZeroUsize> = NonZeroUsize::new(300);

/// Opens the capture to measure on. With `--as` it is first made from a data set's folder.
///
/// # Errors
/// A capture or data set that cannot be read, a capture that cannot be written.
pub(super) fn capture(args: &EvalArgs) -> Result<Capture> {
    let (Some(name), Some(out), Some(character)) = (args.protocol, &args.made, &args.character) else {
        // Without --as the folder must be a capture. Another one is probably the data set itself.
        if args.protocol.is_some() && args.capture.is_dir() && !args.capture.join("capture.toml").exists() {
            bail!(
                "{}: expected a capture, found a folder without capture.toml; --as CAPTURE --character FILE make one from a data set",
                args.capture.display()
            );
        }
        return Ok(Capture::open(&args.capture)?);
    };
    let dataset = match name {
        ProtocolName::Vto => Dataset::Vto,
        ProtocolName::Virtualbones => Dataset::VirtualBones,
    };
    let file = match character.is_dir() {
        true => character.join("character.npz"),
        false => character.clone(),
    };
    let character = character_of(Some(&file), None)?;
    args.force.check_findings(&file, &check::character(&character))?;
    let converted = convert(dataset, &args.capture, &character, out)?;
    converted.notes.iter().for_each(|note| print_status(note));
    print_status(&format!(
        "{}: {}",
        out.display(),
        counted(converted.clips, "clip")
    ));
    Ok(Capture::open(out)?)
}

/// Modes and frames that a protocol measures.
pub(super) fn of(name: ProtocolName) -> Protocol {
    Protocol {
        modes: &[Mode::FreeRunning],
        frames: match name {
            ProtocolName::Vto => VTO_FRAMES,
            ProtocolName::Virtualbones => None,
        },
        ..Protocol::default()
    }
}

/// Name of a protocol on the command line and in JSON.
pub(super) fn name(name: ProtocolName) -> &'static str {
    match name {
        ProtocolName::Vto => "vto",
        ProtocolName::Virtualbones => "virtualbones",
    }
}

/// Lines with the numbers that publications on the data set give, one per row.
pub(super) fn headline(protocol: ProtocolName, evaluation: &Evaluation) -> String {
    let pooled = &evaluation.pooled;
    let rows = (pooled.model.iter().map(|m| ("model", m)))
        .chain(pooled.baselines.iter().map(|(name, m)| (name.as_str(), m)));
    // Baselines that predict single steps only, such as hold, have no such number.
    let line = |(row, by_mode): (&str, &ByMode)| {
        let metrics = by_mode.free_running.as_ref()?;
        Some(format!("  {row:<16} {}\n", numbers(protocol, metrics)))
    };
    let lines: String = rows.filter_map(line).collect();
    format!("protocol {}, free running:\n{lines}", name(protocol))
}

fn numbers(protocol: ProtocolName, metrics: &Metrics) -> String {
    match protocol {
        ProtocolName::Vto => format!("mean vertex error {:.2} mm", metrics.mean_vertex_error_mm),
        ProtocolName::Virtualbones => format!(
            "RMSE {:.2} mm, Hausdorff distance {:.2} mm",
            metrics.rmse_mm, metrics.hausdorff_mm
        ),
    }
}
