//! Moving pictures as GIF files.

use crate::{Image, RasterError};
use color_quant::NeuQuant;
use gif::{DisposalMethod, Encoder, Frame, Repeat};
use std::{borrow::Cow, collections::HashMap};

/// Number of palette entries of a GIF.
const COLOURS: usize = 256;

/// Palette entry of pixels that keep the colour of the frame before.
const UNCHANGED: u8 = 255;

/// Number of images from which the palette is computed.
const SAMPLED_IMAGES: usize = 8;

/// NeuQuant's sampling factor, 1 to 30: every n-th pixel of these images counts.
const SAMPLED_PIXELS: i32 = 5;

/// Encodes images as a GIF that repeats for ever.
///
/// All images share one palette of 255 colours, and only pixels that change are stored. `fps` is
/// met on average, since a GIF counts hundredths of a second, at least two per frame.
///
/// # Errors
/// - [`RasterError::NoImages`] without images.
/// - [`RasterError::ImageSizes`] if the images differ in size.
/// - [`RasterError::EncodeGif`] if the encoder fails.
pub fn encode_gif(images: &[Image], fps: f32) -> Result<Vec<u8>, RasterError> {
    let [first, ..] = images else {
        return Err(RasterError::NoImages);
    };
    let size = |image: &Image| [image.width(), image.height()];
    if let Some(other) = images.iter().find(|image| size(image) != size(first)) {
        return Err(RasterError::ImageSizes {
            expected: size(first),
            found: size(other),
        });
    }
    // MAX_IMAGE_SIDE fits 16 bits.
    let [width, height] = size(first).map(|side| side as u16);
    let mut palette = Palette::of(images);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height, &palette.colours())?;
    encoder.set_repeat(Repeat::Infinite)?;
    let mut shown = Vec::new();
    for (i, image) in images.iter().enumerate() {
        let indices: Vec<u8> = image.pixels().iter().map(|&pixel| palette.index(pixel)).collect();
        encoder.write_frame(&Frame {
            width,
            height,
            delay: delay(i, fps),
            dispose: DisposalMethod::Keep,
            transparent: Some(UNCHANGED),
            buffer: Cow::Owned(changes(&shown, &indices)),
            ..Frame::default()
        })?;
        shown = indices;
    }
    drop(encoder);
    Ok(bytes)
}

/// Duration of the i-th image, hundredths of a second.
fn delay(i: usize, fps: f32) -> u16 {
    // Differences of rounded times: rounding errors do not add up.
    let ends = |count: usize| (count as f32 * 100.0 / fps).round();
    (ends(i + 1) - ends(i)).clamp(2.0, f32::from(u16::MAX)) as u16
}

/// Palette indices of an image in which pixels equal to those shown are [`UNCHANGED`].
///
/// The first image, before which nothing is shown, is returned in full.
fn changes(shown: &[u8], indices: &[u8]) -> Vec<u8> {
    if shown.is_empty() {
        return indices.to_vec();
    }
    let change = |(&before, &now): (&u8, &u8)| if before == now { UNCHANGED } else { now };
    shown.iter().zip(indices).map(change).collect()
}

/// Palette of all images.
struct Palette {
    quantiser: NeuQuant,
    /// Cache of palette indices by colour: pictures have few distinct colours.
    known: HashMap<[u8; 3], u8>,
}

impl Palette {
    /// Computes the palette from some of the images.
    fn of(images: &[Image]) -> Self {
        // Evenly spread over time, so that colours of later images count too.
        let step = images.len().div_ceil(SAMPLED_IMAGES);
        let pixels = images.iter().step_by(step).flat_map(Image::pixels);
        let rgba: Vec<u8> = pixels.flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        Self {
            quantiser: NeuQuant::new(SAMPLED_PIXELS, COLOURS - 1, &rgba),
            known: HashMap::new(),
        }
    }

    /// Palette entries as R, G, B; the entry [`UNCHANGED`] is black.
    fn colours(&self) -> Vec<u8> {
        let mut colours = self.quantiser.color_map_rgb();
        colours.resize(3 * COLOURS, 0);
        colours
    }

    /// Index of the palette entry nearest to a colour.
    fn index(&mut self, pixel @ [r, g, b]: [u8; 3]) -> u8 {
        // The quantiser has 255 colours: the index fits, and is never UNCHANGED.
        let nearest = || self.quantiser.index_of(&[r, g, b, 255]) as u8;
        *self.known.entry(pixel).or_insert_with(nearest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Vec<(Vec<u8>, u16)> {
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(bytes).unwrap();
        let mut frames = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            frames.push((frame.buffer.to_vec(), frame.delay));
        }
        frames
    }

    #[test]
    fn only_changed_pixels_are_stored() {
        let images: Vec<Image> = (0..4)
            .map(|i| {
                let mut image = Image::filled(40, 20, [230, 230, 235]).unwrap();
                image.fill_rect(8 * i, 4, 8, 8, [40, 90, 200]);
                image
            })
            .collect();
        let frames = read(&encode_gif(&images, 15.0).unwrap());
        assert_eq!(
            frames.iter().map(|(_, delay)| *delay).collect::<Vec<_>>(),
            [7, 6, 7, 7]
        );
        let mut canvas = frames[0].0.clone();
        for ((frame, _), image) in frames.iter().zip(&images) {
            for (shown, drawn) in canvas.chunks_exact_mut(4).zip(frame.chunks_exact(4)) {
                if drawn[3] > 0 {
                    shown.copy_from_slice(drawn);
                }
            }
            let found = canvas.chunks_exact(4).zip(image.pixels());
            for (found, expected) in found {
                let off = found.iter().zip(expected).map(|(a, b)| a.abs_diff(*b)).max();
                assert!(off < Some(4), "{found:?}, expected {expected:?}");
            }
        }
        let changed = frames[1].0.chunks_exact(4).filter(|pixel| pixel[3] > 0).count();
        assert_eq!(changed, 128, "the square's old place and its new one");
    }

    #[test]
    fn images_of_different_sizes_and_empty_lists_are_refused() {
        let image = |side| Image::filled(side, 8, [0; 3]).unwrap();
        let error = encode_gif(&[image(8), image(9)], 10.0).unwrap_err();
        assert_eq!(
            error.to_string(),
            "a moving picture of 8 x 8 pixels: found an image of 9 x 8"
        );
        assert!(matches!(encode_gif(&[], 10.0), Err(RasterError::NoImages)));
    }
}
