//! Pictures of the frames that a model gets most wrong.

use crate::{
    pictures::{CLOTH, GAP, Place, Shot, Studio},
    worst_frames::{WorstFrame, WorstFrames, rmse},
};
use anyhow::{Result, anyhow};
use glam::Vec3;
use std::{
    fs,
    path::{Path, PathBuf},
};
use unic_eval::{Event, MODEL, Mode, PredictorError, PreparedClip};
use unic_io::Capture;
use unic_viewer::{Colouring, Image, grid, heat_colours};

/// Columns of a sheet.
const FRAMES: usize = 6;

/// Draws `CLIP.png` for each clip: the truth, the model and skinning of the rest shape below each
/// other, at the model's worst frames of free running. Errors are colours of one scale.
pub(crate) struct Gallery<'a> {
    capture: &'a Capture,
    folder: PathBuf,
    clip: Option<(PreparedClip, WorstFrames)>,
}

impl<'a> Gallery<'a> {
    /// Into this folder, which is made when there is none.
    pub(crate) fn create(capture: &'a Capture, folder: &Path) -> Result<Self> {
        fs::create_dir_all(folder)
            .map_err(|e| anyhow!("{}: cannot create the folder: {e}", folder.display()))?;
        Ok(Self {
            capture,
            folder: folder.to_path_buf(),
            clip: None,
        })
    }

    /// Takes part in an evaluation.
    pub(crate) fn observe(&mut self, event: &Event) -> Result<(), PredictorError> {
        match *event {
            Event::ClipStarted { clip, .. } => {
                self.clip = Some((clip.clone(), WorstFrames::new(FRAMES, clip.len())));
            }
            Event::Predicted {
                row: MODEL,
                mode: Mode::FreeRunning,
                frame,
                positions,
            } => {
                if let Some((clip, worst)) = &mut self.clip {
                    worst.offer(frame, positions, clip.captured.garment.frame(frame));
                }
            }
            Event::Predicted { .. } | Event::Progress { .. } => {}
            Event::ClipFinished => {
                if let Some((clip, worst)) = self.clip.take() {
                    self.draw(&clip, worst.frames())?;
                }
            }
        }
        Ok(())
    }

    fn draw(&self, clip: &PreparedClip, worst: &[WorstFrame]) -> Result<()> {
        let columns: Vec<Column> = worst.iter().map(|w| Column::new(self.capture, clip, w)).collect();
        let truths: Vec<Shot> = columns.iter().map(|c| c.truth.clone()).collect();
        let (character, garment) = (&self.capture.character, &self.capture.garment);
        let studio = Studio::new(character, garment, clip.captured.clip.ground_height, &truths)?;
        let scale = heat_scale(&columns);
        let mut tiles = Vec::new();
        for row in [Row::Truth, Row::Model, Row::Skinning] {
            for column in &columns {
                tiles.push(column.tile(row, &studio, scale)?);
            }
        }
        if let Some(first) = tiles.get_mut(columns.len()) {
            first.draw_colour_bar(10, first.height() as i32 - 34, 120, 1, scale);
        }
        let path = self.folder.join(format!("{}.png", clip.name()));
        Ok(grid(&tiles, columns.len(), GAP)?.save_png(path)?)
    }
}

#[derive(Clone, Copy)]
enum Row {
    Truth,
    Model,
    Skinning,
}

/// One frame, three times.
struct Column {
    seconds: f32,
    truth: Shot,
    model: Vec<Vec3>,
    skinning: Vec<Vec3>,
}

impl Column {
    fn new(capture: &Capture, clip: &PreparedClip, worst: &WorstFrame) -> Self {
        let (character, garment) = (&capture.character, &capture.garment);
        let world_from_rest = clip.kinematics.world_from_rest(worst.frame);
        let mut body = Vec::new();
        match &clip.captured.body {
            Some(frames) => body.extend_from_slice(frames.frame(worst.frame)),
            None => character
                .weights
                .skin(&character.body.vertices, world_from_rest, &mut body),
        }
        let mut skinning = Vec::new();
        garment
            .weights
            .skin(&garment.rest.vertices, world_from_rest, &mut skinning);
        let motion = &clip.captured.clip;
        Self {
            seconds: worst.frame as f32 / motion.fps,
            truth: Shot {
                body,
                garment: clip.captured.garment.frame(worst.frame).to_vec(),
                place: Place::new(&character.skeleton, &motion.poses[worst.frame]),
            },
            model: worst.positions.clone(),
            skinning,
        }
    }

    fn tile(&self, row: Row, studio: &Studio, scale: f32) -> Result<Image> {
        let truth = &self.truth.garment;
        let (name, garment) = match row {
            Row::Truth => {
                return studio.picture(&self.truth, CLOTH, &format!("truth at {:.2} s", self.seconds));
            }
            Row::Model => ("model", &self.model),
            Row::Skinning => ("skinning", &self.skinning),
        };
        let colours = heat_colours(&distances(garment, truth), scale);
        let shot = Shot {
            garment: garment.clone(),
            ..self.truth.clone()
        };
        let caption = format!("{name} {:.1} mm", 1e3 * rmse(garment, truth));
        studio.picture(&shot, Colouring::PerVertex(&colours), &caption)
    }
}

fn distances(a: &[Vec3], b: &[Vec3]) -> Vec<f32> {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).collect()
}

/// Ends of the colour scale to choose from, metres.
const SCALES_M: [f32; 7] = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5];

/// The first that holds 95 % of the model's errors.
fn heat_scale(columns: &[Column]) -> f32 {
    let errors = columns.iter().flat_map(|c| distances(&c.model, &c.truth.garment));
    let mut errors: Vec<f32> = errors.filter(|e| e.is_finite()).collect();
    errors.sort_by(f32::total_cmp);
    let most = errors.get(errors.len() * 95 / 100).copied().unwrap_or(0.0);
    SCALES_M
        .into_iter()
        .find(|&scale| scale >= most)
        .unwrap_or(SCALES_M[SCALES_M.len() - 1])
}
