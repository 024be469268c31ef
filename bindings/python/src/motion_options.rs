//! Options of reading motion, with the meanings of `unic animate`.

use crate::{error::Result, names::choose};
use pyo3::{exceptions::PyTypeError, prelude::*, types::PyDict};
use std::path::PathBuf;
use unic_io::{BoneMap, FootLock, GroundPlacement, LowPass, MotionOptions, Repeat, UpAxis};

/// Keyword arguments of `Motion.load`.
pub(crate) struct Options {
    pub(crate) reading: MotionOptions,
    pub(crate) findings: Findings,
}

/// Answer to probable mistakes in a motion.
#[derive(Clone, Copy)]
pub(crate) enum Findings {
    /// They are errors.
    Refuse,
    /// They are notes.
    Note,
}

impl Options {
    /// Reads the arguments that are given. The frame rate is `fps` unless they have one.
    ///
    /// # Errors
    /// An argument of no known name or of another type, a name that is no choice, a map of bones that
    /// cannot be read.
    pub(crate) fn read(fps: Option<f32>, arguments: Option<&Bound<'_, PyDict>>) -> Result<Self> {
        let mut options = Self {
            reading: MotionOptions {
                fps,
                ..MotionOptions::default()
            },
            findings: Findings::Refuse,
        };
        for (name, value) in arguments.into_iter().flatten() {
            options.set(&name.extract::<String>()?, &value)?;
        }
        Ok(options)
    }

    fn set(&mut self, name: &str, value: &Bound<'_, PyAny>) -> Result<()> {
        let reading = &mut self.reading;
        let word = || value.extract::<String>();
        match name {
            // The frame rate of the model stays where none is given.
            "fps" => reading.fps = value.extract::<Option<f32>>()?.or(reading.fps),
            "fps_of_file" => reading.fps_of_file = value.extract()?,
            "metres_per_unit" => reading.metres_per_unit = value.extract()?,
            "up" => reading.up = choose(name, &word()?, &UP)?,
            "ground" => reading.ground = choose(name, &word()?, &GROUND)?,
            "feet" => reading.feet = choose(name, &word()?, &FEET)?,
            "low_pass" => {
                reading.low_pass = match value.extract::<Option<f32>>()? {
                    None => LowPass::Auto,
                    Some(0.0) => LowPass::Off,
                    Some(hertz) => LowPass::Hertz(hertz),
                }
            }
            "repeat" => {
                let repeat = |times| Repeat {
                    times,
                    ..Repeat::default()
                };
                reading.repeat = value.extract::<Option<usize>>()?.map(repeat);
            }
            "bone_map" => {
                let path = value.extract::<Option<PathBuf>>()?;
                reading.bones = path.map_or_else(|| Ok(BoneMap::default()), |path| BoneMap::read(&path))?;
            }
            "force" if value.extract()? => self.findings = Findings::Note,
            "force" => self.findings = Findings::Refuse,
            _ => {
                let text = format!("load() got an unexpected keyword argument '{name}'");
                return Err(PyTypeError::new_err(text).into());
            }
        }
        Ok(())
    }
}

const UP: [(&str, UpAxis); 3] = [("auto", UpAxis::Auto), ("y", UpAxis::Y), ("z", UpAxis::Z)];

const GROUND: [(&str, GroundPlacement); 3] = [
    ("auto", GroundPlacement::Auto),
    ("keep", GroundPlacement::Keep),
    ("on_ground", GroundPlacement::OnGround),
];

const FEET: [(&str, FootLock); 3] = [
    ("auto", FootLock::Auto),
    ("keep", FootLock::Keep),
    ("hold", FootLock::Hold),
];
