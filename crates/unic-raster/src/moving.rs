//! Moving pictures as GIF files.

use crate::{
    Image, RasterError,
    palette::{Palette, difference, squared_distance},
};
use gif::{DisposalMethod, Encoder, Frame, Repeat};
use std::{borrow::Cow, io::Write, ops::RangeInclusive};

/// Largest error of a channel that a pixel keeps while the picture changes there.
///
/// Such errors are not seen in motion, and drawing these pixels takes a fifth of the file.
const MOVING_TOLERANCE: u8 = 2;

/// Largest error of a channel that a pixel keeps where the picture is at rest.
const RESTING_TOLERANCE: u8 = 1;

/// Shortest delay of a frame in hundredths of a second. Browsers slow down shorter ones.
const SHORTEST_DELAY: u64 = 2;

/// Frame rates: at the lowest, a delay fits 16 bits.
const RATES: RangeInclusive<f32> = 0.01..=1_000.0;

/// Encodes images as a GIF that repeats for ever: [`GifWriter`] in one call.
///
/// # Errors
/// - [`RasterError::NoImages`] without images.
/// - [`RasterError::ImageSizes`] if the images differ in size.
/// - [`RasterError::FrameRate`] unless `fps` is within 0.01 to 1000.
/// - [`RasterError::EncodeGif`] if the encoder fails.
pub fn encode_gif(images: &[Image], fps: f32) -> Result<Vec<u8>, RasterError> {
    let first = images.first().ok_or(RasterError::NoImages)?;
    let mut writer = GifWriter::new(Vec::new(), [first.width(), first.height()], fps)?;
    images.iter().try_for_each(|image| writer.push(image))?;
    writer.finish()
}

/// Writes a GIF that repeats for ever, one image at a time, in constant memory.
///
/// Each frame holds the pixels that change, with a palette of 255 colours for these alone. A pixel
/// keeps its colour while that is within two levels of the right one, so pictures at rest do not
/// flicker and get more exact with every frame. Nothing is dithered.
///
/// A GIF counts time in hundredths of a second. Delays alternate so that each image appears at
/// its time, rounded. Above 50 images per second, images are left out.
pub struct GifWriter<W: Write> {
    encoder: Encoder<W>,
    size: [u32; 2],
    fps: f32,
    /// Number of images pushed.
    pushed: u64,
    /// Index of the next image that is not left out.
    next: u64,
    /// Colours that a viewer shows after the last frame; empty before the first.
    shown: Vec<[u8; 3]>,
    /// Pixels of the last frame's image.
    previous: Vec<[u8; 3]>,
}

impl<W: Write> GifWriter<W> {
    /// Starts a GIF of `[width, height]` pixels with `fps` images per second.
    ///
    /// # Errors
    /// - [`RasterError::ImageSize`] for a width or height out of range.
    /// - [`RasterError::FrameRate`] unless `fps` is within 0.01 to 1000.
    /// - [`RasterError::EncodeGif`] if the header cannot be written.
    pub fn new(writer: W, size: [u32; 2], fps: f32) -> Result<Self, RasterError> {
        crate::image::check_size(size[0].into(), size[1].into())?;
        if !RATES.contains(&fps) {
            return Err(RasterError::FrameRate {
                expected: RATES,
                found: fps,
            });
        }
        // MAX_IMAGE_SIDE fits 16 bits.
        let mut encoder = Encoder::new(writer, size[0] as u16, size[1] as u16, &[])?;
        encoder.set_repeat(Repeat::Infinite)?;
        Ok(Self {
            encoder,
            size,
            fps,
            pushed: 0,
            next: 0,
            shown: Vec::new(),
            previous: Vec::new(),
        })
    }

    /// Adds an image.
    ///
    /// # Errors
    /// - [`RasterError::ImageSizes`] if the image has another size than the GIF.
    /// - [`RasterError::EncodeGif`] if the frame cannot be written. The file is damaged then.
    pub fn push(&mut self, image: &Image) -> Result<(), RasterError> {
        let found = [image.width(), image.height()];
        if found != self.size {
            return Err(RasterError::ImageSizes {
                expected: self.size,
                found,
            });
        }
        let index = self.pushed;
        self.pushed += 1;
        if index < self.next {
            return Ok(());
        }
        let start = self.start(index);
        while self.start(self.next) < start + SHORTEST_DELAY {
            self.next += 1;
        }
        // RATES makes it fit.
        let delay = (self.start(self.next) - start) as u16;
        let changes = self.show(image.pixels());
        self.encoder
            .write_frame(&changes.frame(self.size[0] as usize, delay))?;
        self.previous.clear();
        self.previous.extend_from_slice(image.pixels());
        Ok(())
    }

