//! Moving pictures.

use crate::{Image, ViewerError};
use color_quant::NeuQuant;
use gif::{DisposalMethod, Encoder, Frame, Repeat};
use std::{borrow::Cow, collections::HashMap};

/// Colours of a GIF, one of them for pixels that stay as they are.
const COLOURS: usize = 256;
const UNCHANGED: u8 = 255;

/// Images that the palette is chosen by.
const SAMPLED_IMAGES: usize = 8;

/// Every n-th of their pixels, as NeuQuant counts: 1 to 30.
const SAMPLED_PIXELS: i32 = 5;

/// Images one after another, for ever, as the bytes of a GIF: 256 colours for all of them, and only
/// pixels that change are stored. `fps` is kept on average: a GIF counts hundredths of a second, at
/// least two a frame.
///
/// # Errors
/// [`ViewerError::NoImages`], [`ViewerError::ImageSizes`] when they are not of one size,
/// [`ViewerError::EncodeGif`].
pub fn encode_gif(images: &[Image], fps: f32) -> Result<Vec<u8>, ViewerError> {
    let [first, ..] = images else {
        return Err(ViewerError::NoImages);
    };
    let size = |image: &Image| [image.width(), image.height()];
    if let Some(other) = images.iter().find(|image| size(image) != size(first)) {
        return Err(ViewerError::ImageSizes {
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

/// Hundredths of a second that the i-th image is shown.
fn delay(i: usize, fps: f32) -> u16 {
    let ends = |count: usize| (count as f32 * 100.0 / fps).round();
    (ends(i + 1) - ends(i)).clamp(2.0, f32::from(u16::MAX)) as u16
}

/// What differs from what is shown; all of it when nothing is.
fn changes(shown: &[u8], indices: &[u8]) -> Vec<u8> {
    if shown.is_empty() {
        return indices.to_vec();
    }
    let change = |(&before, &now): (&u8, &u8)| if before == now { UNCHANGED } else { now };
    shown.iter().zip(indices).map(change).collect()
}

/// Colours for all images, with those that have been looked up.
struct Palette {
    quantiser: NeuQuant,
    known: HashMap<[u8; 3], u8>,
}

impl Palette {
    fn of(images: &[Image]) -> Self {
        let step = images.len().div_ceil(SAMPLED_IMAGES);
        let pixels = images.iter().step_by(step).flat_map(Image::pixels);
        let rgba: Vec<u8> = pixels.flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        Self {
            quantiser: NeuQuant::new(SAMPLED_PIXELS, COLOURS - 1, &rgba),
            known: HashMap::new(),
        }
    }

    fn colours(&self) -> Vec<u8> {
        let mut colours = self.quantiser.color_map_rgb();
        colours.resize(3 * COLOURS, 0);
        colours
    }

    fn index(&mut self, pixel @ [r, g, b]: [u8; 3]) -> u8 {
        // One of the 255 colours.
        let look = || self.quantiser.index_of(&[r, g, b, 255]) as u8;
        *self.known.entry(pixel).or_insert_with(look)
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
    fn a_square_moves_over_what_stays() {
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
    fn images_of_different_sizes_are_refused() {
        let image = |side| Image::filled(side, 8, [0; 3]).unwrap();
        let error = encode_gif(&[image(8), image(9)], 10.0).unwrap_err();
        assert_eq!(
            error.to_string(),
            "a moving picture of 8 x 8 pixels: found an image of 9 x 8"
        );
        assert!(matches!(encode_gif(&[], 10.0), Err(ViewerError::NoImages)));
    }
}
