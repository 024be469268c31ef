//! Pictures as the planes of a video: BT.709, limited range, colours at half the resolution.

use openh264::formats::YUVSource;
use unic_raster::Image;

/// Shares of red, green and blue in luma (ITU-R BT.709-6, 3.2).
const LUMA: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Planes of a picture: luma, blue difference and red difference.
///
/// An odd width or height gets one more column or row, equal to the last.
pub(super) struct Planes {
    /// Width and height in pixels, both even.
    size: [usize; 2],
    luma: Vec<u8>,
    /// Blue and red difference; one value for a square of four pixels.
    chroma: [Vec<u8>; 2],
}

impl Planes {
    /// Planes for pictures of `[width, height]` pixels.
    pub(super) fn new(size: [u32; 2]) -> Self {
        let size = size.map(|side| (side as usize).next_multiple_of(2));
        let pixels = size[0] * size[1];
        Self {
            size,
            luma: vec![0; pixels],
            chroma: [vec![0; pixels / 4], vec![0; pixels / 4]],
        }
    }

    /// Converts a picture of the size given to [`Planes::new`].
    pub(super) fn fill(&mut self, image: &Image) {
        let [width, height] = [image.width(), image.height()].map(|side| side as usize);
        let pixels = image.pixels();
        let pixel = |x: usize, y: usize| pixels[y.min(height - 1) * width + x.min(width - 1)];
        for y in (0..self.size[1]).step_by(2) {
            for x in (0..self.size[0]).step_by(2) {
                let mut sum = [0.0; 3];
                for (x, y) in [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)] {
                    let colour = pixel(x, y).map(f32::from);
                    self.luma[y * self.size[0] + x] = byte(16.0 + luma(colour) * (219.0 / 255.0));
                    (0..3).for_each(|channel| sum[channel] += colour[channel]);
                }
                let mean = sum.map(|sum| sum / 4.0);
                let square = y / 2 * (self.size[0] / 2) + x / 2;
                // A difference has the range of its colour times the share of the others, both ways.
                for (plane, channel) in [(0, 2), (1, 0)] {
                    let range = 2.0 * (1.0 - LUMA[channel]);
                    let value = (mean[channel] - luma(mean)) / range;
                    self.chroma[plane][square] = byte(128.0 + value * (224.0 / 255.0));
                }
            }
        }
    }
}

fn luma(colour: [f32; 3]) -> f32 {
    LUMA[0] * colour[0] + LUMA[1] * colour[1] + LUMA[2] * colour[2]
}

fn byte(value: f32) -> u8 {
    // The conversion saturates; it truncates what is added to round.
    (value + 0.5) as u8
}

impl YUVSource for Planes {
    fn dimensions(&self) -> (usize, usize) {
        self.size.into()
    }

    fn strides(&self) -> (usize, usize, usize) {
        (self.size[0], self.size[0] / 2, self.size[0] / 2)
    }

    fn y(&self) -> &[u8] {
        &self.luma
    }

    fn u(&self) -> &[u8] {
        &self.chroma[0]
    }

    fn v(&self) -> &[u8] {
        &self.chroma[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of the primaries in 8-bit BT.709, rounded from the equations of its section 3.
    #[test]
    fn colours_have_their_values_in_bt709() {
        for (colour, expected) in [
            ([0, 0, 0], [16, 128, 128]),
            ([255, 255, 255], [235, 128, 128]),
            ([255, 0, 0], [63, 102, 240]),
            ([0, 255, 0], [173, 42, 26]),
            ([0, 0, 255], [32, 240, 118]),
        ] {
            let mut planes = Planes::new([2, 2]);
            planes.fill(&Image::filled(2, 2, colour).unwrap());
            let found = [planes.luma[3], planes.chroma[0][0], planes.chroma[1][0]];
            assert_eq!(found, expected, "{colour:?}");
        }
    }

    #[test]
    fn odd_sides_repeat_the_last_column_and_row() {
        let mut image = Image::filled(3, 1, [0; 3]).unwrap();
        image.fill_rect(2, 0, 1, 1, [255; 3]);
        let mut planes = Planes::new([3, 1]);
        planes.fill(&image);
        assert_eq!(planes.dimensions(), (4, 2));
        assert_eq!(planes.luma, [16, 16, 235, 235, 16, 16, 235, 235]);
    }
}
