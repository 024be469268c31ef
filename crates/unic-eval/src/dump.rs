//! Keeping every predicted position, for pictures and for metrics that are not ours.

use crate::{
    evaluate::Event,
    predictor::{Mode, PredictorError},
};
use glam::Vec3;
use indexmap::IndexMap;
use std::path::{Path, PathBuf};
use unic_io::{
    NpzWriter,
    atomic::TemporaryFolder,
    frames::VertexFramesWriter,
    npy::{Dim, read_npy},
};

/// Writes `CLIP.npz` for each clip into a folder: an array (T, V, 3) f32 of world positions in
/// metres a row and mode, named as in `ridge.free_running`, and the truth as `truth`. Frame 0 is
/// the truth's in all of them.
///
/// Frames pass through temporary files in the folder, so that one row of one clip at a time is in
/// memory.
#[derive(Debug)]
pub struct Dump {
    folder: PathBuf,
    clip: Option<OpenClip>,
}

#[derive(Debug)]
struct OpenClip {
    target: PathBuf,
    spool: TemporaryFolder,
    first: Vec<Vec3>,
    rows: IndexMap<String, VertexFramesWriter>,
}

impl Dump {
    /// Into this folder, which is made when there is none.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn create(folder: &Path) -> std::io::Result<Self> {
        std::fs::create_dir_all(folder)?;
        Ok(Self {
            folder: folder.to_path_buf(),
            clip: None,
        })
    }

    /// Takes part in an evaluation; call it from the observer of [`evaluate`](crate::evaluate).
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn observe(&mut self, event: &Event) -> Result<(), PredictorError> {
        match *event {
            Event::ClipStarted { clip, .. } => {
                let garment = &clip.captured.garment;
                let mut open = OpenClip {
                    target: self.folder.join(format!("{}.npz", clip.name())),
                    spool: TemporaryFolder::create_in(&self.folder)?,
                    first: garment.frame(0).to_vec(),
                    rows: IndexMap::new(),
                };
                for frame in 1..clip.len() {
                    open.push("truth".to_owned(), garment.frame(frame))?;
                }
                self.clip = Some(open);
                Ok(())
            }
            Event::Predicted {
                row, mode, positions, ..
            } => match &mut self.clip {
                Some(clip) => clip.push(array_name(row, mode), positions),
                None => Ok(()),
            },
            Event::Progress { .. } => Ok(()),
            Event::ClipFinished => self.clip.take().map_or(Ok(()), OpenClip::finish),
        }
    }
}

fn array_name(row: &str, mode: Mode) -> String {
    format!("{row}.{}", mode.name())
}

impl OpenClip {
    fn push(&mut self, array: String, positions: &[Vec3]) -> Result<(), PredictorError> {
        let spooled = self.spool(array, positions);
        Ok(spooled.map_err(|error| error.of(&self.target))?)
    }

    fn spool(&mut self, array: String, positions: &[Vec3]) -> unic_io::Result<()> {
        if !self.rows.contains_key(&array) {
            let path = self.spool.path().join(format!("{array}.npy"));
            let mut frames = VertexFramesWriter::create(&path, self.first.len())?;
            frames.push(&self.first)?;
            self.rows.insert(array.clone(), frames);
        }
        if let Some(frames) = self.rows.get_mut(&array) {
            frames.push(positions)?;
        }
        Ok(())
    }

    fn finish(self) -> Result<(), PredictorError> {
        let target = self.target.clone();
        Ok(self.pack().map_err(|error| error.of(&target))?)
    }

    fn pack(self) -> unic_io::Result<()> {
        let mut npz = NpzWriter::create(&self.target)?;
        for (array, frames) in self.rows {
            let path = self.spool.path().join(format!("{array}.npy"));
            frames.finish()?;
            let array_of_frames = read_npy::<f32>(&path, &[Dim::Any("T"), Dim::Any("V"), Dim::Is(3)])?;
            npz.f32s(&array, &array_of_frames.shape, &array_of_frames.data)?;
            // Room for the next; what stays goes with the folder.
            let _ = std::fs::remove_file(&path);
        }
        npz.finish()
    }
}
