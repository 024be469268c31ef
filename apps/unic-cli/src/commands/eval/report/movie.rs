//! Movie of a clip: the simulation, the model, the strongest baseline and skinning side by side.

use super::{
    DrawingProgress, OnDrawing,
    recording::{ClipRecording, ComparedFrame},
    rows,
    text::millimetres,
};
use crate::{
    commands::eval::frame_comparison::skinned,
    pictures::{CLOTH, Framing, Paint, PictureView, Renderer, SKIN, Snapshot, evenly_spread},
    worst_frames::rmse,
};
use anyhow::Result;
use unic_io::Capture;
use unic_raster::{Image, encode_gif};
use unic_report::{Movie, MovieFrame, MovieView, Picture, PictureFormat};

/// Width and height of one of the four views of a frame, in pixels.
const VIEW: [u32; 2] = [300, 404];
/// Width and height of a view of a GIF, in pixels: about 36 kB per frame.
const GIF_VIEW: [u32; 2] = [196, 264];
/// Largest number of frames of a GIF.
const MOST_GIF_FRAMES: usize = 75;
/// Colour of captions, sRGB.
const INK: [u8; 3] = [70, 72, 76];
/// Bytes that all movies of a page may take. Encoded as text in the page they take a third more.
const MOVIE_BYTES: usize = 7_200_000;
/// JPEG qualities to choose from, the best first.
const QUALITIES: [u8; 6] = [86, 80, 74, 66, 56, 44];
/// Number of frames by which the camera is placed.
const CAMERA_SAMPLES: usize = 16;
/// Number of frames by which the JPEG quality is chosen.
const QUALITY_SAMPLES: usize = 3;

/// Movie of a clip that is to be drawn.
pub(super) struct ClipMovie<'a> {
    recording: &'a ClipRecording,
    capture: &'a Capture,
    /// Name of the baseline between the model and skinning.
    rival: &'static str,
    frames: Vec<ComparedFrame<'a>>,
}

impl<'a> ClipMovie<'a> {
    /// Creates the movie of the worst seconds of a clip, or of all of a short one.
    pub(super) fn new(recording: &'a ClipRecording, capture: &'a Capture, rival: &'static str) -> Self {
        Self {
            frames: recording.movie_frames(capture),
            recording,
            capture,
            rival,
        }
    }

    /// Draws the movie for a page with `movies` movies, which share the bytes of the page.
    ///
    /// # Errors
    /// A frame that cannot be drawn, an error of `on_drawing`.
    pub(super) fn draw(&self, movies: usize, on_drawing: &mut OnDrawing) -> Result<Movie> {
        let renderer = FrameRenderer::new(self, VIEW)?;
        let quality = renderer.quality(MOVIE_BYTES / movies.max(1))?;
        let count = self.frames.len();
        let mut frames = Vec::with_capacity(count);
        for k in 0..count {
            on_drawing(self.progress(k))?;
            frames.push(renderer.render(k)?.encode(quality)?);
        }
        let view = |name: &str, series| MovieView {
            name: name.into(),
            series,
        };
        Ok(Movie {
            title: self.title(),
            note: self.note(),
            fps: self.recording.fps(),
            views: vec![
                view("simulation", None),
                view("model", Some(rows::MODEL_SERIES)),
                view(&rows::display_name(self.rival), Some(rows::RIVAL_SERIES)),
                view("skinning", Some(rows::SKINNING_SERIES)),
            ],
            frames,
        })
    }

    /// Draws the movie as a GIF with captions. Returns the bytes of the file.
    ///
    /// # Errors
    /// A frame that cannot be drawn, an error of `on_drawing`.
    pub(super) fn draw_gif(&self, on_drawing: &mut OnDrawing) -> Result<Vec<u8>> {
        let renderer = FrameRenderer::new(self, GIF_VIEW)?;
        // Fewer frames at a lower rate, so that the GIF plays at the speed of the movie.
        let stride = self.frames.len().div_ceil(MOST_GIF_FRAMES).max(1);
        let rival = rows::display_name(self.rival);
        let names = ["simulation", "unic", &rival, "skinning"];
        let mut images = Vec::new();
        for k in (0..self.frames.len()).step_by(stride) {
            on_drawing(self.progress(k))?;
            images.push(renderer.render(k)?.captioned(names));
        }
        Ok(encode_gif(&images, self.recording.fps() / stride as f32)?)
    }

    fn progress(&self, done: usize) -> DrawingProgress<'_> {
        DrawingProgress {
            clip: self.recording.clip.name(),
            done,
            count: self.frames.len(),
        }
    }

    /// Does the movie show the whole clip? Frame 0, which is given, is never shown.
    fn is_whole(&self) -> bool {
        self.recording.window().len() + 1 >= self.recording.clip.len()
    }

    fn title(&self) -> String {
        let name = self.recording.clip.name();
        let fps = self.recording.clip.captured.clip.fps;
        let window = self.recording.window();
        let [from, to, all] =
            [window.start, window.end, self.recording.clip.len()].map(|frame| frame as f32 / fps);
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
        let fps = self.recording.clip.captured.clip.fps;
        let worst = self.recording.worst().map_or_else(String::new, |worst| {
            let (seconds, error) = (worst.frame as f32 / fps, millimetres(worst.rmse));
            format!("; the model's worst frame of the clip is at {seconds:.2} s ({error})")
        });
        let shown = self.recording.fps();
        format!("{what}{worst}. {shown:.0} frames per second. RMSE of the frame in mm.")
    }
}

