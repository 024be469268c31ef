//! A clip in motion: the simulation, the model and skinning side by side.

use super::{Drawing, heat, words::millimetres};
use crate::{
    commands::eval::moment::{Moment, skinned},
    pictures::{CLOTH, Framing, Paint, SKIN, Shot, Studio, evenly_spread},
    worst_frames::rmse,
};
use anyhow::Result;
use glam::Vec3;
use unic_eval::PreparedClip;
use unic_io::Capture;
use unic_report::{Frame, Movie, Picture, PictureFormat, View};
use unic_viewer::{Image, encode_gif};

/// Pixels of one view.
const VIEW: [u32; 2] = [344, 464];
/// The same in a GIF, with captions, for where a page cannot go: about 30 kB a frame.
const SMALL_VIEW: [u32; 2] = [240, 324];
/// Most frames of a GIF.
const MOST_SMALL_FRAMES: usize = 75;
const NAMES: [&str; 3] = ["simulation", "unic", "skinning"];
const INK: [u8; 3] = [70, 72, 76];
/// Most frames of all movies of a page together, and most seconds of one.
const MOST_FRAMES: usize = 270;
const MOST_SECONDS: f32 = 6.0;
/// Bytes that all movies of a page may have, encoded as text a third more.
const MOVIE_BYTES: usize = 7_200_000;
/// Qualities to choose from, the best first.
const QUALITIES: [u8; 6] = [86, 80, 74, 66, 56, 44];
/// Frames that the camera and the quality are chosen by.
const CAMERA_PROBES: usize = 16;
const QUALITY_PROBES: usize = 3;

/// The frames of a clip that a movie shows.
pub(super) struct Film {
    clip: PreparedClip,
    frames: Vec<usize>,
    fps: f32,
    most_bytes: usize,
    /// The model's positions in those of `frames` that have passed.
    kept: Vec<Vec<Vec3>>,
}

impl Film {
    /// Of a clip; `films` share the page. A long clip is shown by its end, where drift would show.
    pub(super) fn new(clip: &PreparedClip, films: usize) -> Self {
        let fps = clip.captured.clip.fps;
        let (frames, stride) = excerpt(clip.len(), fps, MOST_FRAMES / films.max(1));
        Self {
            clip: clip.clone(),
            frames,
            fps: fps / stride as f32,
            most_bytes: MOVIE_BYTES / films.max(1),
            kept: Vec::new(),
        }
    }

    pub(super) fn clip_name(&self) -> &str {
        self.clip.name()
    }

    /// A frame of the model; frames come in order.
    pub(super) fn keep(&mut self, frame: usize, positions: &[Vec3]) {
        if self.frames.get(self.kept.len()) == Some(&frame) {
            self.kept.push(positions.to_vec());
        }
    }

    fn moment(&self, capture: &Capture, k: usize) -> Moment {
        Moment::new(capture, &self.clip, self.frames[k], &self.kept[k])
    }

    /// Of the frames of error maps.
    pub(super) fn moments(&self, capture: &Capture) -> Vec<Moment> {
        let truth = |k: usize| self.clip.captured.garment.frame(self.frames[k]);
        let errors: Vec<f64> = (0..self.kept.len())
            .map(|k| rmse(&self.kept[k], truth(k)))
            .collect();
        let chosen = heat::frames(&errors);
        chosen.into_iter().map(|k| self.moment(capture, k)).collect()
    }

    /// Draws it.
    pub(super) fn movie(&self, capture: &Capture, drawing: &mut Drawing) -> Result<Movie> {
        let stage = Stage::new(self, capture, VIEW)?;
        let quality = stage.quality()?;
        let count = self.kept.len();
        let mut frames = Vec::with_capacity(count);
        for k in 0..count {
            drawing(self.clip.name(), k, count)?;
            frames.push(stage.take(k)?.frame(quality)?);
        }
        let view = |name: &str, series| View {
            name: name.into(),
            series,
        };
        Ok(Movie {
            title: self.clip.name().to_owned(),
            note: self.note(),
            fps: self.fps,
            // Series of the drift chart: the model comes first there, skinning second.
            views: vec![
                view("simulation", None),
                view("model", Some(0)),
                view("skinning", Some(1)),
            ],
            frames,
        })
    }

    /// Draws it as a GIF.
    pub(super) fn gif(&self, capture: &Capture, drawing: &mut Drawing) -> Result<Vec<u8>> {
        let stage = Stage::new(self, capture, SMALL_VIEW)?;
        let stride = self.kept.len().div_ceil(MOST_SMALL_FRAMES).max(1);
        let mut images = Vec::new();
        for k in (0..self.kept.len()).step_by(stride) {
            drawing(self.clip.name(), k, self.kept.len())?;
            images.push(stage.take(k)?.captioned());
        }
        Ok(encode_gif(&images, self.fps / stride as f32)?)
    }

