//! Units, axes and time of a stage.

use super::{stage::fault, value};
use crate::{
    fault::Fault,
    request::{Assumed, Up},
    unit_words::{note_conversions, unit_name},
};
use glam::{DMat3, DMat4, DVec3};
use openusd::usd::Stage;

/// The format's own unit for files that state none, metres.
const DEFAULT_UNIT: f64 = 0.01;
/// The format's own rate for files that state none.
const DEFAULT_RATE: f64 = 24.0;

/// Conversion of a stage to metres, Y up and seconds.
pub(super) struct Conversion {
    pub(super) metres_y_up: DMat4,
    /// Time codes in a second.
    pub(super) codes_per_second: f64,
    /// Frames per second, where the file states them or they are asked for.
    pub(super) fps: Option<f64>,
    /// Unit and axis, for people.
    pub(super) description: String,
    pub(super) notes: Vec<String>,
}

impl Conversion {
    /// Reads the metadata of a stage; what it does not state is assumed.
    pub(super) fn of(stage: &Stage, assumed: Assumed) -> Result<Self, Fault> {
        let mut notes = Vec::new();
        let unit = unit(stage, assumed, &mut notes)?;
        let up = up(stage, assumed)?;
        let (turn, letter) = match up {
            Up::Y => (DMat3::IDENTITY, "Y"),
            // Exact, where a rotation by an angle is rounded.
            Up::Z => (DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y), "Z"),
        };
        note_conversions(unit, letter, &mut notes);
        let stated = |field| number(stage, field);
        let (codes, frames) = (stated("timeCodesPerSecond")?, stated("framesPerSecond")?);
        let fps = frames.or(codes).or(assumed.fps.map(f64::from));
        Ok(Self {
            metres_y_up: DMat4::from_mat3(turn * unit),
            codes_per_second: codes.or(fps).unwrap_or(DEFAULT_RATE),
            fps,
            description: format!("{}, {letter} up", unit_name(unit)),
            notes,
        })
    }
}

fn unit(stage: &Stage, assumed: Assumed, notes: &mut Vec<String>) -> Result<f64, Fault> {
    let stated = number(stage, "metersPerUnit")?;
    match (stated, assumed.metres_per_unit) {
        (Some(unit), asked) => {
            // A single-precision 0.01 is the number that was asked for too.
            if let Some(asked) = asked.filter(|asked| *asked != unit as f32) {
                notes.push(format!(
                    "the file states {}, not units of {asked} m",
                    unit_name(unit)
                ));
            }
            Ok(unit)
        }
        // Written with the fewest digits, as it was asked for: 0.01 is not single-precision 0.01.
        (None, Some(asked)) => Ok(asked.to_string().parse().unwrap_or(f64::from(asked))),
        (None, None) => {
            notes.push("the file states no unit: the format's own is taken, centimetres".into());
            Ok(DEFAULT_UNIT)
        }
    }
}

fn up(stage: &Stage, assumed: Assumed) -> Result<Up, Fault> {
    let stated = stage.stage_metadata("upAxis").map_err(fault)?;
    match stated.and_then(value::token).as_deref() {
        Some("Y") => Ok(Up::Y),
        Some("Z") => Ok(Up::Z),
        Some(other) => Err(Fault::new("Y or Z as the up axis", other)),
        None => Ok(assumed.up.unwrap_or(Up::Y)),
    }
}

/// Number above zero of the stage's metadata.
fn number(stage: &Stage, field: &str) -> Result<Option<f64>, Fault> {
    let stated = stage.stage_metadata(field).map_err(fault)?;
    match stated.and_then(value::number) {
        Some(number) if number.is_finite() && number > 0.0 => Ok(Some(number)),
        Some(other) => Err(Fault::new(format!("{field} above 0"), other.to_string())),
        None => Ok(None),
    }
}
