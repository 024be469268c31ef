//! A clip in motion: the simulation, the model, the strongest baseline and skinning side by side.

use super::{Drawing, footage::Footage, scores, words::millimetres};
use crate::{
    commands::eval::moment::{Moment, skinned},
    pictures::{CLOTH, Framing, Paint, SKIN, Shot, Studio, evenly_spread},
    worst_frames::rmse,
};
use anyhow::Result;
use glam::Vec3;
use unic_io::Capture;
use unic_report::{Frame, Movie, Picture, PictureFormat, View};
use unic_viewer::{Image, encode_gif};

/// Pixels of one view.
const VIEW: [u32; 2] = [300, 404];
/// The same in a GIF, with captions, for where a page cannot go: about 30 kB a frame.
const SMALL_VIEW: [u32; 2] = [196, 264];
/// Most frames of a GIF.
const MOST_SMALL_FRAMES: usize = 75;
const INK: [u8; 3] = [70, 72, 76];
/// Bytes that all movies of a page may have, encoded as text a third more.
const MOVIE_BYTES: usize = 7_200_000;
/// Qualities to choose from, the best first.
const QUALITIES: [u8; 6] = [86, 80, 74, 66, 56, 44];
/// Frames that the camera and the quality are chosen by.
const CAMERA_PROBES: usize = 16;
const QUALITY_PROBES: usize = 3;

/// A clip to be drawn.
pub(super) struct Film<'a> {
    footage: &'a Footage,
    capture: &'a Capture,
    /// The row between the model and skinning.
    rival: &'static str,
    shots: Vec<(Moment, Option<&'a [Vec3]>)>,
}

impl<'a> Film<'a> {
    /// The worst seconds of a clip, or all of it.
    pub(super) fn new(footage: &'a Footage, capture: &'a Capture, rival: &'static str) -> Self {
        Self {
            shots: footage.shots(capture),
            footage,
            capture,
            rival,
        }
    }

    /// Draws it for a page; `films` share the page.
    pub(super) fn movie(&self, films: usize, drawing: &mut Drawing) -> Result<Movie> {
        let stage = Stage::new(self, VIEW)?;
        let quality = stage.quality(MOVIE_BYTES / films.max(1))?;
        let count = self.shots.len();
        let mut frames = Vec::with_capacity(count);
        for k in 0..count {
            drawing(self.footage.clip.name(), k, count)?;
            frames.push(stage.take(k)?.frame(quality)?);
        }
        let view = |name: &str, series| View {
            name: name.into(),
            series,
        };
        Ok(Movie {
            title: self.title(),
            note: self.note(),
            fps: self.footage.fps(),
            views: vec![
                view("simulation", None),
                view("model", Some(scores::MODEL_SERIES)),
                view(&scores::display_name(self.rival), Some(scores::RIVAL_SERIES)),
                view("skinning", Some(scores::SKINNING_SERIES)),
            ],
            frames,
        })
    }

    /// Draws it as a GIF.
    pub(super) fn gif(&self, drawing: &mut Drawing) -> Result<Vec<u8>> {
        let stage = Stage::new(self, SMALL_VIEW)?;
        let stride = self.shots.len().div_ceil(MOST_SMALL_FRAMES).max(1);
        let rival = scores::display_name(self.rival);
        let mut images = Vec::new();
        for k in (0..self.shots.len()).step_by(stride) {
            drawing(self.footage.clip.name(), k, self.shots.len())?;
            images.push(
                stage
                    .take(k)?
                    .captioned(["simulation", "unic", &rival, "skinning"]),
            );
        }
        Ok(encode_gif(&images, self.footage.fps() / stride as f32)?)
    }

    /// Seconds of the movie's first frame, of its end and of the clip's end.
    fn span(&self) -> [f32; 3] {
        let fps = self.footage.clip.captured.clip.fps;
        let window = self.footage.window();
        [window.start, window.end, self.footage.clip.len()].map(|frame| frame as f32 / fps)
    }

    fn is_whole(&self) -> bool {
        self.footage.window().len() + 1 >= self.footage.clip.len()
    }

