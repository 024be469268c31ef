//! Files of all predicted positions, for pictures and for metrics of other programs.

use crate::{
    event::Event,
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

/// Writes all predictions of an evaluation: one file `CLIP.npz` for each clip, in one folder.
///
/// A file has an array (T, V, 3) f32 of world positions in metres for each predictor and mode, such
/// as `ridge.free_running`, and the array `truth`. Frame 0 is the true one in all of them.
///
/// Memory holds one array at a time: frames are first written to temporary files in the folder.
#[derive(Debug)]
pub struct Dump {
    folder: PathBuf,
    clip: Option<OpenClip>,
}

/// Clip under evaluation.
#[derive(Debug)]
struct OpenClip {
    /// Path of the npz file.
    target: PathBuf,
    /// Folder of one npy file for each array.
    spool: TemporaryFolder,
    /// True positions of frame 0.
    first: Vec<Vec3>,
    /// Open npy file of each array, by name.
    arrays: IndexMap<String, VertexFramesWriter>,
}

impl Dump {
    /// Starts to write into a folder, which is made where it does not exist.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn create(folder: &Path) -> std::io::Result<Self> {
        std::fs::create_dir_all(folder)?;
        Ok(Self {
            folder: folder.to_path_buf(),
            clip: None,
        })
    }

    /// Handles an event. Call it from the observer of [`evaluate`](crate::evaluate()).
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
                    arrays: IndexMap::new(),
                };
                // The truth comes first, so that it is the first array of the file. Frame 0 is
                // written when an array begins.
                for frame in 1..clip.len() {
                    open.push("truth".to_owned(), garment.frame(frame))?;
                }
                self.clip = Some(open);
                Ok(())
            }
            Event::Predicted {
                predictor,
                mode,
                positions,
                ..
            } => match &mut self.clip {
                Some(clip) => clip.push(array_name(predictor, mode), positions),
                None => Ok(()),
            },
            Event::Progress { .. } => Ok(()),
            Event::ClipFinished => self.clip.take().map_or(Ok(()), OpenClip::finish),
        }
    }
}

/// Returns the name of an array in the npz file.
fn array_name(predictor: &str, mode: Mode) -> String {
    format!("{predictor}.{}", mode.name())
}

impl OpenClip {
    /// Appends a frame to an array.
    fn push(&mut self, array: String, positions: &[Vec3]) -> Result<(), PredictorError> {
        let spooled = self.spool(array, positions);
        Ok(spooled.map_err(|error| error.with_path(&self.target))?)
    }

    /// Appends a frame to the npy file of an array, which begins with frame 0.
    fn spool(&mut self, array: String, positions: &[Vec3]) -> unic_io::Result<()> {
        if !self.arrays.contains_key(&array) {
            let path = self.spool.path().join(format!("{array}.npy"));
            let mut frames = VertexFramesWriter::create(&path, self.first.len())?;
            frames.push(&self.first)?;
            self.arrays.insert(array.clone(), frames);
        }
        if let Some(frames) = self.arrays.get_mut(&array) {
            frames.push(positions)?;
        }
        Ok(())
    }

    /// Writes the npz file.
    fn finish(self) -> Result<(), PredictorError> {
        let target = self.target.clone();
        Ok(self.pack().map_err(|error| error.with_path(&target))?)
    }

    /// Moves the arrays from their npy files to the npz file.
    fn pack(self) -> unic_io::Result<()> {
        let mut npz = NpzWriter::create(&self.target)?;
        for (array, frames) in self.arrays {
            let path = self.spool.path().join(format!("{array}.npy"));
            frames.finish()?;
            let array_of_frames = read_npy::<f32>(&path, &[Dim::Any("T"), Dim::Any("V"), Dim::Is(3)])?;
            npz.f32s(&array, &array_of_frames.shape, &array_of_frames.data)?;
            // Removing the file now limits the disk space in use. Where that fails, the folder is
            // removed later.
            let _ = std::fs::remove_file(&path);
        }
        npz.finish()
    }
}
