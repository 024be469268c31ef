//! Pictures of the frames in which a model has its largest errors.

use super::frame_comparison::{FrameComparison, distances, heat_scale, skinned};
use crate::{
    pictures::{CLOTH, GAP, Renderer, Snapshot},
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
use unic_raster::{Colouring, Image, grid, heat_colours};

/// Number of columns of a sheet, one frame each.
const FRAMES: usize = 6;

/// Draws a sheet `CLIP.png` for each clip, with the model's worst frames of free running.
///
/// Rows show the simulation, the model and skinning of the rest shape. Errors are colours on one
/// scale for the whole sheet.
pub(crate) struct Gallery<'a> {
    capture: &'a Capture,
    folder: PathBuf,
    /// Clip that is being measured. `None` between clips.
    clip: Option<(PreparedClip, WorstFrames)>,
}

impl<'a> Gallery<'a> {
    /// Creates a gallery that writes into `folder`, and the folder if it does not exist.
    ///
    /// # Errors
    /// A folder that cannot be created.
    pub(crate) fn create(capture: &'a Capture, folder: &Path) -> Result<Self> {
        fs::create_dir_all(folder)
            .map_err(|e| anyhow!("{}: cannot create the folder: {e}", folder.display()))?;
        Ok(Self {
            capture,
            folder: folder.to_path_buf(),
            clip: None,
        })
    }

    /// Handles an event of the evaluation. Draws the sheet when a clip is finished.
    ///
    /// # Errors
    /// A sheet that cannot be drawn or written.
    pub(crate) fn observe(&mut self, event: &Event) -> Result<(), PredictorError> {
        match *event {
            Event::ClipStarted { clip, .. } => {
                self.clip = Some((clip.clone(), WorstFrames::new(FRAMES, clip.len())));
            }
            Event::Predicted {
                predictor: MODEL,
                mode: Mode::FreeRunning,
                frame,
                positions,
            } => {
                // Positions are copied for frames that are among the worst so far.
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
        let columns: Vec<SheetColumn> = (worst.iter())
            .map(|frame| SheetColumn::new(self.capture, clip, frame))
            .collect();
        // The camera is placed by the truth, so that a diverged prediction does not move it.
        let truths: Vec<Snapshot> = columns.iter().map(|c| c.comparison.truth.clone()).collect();
        let (character, garment) = (&self.capture.character, &self.capture.garment);
        let renderer = Renderer::new(character, garment, clip.captured.clip.ground_height, &truths)?;
        let scale = heat_scale(columns.iter().map(|c| &c.comparison));
        let mut tiles = Vec::new();
        for row in [SheetRow::Truth, SheetRow::Model, SheetRow::Skinning] {
            for column in &columns {
                tiles.push(column.tile(row, &renderer, scale)?);
            }
        }
        // The colour bar goes into the first picture that has error colours: that of the model.
        if let Some(first) = tiles.get_mut(columns.len()) {
            first.draw_colour_bar(10, first.height() as i32 - 34, 120, 1, scale);
        }
        let path = self.folder.join(format!("{}.png", clip.name()));
        Ok(grid(&tiles, columns.len(), GAP)?.save_png(path)?)
    }
}

/// Row of a sheet.
#[derive(Clone, Copy)]
enum SheetRow {
    Truth,
    Model,
    Skinning,
}

/// Column of a sheet: one frame of the clip.
struct SheetColumn {
    comparison: FrameComparison,
    /// Garment vertices by skinning of the rest shape, metres.
    skinning: Vec<Vec3>,
}

impl SheetColumn {
    fn new(capture: &Capture, clip: &PreparedClip, worst: &WorstFrame) -> Self {
        Self {
            comparison: FrameComparison::new(capture, clip, worst.frame, &worst.positions),
            skinning: skinned(capture, clip, worst.frame),
        }
    }

    /// Draws the picture of one row. `scale` is the error in metres at the end of the colour scale.
    fn tile(&self, row: SheetRow, renderer: &Renderer, scale: f32) -> Result<Image> {
        let truth = &self.comparison.truth;
        let (name, garment) = match row {
            SheetRow::Truth => {
                let caption = format!("truth at {:.2} s", self.comparison.seconds);
                return renderer.picture(truth, CLOTH, &caption);
            }
            SheetRow::Model => ("model", &self.comparison.model),
            SheetRow::Skinning => ("skinning", &self.skinning),
        };
        let colours = heat_colours(&distances(garment, &truth.garment), scale);
        let snapshot = self.comparison.with_garment(garment);
        let caption = format!("{name} {:.1} mm", 1e3 * rmse(garment, &truth.garment));
        renderer.picture(&snapshot, Colouring::PerVertex(&colours), &caption)
    }
}