    fn title(&self) -> String {
        let (name, [from, to, all]) = (self.footage.clip.name(), self.span());
        match self.is_whole() {
            true => format!("{name}, the whole clip of {all:.1} s"),
            false => format!("{name}, {from:.1} s to {to:.1} s of {all:.1} s"),
        }
    }

    fn note(&self) -> String {
        let what = match self.is_whole() {
            true => "Free running from the first frame alone",
            false => "The worst seconds of free running from the clip's first frame alone",
        };
        let fps = self.footage.clip.captured.clip.fps;
        let worst = self.footage.worst().map_or_else(String::new, |(frame, error)| {
            let (seconds, error) = (frame as f32 / fps, millimetres(error));
            format!("; the model's worst frame of the clip is at {seconds:.2} s ({error})")
        });
        let shown = self.footage.fps();
        format!("{what}{worst}. {shown:.0} frames a second. RMSE of the frame in mm.")
    }
}

/// Where a film is drawn.
struct Stage<'a> {
    film: &'a Film<'a>,
    studio: Studio<'a>,
    view: [u32; 2],
}

/// A frame before it is encoded.
struct Take {
    image: Image,
    seconds: f32,
    /// The numbers by view, metres; none where there is no such number.
    errors: [Option<f64>; 4],
}

impl<'a> Stage<'a> {
    fn new(film: &'a Film<'a>, view: [u32; 2]) -> Result<Self> {
        let probes = probes(film.shots.len(), CAMERA_PROBES);
        let shots: Vec<Shot> = probes.map(|k| film.shots[k].0.truth.clone()).collect();
        let ground = film.footage.clip.captured.clip.ground_height;
        let (character, garment) = (&film.capture.character, &film.capture.garment);
        Ok(Self {
            film,
            studio: Studio::close(character, garment, ground, &shots, (Framing::Figure, view))?,
            view,
        })
    }

    fn take(&self, k: usize) -> Result<Take> {
        let (moment, rival) = &self.film.shots[k];
        let skinning = skinned(self.film.capture, &self.film.footage.clip, moment.frame);
        let truth = &moment.truth.garment;
        let garments = [
            Some(truth.as_slice()),
            Some(&moment.model),
            *rival,
            Some(&skinning),
        ];
        let [width, height] = self.view;
        let mut image = Image::filled(garments.len() as u32 * width, height, [0; 3])?;
        let paint = Paint {
            skin: SKIN,
            cloth: CLOTH,
        };
        for (i, garment) in garments.into_iter().enumerate() {
            let Some(garment) = garment else { continue };
            let view = self.studio.draw(&moment.with_garment(garment), paint)?;
            image.draw_image((i as u32 * width) as i32, 0, &view);
        }
        let mut errors = garments.map(|garment| garment.map(|garment| rmse(garment, truth)));
        errors[0] = None;
        Ok(Take {
            image,
            seconds: moment.seconds,
            errors,
        })
    }

    /// The best quality at which a few frames promise that the film stays within its bytes.
    fn quality(&self, most_bytes: usize) -> Result<u8> {
        let count = self.film.shots.len();
        let takes = probes(count, QUALITY_PROBES).map(|k| self.take(k));
        let takes = takes.collect::<Result<Vec<_>>>()?;
        for quality in QUALITIES {
            let bytes = takes
                .iter()
                .map(|take| Ok(take.image.encode_jpeg(quality)?.len()));
            if bytes.sum::<Result<usize>>()? * count <= most_bytes * takes.len() {
                return Ok(quality);
            }
        }
        // The page thins what is still too large.
        Ok(QUALITIES[QUALITIES.len() - 1])
    }
}

impl Take {
    /// With the name of each view, and its error below.
    fn captioned(mut self, names: [&str; 4]) -> Image {
        let width = self.image.width() as usize / names.len();
        for (i, (name, error)) in names.into_iter().zip(self.errors).enumerate() {
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
        let value = |error: &Option<f64>| error.map_or_else(String::new, millimetres);
        Ok(Frame {
            picture: jpeg(&self.image, quality)?,
            time: format!("{:.2} s", self.seconds),
            values: self.errors.iter().map(value).collect(),
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
