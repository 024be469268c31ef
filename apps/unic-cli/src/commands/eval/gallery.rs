//! Pictures of the frames that a model gets most wrong.

use super::moment::{Moment, distances, heat_scale, skinned};
use crate::{
    pictures::{CLOTH, GAP, Shot, Studio},
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
        let truths: Vec<Shot> = columns.iter().map(|c| c.moment.truth.clone()).collect();
        let (character, garment) = (&self.capture.character, &self.capture.garment);
        let studio = Studio::new(character, garment, clip.captured.clip.ground_height, &truths)?;
        let scale = heat_scale(columns.iter().map(|c| &c.moment));
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

/// One frame of the sheet.
struct Column {
    moment: Moment,
    skinning: Vec<Vec3>,
}

impl Column {
    fn new(capture: &Capture, clip: &PreparedClip, worst: &WorstFrame) -> Self {
        Self {
            moment: Moment::new(capture, clip, worst.frame, &worst.positions),
            skinning: skinned(capture, clip, worst.frame),
        }
    }

    fn tile(&self, row: Row, studio: &Studio, scale: f32) -> Result<Image> {
        let truth = &self.moment.truth;
        let (name, garment) = match row {
            Row::Truth => {
                return studio.picture(truth, CLOTH, &format!("truth at {:.2} s", self.moment.seconds));
            }
            Row::Model => ("model", &self.moment.model),
            Row::Skinning => ("skinning", &self.skinning),
        };
        let colours = heat_colours(&distances(garment, &truth.garment), scale);
        let shot = self.moment.with_garment(garment);
        let caption = format!("{name} {:.1} mm", 1e3 * rmse(garment, &truth.garment));
        studio.picture(&shot, Colouring::PerVertex(&colours), &caption)
    }
}