/// Draws the four views of the frames of a movie.
struct FrameRenderer<'a> {
    movie: &'a ClipMovie<'a>,
    renderer: Renderer<'a>,
    /// Width and height of one view in pixels.
    size: [u32; 2],
}

/// Frame before it is encoded.
struct RenderedFrame {
    image: Image,
    seconds: f32,
    /// RMSE of each view in metres. `None` for the simulation and for a missing baseline.
    errors: [Option<f64>; 4],
}

impl<'a> FrameRenderer<'a> {
    fn new(movie: &'a ClipMovie<'a>, size: [u32; 2]) -> Result<Self> {
        let samples = sample_frames(movie.frames.len(), CAMERA_SAMPLES);
        let snapshots: Vec<Snapshot> = samples
            .map(|k| movie.frames[k].comparison.truth.clone())
            .collect();
        let ground = movie.recording.clip.captured.clip.ground_height;
        let (character, garment) = (&movie.capture.character, &movie.capture.garment);
        let view = PictureView {
            framing: Framing::Figure,
            size,
        };
        Ok(Self {
            movie,
            renderer: Renderer::close(character, garment, ground, &snapshots, view)?,
            size,
        })
    }

    /// Draws frame `k` of the movie: one image with all views.
    fn render(&self, k: usize) -> Result<RenderedFrame> {
        let ComparedFrame { comparison, rival } = &self.movie.frames[k];
        let skinning = skinned(self.movie.capture, &self.movie.recording.clip, comparison.frame);
        let truth = &comparison.truth.garment;
        let garments = [
            Some(truth.as_slice()),
            Some(&comparison.model),
            *rival,
            Some(&skinning),
        ];
        let [width, height] = self.size;
        // All views are in one image, so that they cannot get out of step on the page.
        let mut image = Image::filled(garments.len() as u32 * width, height, [0; 3])?;
        let paint = Paint {
            skin: SKIN,
            cloth: CLOTH,
        };
        for (i, garment) in garments.into_iter().enumerate() {
            let Some(garment) = garment else { continue };
            let view = self.renderer.draw(&comparison.with_garment(garment), paint)?;
            image.draw_image((i as u32 * width) as i32, 0, &view);
        }
        let mut errors = garments.map(|garment| garment.map(|garment| rmse(garment, truth)));
        // The simulation's error is zero by definition and is not shown.
        errors[0] = None;
        Ok(RenderedFrame {
            image,
            seconds: comparison.seconds,
            errors,
        })
    }

    /// Best JPEG quality at which the movie takes at most `most_bytes`, estimated from a few
    /// frames.
    fn quality(&self, most_bytes: usize) -> Result<u8> {
        let count = self.movie.frames.len();
        let samples = sample_frames(count, QUALITY_SAMPLES).map(|k| self.render(k));
        let samples = samples.collect::<Result<Vec<_>>>()?;
        for quality in QUALITIES {
            let bytes = samples
                .iter()
                .map(|sample| Ok(sample.image.encode_jpeg(quality)?.len()));
            // Both sides are multiplied out, so that no samples are no division by zero.
            if bytes.sum::<Result<usize>>()? * count <= most_bytes * samples.len() {
                return Ok(quality);
            }
        }
        // If the lowest quality is still too large, the page leaves out frames.
        Ok(QUALITIES[QUALITIES.len() - 1])
    }
}

impl RenderedFrame {
    /// Image with the name of each view, and its error below the name.
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

    /// Encodes the frame for the page.
    fn encode(&self, quality: u8) -> Result<MovieFrame> {
        let value = |error: &Option<f64>| error.map_or_else(String::new, millimetres);
        Ok(MovieFrame {
            picture: jpeg(&self.image, quality)?,
            time: format!("{:.2} s", self.seconds),
            values: self.errors.iter().map(value).collect(),
        })
    }
}

/// Indices of at most `most` of `count` frames, spread evenly. None for an empty movie.
fn sample_frames(count: usize, most: usize) -> impl Iterator<Item = usize> {
    // `evenly_spread` gives index 0 even for no frames.
    evenly_spread(count, most).into_iter().take(count)
}

/// Encodes an image as a JPEG picture of the page.
pub(super) fn jpeg(image: &Image, quality: u8) -> Result<Picture> {
    Ok(Picture {
        format: PictureFormat::Jpeg,
        bytes: image.encode_jpeg(quality)?,
        width: image.width(),
        height: image.height(),
    })
}