    /// Writer of the file.
    pub fn get_ref(&self) -> &W {
        self.encoder.get_ref()
    }

    /// Ends the GIF. Returns the writer, which is not flushed.
    ///
    /// # Errors
    /// - [`RasterError::NoImages`] without images.
    /// - [`RasterError::EncodeGif`] if the end cannot be written.
    pub fn finish(self) -> Result<W, RasterError> {
        if self.pushed == 0 {
            return Err(RasterError::NoImages);
        }
        Ok(self.encoder.into_inner()?)
    }

    /// Time at which an image appears, hundredths of a second.
    fn start(&self, index: u64) -> u64 {
        // Rounded times, not rounded delays: rounding errors do not add up.
        (index as f64 * 100.0 / f64::from(self.fps)).round() as u64
    }

    /// Brings `shown` close to `pixels`. Returns the pixels to draw for that.
    fn show(&mut self, pixels: &[[u8; 3]]) -> Changes {
        let outdated: Vec<usize> = (0..pixels.len())
            .filter(|&i| self.is_outdated(i, pixels[i]))
            .collect();
        let palette = Palette::new(outdated.iter().map(|&i| pixels[i]).collect());
        let mut drawn = Vec::with_capacity(outdated.len());
        for i in outdated {
            let (index, colour) = palette.entry(pixels[i]);
            // At rest, a colour changes for a better one alone: it must not flicker.
            let worse = |shown: &[u8; 3]| {
                self.is_resting(i, pixels[i])
                    && squared_distance(colour, pixels[i]) >= squared_distance(*shown, pixels[i])
            };
            if !self.shown.get(i).is_some_and(worse) {
                drawn.push((i, index));
            }
        }
        self.shown.resize(pixels.len(), [0; 3]);
        for &(i, _) in &drawn {
            self.shown[i] = palette.entry(pixels[i]).1;
        }
        Changes { palette, drawn }
    }

    fn is_outdated(&self, i: usize, pixel: [u8; 3]) -> bool {
        let tolerance = match self.is_resting(i, pixel) {
            true => RESTING_TOLERANCE,
            false => MOVING_TOLERANCE,
        };
        let off = |&shown: &[u8; 3]| difference(shown, pixel) > tolerance;
        self.shown.get(i).is_none_or(off)
    }

    fn is_resting(&self, i: usize, pixel: [u8; 3]) -> bool {
        self.previous.get(i) == Some(&pixel)
    }
}

/// Pixels to draw in a frame.
struct Changes {
    palette: Palette,
    /// Index of each pixel in the image, ascending, and of its palette entry.
    drawn: Vec<(usize, u8)>,
}

impl Changes {
    /// Frame of the smallest rectangle around the pixels, in an image of `width` columns.
    fn frame(&self, width: usize, delay: u16) -> Frame<'static> {
        let columns = || self.drawn.iter().map(|(i, _)| i % width);
        let rows = || self.drawn.iter().map(|(i, _)| i / width);
        // A frame has at least one pixel, so that the picture before it stays for the delay.
        let [left, top] = [columns().min(), rows().min()].map(Option::unwrap_or_default);
        let [right, bottom] = [columns().max(), rows().max()].map(Option::unwrap_or_default);
        let [across, down] = [right - left + 1, bottom - top + 1];
        // At most 255: the palette leaves an index free.
        let transparent = self.palette.len() as u8;
        let mut buffer = vec![transparent; across * down];
        for &(i, index) in &self.drawn {
            buffer[(i / width - top) * across + i % width - left] = index;
        }
        let mut colours = self.palette.rgb().to_vec();
        colours.extend([0; 3]);
        // Sides of images fit 16 bits.
        Frame {
            left: left as u16,
            top: top as u16,
            width: across as u16,
            height: down as u16,
            delay,
            dispose: DisposalMethod::Keep,
            transparent: Some(transparent),
            palette: Some(colours),
            buffer: Cow::Owned(buffer),
            ..Frame::default()
        }
    }
}

#[cfg(test)]
mod tests;
