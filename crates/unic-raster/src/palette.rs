//! Palettes of GIF frames.

use color_quant::NeuQuant;

/// Largest number of colours of a frame. The last entry of a GIF's table is for transparency.
pub(crate) const MOST_COLOURS: usize = 255;

/// Half of the number of colours from which a palette is trained.
const TRAINING_COLOURS: usize = 4_096;

/// Number of times that a palette is refined.
const ROUNDS: usize = 2;

/// Largest difference between the channels of two colours.
pub(crate) fn difference(a: [u8; 3], b: [u8; 3]) -> u8 {
    let [red, green, blue] = [0, 1, 2].map(|channel| a[channel].abs_diff(b[channel]));
    red.max(green).max(blue)
}

/// Sum of the squared differences between the channels of two colours.
pub(crate) fn squared_distance(a: [u8; 3], b: [u8; 3]) -> i32 {
    let square = |channel: usize| i32::from(a[channel].abs_diff(b[channel])).pow(2);
    square(0) + square(1) + square(2)
}

/// At most [`MOST_COLOURS`] colours for a set of pixels.
pub(crate) struct Palette {
    entries: Vec<[u8; 3]>,
    /// Distinct colours of the pixels, sorted.
    colours: Vec<[u8; 3]>,
    /// Index of the entry nearest to each distinct colour.
    nearest: Vec<u8>,
}

impl Palette {
    /// Computes the palette of pixels. It is exact for pixels with few distinct colours.
    pub(crate) fn new(mut pixels: Vec<[u8; 3]>) -> Self {
        pixels.sort_unstable();
        let mut colours = pixels.clone();
        colours.dedup();
        let entries = match colours.len() {
            0..=MOST_COLOURS => colours.clone(),
            _ => trained_entries(&pixels, &colours),
        };
        let nearest = colours.iter().map(|&colour| nearest_entry(&entries, colour));
        Self {
            nearest: nearest.collect(),
            entries,
            colours,
        }
    }

    /// Number of entries.
    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Entries as R, G, B.
    pub(crate) fn rgb(&self) -> &[u8] {
        self.entries.as_flattened()
    }

    /// Index and colour of the entry nearest to one of the palette's pixels.
    pub(crate) fn entry(&self, pixel: [u8; 3]) -> (u8, [u8; 3]) {
        let found = self.colours.binary_search(&pixel);
        // A colour that is not among the pixels is searched for.
        let index = found.map_or_else(|_| nearest_entry(&self.entries, pixel), |i| self.nearest[i]);
        (index, self.entries[usize::from(index)])
    }
}

/// Entries trained on sorted pixels, and on their distinct colours with the same weight.
///
/// Pixels alone would leave rare colours without an entry, such as those of thin edges.
fn trained_entries(pixels: &[[u8; 3]], colours: &[[u8; 3]]) -> Vec<[u8; 3]> {
    let training: Vec<[u8; 3]> = evenly(pixels).chain(evenly(colours)).collect();
    let rgba: Vec<u8> = training.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
    let quantiser = NeuQuant::new(1, MOST_COLOURS, &rgba);
    let mut entries = quantiser.color_map_rgb().as_chunks().0.to_vec();
    for _ in 0..ROUNDS {
        refine(&mut entries, &training);
    }
    entries
}

/// Moves each entry to the mean of the colours that it is nearest to.
fn refine(entries: &mut [[u8; 3]], colours: &[[u8; 3]]) {
    let mut sums = vec![([0_u32; 3], 0_u32); entries.len()];
    for &colour in colours {
        let (sum, count) = &mut sums[usize::from(nearest_entry(entries, colour))];
        (0..3).for_each(|channel| sum[channel] += u32::from(colour[channel]));
        *count += 1;
    }
    for (entry, (sum, count)) in entries.iter_mut().zip(sums) {
        if count > 0 {
            *entry = sum.map(|sum| ((sum + count / 2) / count) as u8);
        }
    }
}

/// Colours spread evenly over a list, [`TRAINING_COLOURS`] of them.
fn evenly(list: &[[u8; 3]]) -> impl Iterator<Item = [u8; 3]> {
    (0..TRAINING_COLOURS).map(|i| list[i * list.len() / TRAINING_COLOURS])
}

/// Index of the entry nearest to a colour; the first of several.
fn nearest_entry(entries: &[[u8; 3]], colour: [u8; 3]) -> u8 {
    let distances = entries.iter().map(|&entry| squared_distance(entry, colour));
    // At most MOST_COLOURS entries: the index fits.
    let nearest = (0_u8..).zip(distances).min_by_key(|&(_, distance)| distance);
    nearest.map_or(0, |(index, _)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_exact() {
        let pixels: Vec<[u8; 3]> = (0..=254).map(|i| [i, 255 - i, i / 2]).collect();
        let palette = Palette::new(pixels.repeat(3));
        assert_eq!(palette.len(), 255);
        for pixel in pixels {
            assert_eq!(palette.entry(pixel).1, pixel);
        }
    }

    #[test]
    fn a_rare_colour_among_many_has_an_entry() {
        let grey = |i: u32| [i as u8, (i / 2) as u8, (i / 7 % 256) as u8];
        let mut pixels: Vec<[u8; 3]> = (0..60_000).map(|i| grey(i % 1_500)).collect();
        let red = [255, 0, 0];
        // A thousandth of the pixels.
        pixels.extend((0..60).map(|i| [255, i % 20, 0]));
        let palette = Palette::new(pixels);
        assert_eq!(palette.len(), MOST_COLOURS);
        let (_, found) = palette.entry(red);
        assert!(difference(found, red) < 40, "{found:?}");
    }

    #[test]
    fn without_pixels_it_is_empty() {
        assert_eq!(Palette::new(Vec::new()).len(), 0);
    }
}