    fn note(&self) -> String {
        let motion = &self.clip.captured.clip;
        let whole = motion.len() as f32 / motion.fps;
        let shown = self.frames.len() as f32 / self.fps;
        let part = match shown + 2.0 / self.fps < whole {
            true => format!("The last {shown:.1} s of {whole:.1} s of free running"),
            false => format!("{shown:.1} s of free running from the first frame alone"),
        };
        format!(
            "{part}; {:.0} frames a second. RMSE of the frame in mm.",
            self.fps
        )
    }
}

/// Frames to show, from 1 on, and the stride between them.
fn excerpt(len: usize, fps: f32, most: usize) -> (Vec<usize>, usize) {
    let window = (MOST_SECONDS * fps).ceil().max(1.0) as usize;
    let first = len.saturating_sub(window).max(1);
    let stride = (len - first.min(len)).div_ceil(most.max(1)).max(1);
    ((first..len).step_by(stride).collect(), stride)
}

/// Where a film is drawn.
struct Stage<'a> {
    film: &'a Film,
    capture: &'a Capture,
    studio: Studio<'a>,
    view: [u32; 2],
}

/// A frame before it is encoded.
struct Take {
    image: Image,
    seconds: f32,
    /// Metres.
    model: f64,
    skinning: f64,
}

impl<'a> Stage<'a> {
    fn new(film: &'a Film, capture: &'a Capture, view: [u32; 2]) -> Result<Self> {
        let probes = probes(film.kept.len(), CAMERA_PROBES);
        let shots: Vec<Shot> = probes.map(|k| film.moment(capture, k).truth).collect();
        let ground = film.clip.captured.clip.ground_height;
        let (character, garment) = (&capture.character, &capture.garment);
        Ok(Self {
            film,
            capture,
            studio: Studio::close(character, garment, ground, &shots, (Framing::Figure, view))?,
            view,
        })
    }

    fn take(&self, k: usize) -> Result<Take> {
        let moment = self.film.moment(self.capture, k);
        let skinning = skinned(self.capture, &self.film.clip, self.film.frames[k]);
        let truth = &moment.truth.garment;
        let [width, height] = self.view;
        let mut image = Image::filled(3 * width, height, [0; 3])?;
        let paint = Paint {
            skin: SKIN,
            cloth: CLOTH,
        };
        for (i, garment) in [truth, &moment.model, &skinning].into_iter().enumerate() {
            let view = self.studio.draw(&moment.with_garment(garment), paint)?;
            image.draw_image((i as u32 * width) as i32, 0, &view);
        }
        Ok(Take {
            image,
            seconds: moment.seconds,
            model: rmse(&moment.model, truth),
            skinning: rmse(&skinning, truth),
        })
    }

    /// The best quality at which a few frames promise that the film stays within its bytes.
    fn quality(&self) -> Result<u8> {
        let count = self.film.kept.len();
        let takes = probes(count, QUALITY_PROBES).map(|k| self.take(k));
        let takes = takes.collect::<Result<Vec<_>>>()?;
        for quality in QUALITIES {
            let bytes = takes
                .iter()
                .map(|take| Ok(take.image.encode_jpeg(quality)?.len()));
            if bytes.sum::<Result<usize>>()? * count <= self.film.most_bytes * takes.len() {
                return Ok(quality);
            }
        }
        // The page thins what is still too large.
        Ok(QUALITIES[QUALITIES.len() - 1])
    }
}

impl Take {
    /// With the name of each view, and its error below.
    fn captioned(mut self) -> Image {
        let width = self.image.width() as usize / NAMES.len();
        let errors = [None, Some(self.model), Some(self.skinning)];
        for (i, (name, error)) in NAMES.into_iter().zip(errors).enumerate() {
            let left = (i * width) as i32 + 8;
            self.image.draw_text(left, 8, 2, INK, name);
            if let Some(error) = error {
                self.image
                    .draw_text(left, 28, 1, INK, &format!("{} off", millimetres(error)));
            }
        }
        self.image
    }

    fn frame(&self, quality: u8) -> Result<Frame> {
        Ok(Frame {
            picture: jpeg(&self.image, quality)?,
            time: format!("{:.2} s", self.seconds),
            values: vec![String::new(), millimetres(self.model), millimetres(self.skinning)],
        })
    }
}

/// Some of `count` frames, spread evenly.
fn probes(count: usize, most: usize) -> impl Iterator<Item = usize> {
    evenly_spread(count, most).into_iter().take(count)
}

/// For the page.
pub(super) fn jpeg(image: &Image, quality: u8) -> Result<Picture> {
    Ok(Picture {
        format: PictureFormat::Jpeg,
        bytes: image.encode_jpeg(quality)?,
        width: image.width(),
        height: image.height(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excerpts_end_with_the_clip_and_hold_few_frames() {
        let (frames, stride) = excerpt(150, 30.0, 90);
        assert_eq!((frames[0], stride, frames.len()), (1, 2, 75));
        let (frames, stride) = excerpt(3000, 60.0, 90);
        assert_eq!((frames[0], stride, frames.len()), (2640, 4, 90));
        assert_eq!(excerpt(2, 30.0, 90).0, [1]);
        assert!(excerpt(1, 30.0, 90).0.is_empty());
    }
}
