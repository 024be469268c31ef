use crate::colour::heat_colour;
use crate::font::{CELL_HEIGHT, CELL_WIDTH};
use crate::image::check_size;
use crate::{Image, RasterError};

/// Background of sheets, sRGB.
const PAPER: [u8; 3] = [250, 250, 249];

/// Colour of text and frames, sRGB.
const INK: [u8; 3] = [45, 47, 52];

/// Scale of the font in captions.
const CAPTION_SCALE: u32 = 2;

/// Distance between a caption and the border around it, pixels.
const CAPTION_PADDING: u32 = 6;

/// Lays images out row by row in `columns` columns, with `gap` pixels between them.
///
/// Every cell has the size of the largest image; smaller images are centred. The number of columns
/// is at least one and at most the number of images.
///
/// # Errors
/// [`RasterError::ImageSize`] if there are no images or the sheet would be too large.
pub fn grid(images: &[Image], columns: usize, gap: u32) -> Result<Image, RasterError> {
    let columns = columns.clamp(1, images.len().max(1));
    let cell_width = images.iter().map(Image::width).max().unwrap_or(0);
    let cell_height = images.iter().map(Image::height).max().unwrap_or(0);
    // Saturating in u64: a size that overflows is refused as too large below.
    let span = |cells: usize, cell: u32| {
        let cells = cells as u64;
        let gaps = cells.saturating_sub(1).saturating_mul(u64::from(gap));
        cells.saturating_mul(u64::from(cell)).saturating_add(gaps)
    };
    let (width, height) = (
        span(columns, cell_width),
        span(images.len().div_ceil(columns), cell_height),
    );
    let start = |cells: usize, cell: u32| cells as u64 * (u64::from(cell) + u64::from(gap));
    check_size(width, height)?;
    let mut sheet = Image::filled(width as u32, height as u32, PAPER)?;
    for (i, image) in images.iter().enumerate() {
        // The start of the last cell is inside the sheet, so these fit an i32.
        let left = start(i % columns, cell_width) + u64::from((cell_width - image.width()) / 2);
        let top = start(i / columns, cell_height) + u64::from((cell_height - image.height()) / 2);
        sheet.draw_image(left as i32, top as i32, image);
    }
    Ok(sheet)
}

/// Adds a line of text above an image.
///
/// # Errors
/// [`RasterError::ImageSize`] if the result would be too high.
pub fn captioned(image: &Image, text: &str) -> Result<Image, RasterError> {
    let band = CELL_HEIGHT * CAPTION_SCALE + 2 * CAPTION_PADDING;
    let mut sheet = Image::filled(image.width(), image.height() + band, PAPER)?;
    let padding = CAPTION_PADDING as i32;
    sheet.draw_text(padding, padding, CAPTION_SCALE, INK, text);
    sheet.draw_image(0, band as i32, image);
    Ok(sheet)
}

impl Image {
    /// Draws the colour bar of [`crate::heat_colours`].
    ///
    /// The bar has `length` × 12·`scale` pixels and its top left corner at (`x`, `y`). Below it are
    /// numbers from 0 to `max_m` in millimetres, on 11·`scale` pixels more. A bar that is too short for
    /// three numbers has those of its ends.
    pub fn draw_colour_bar(&mut self, x: i32, y: i32, length: u32, scale: u32, max_m: f32) {
        let (length, scale) = (length.min(crate::MAX_IMAGE_SIDE), scale.min(64));
        let thickness = 12 * scale;
        self.fill_rect(
            x.saturating_sub(1),
            y.saturating_sub(1),
            length + 2,
            thickness + 2,
            INK,
        );
        for step in 0..length {
            // A bar of one pixel would divide by zero.
            let ratio = step as f32 / (length.max(2) - 1) as f32;
            let colour = heat_colour(ratio).map(|value| (value * 255.0).round() as u8);
            self.fill_rect(x.saturating_add(step as i32), y, 1, thickness, colour);
        }
        let top = y.saturating_add((thickness + 3 * scale) as i32);
        let max_mm = max_m * 1000.0;
        let labels = [(0.0, ""), (0.5, ""), (1.0, " mm")]
            .map(|(ratio, unit)| (ratio, format!("{}{unit}", short_number(max_mm * ratio))));
        let width_of = |text: &str| (text.len() as u32 * CELL_WIDTH - 1) * scale;
        let [_, (_, middle), (_, last)] = &labels;
        let fits = width_of(middle) / 2 + width_of(last) + CELL_WIDTH * scale <= length / 2;
        for (ratio, text) in labels.iter().filter(|(ratio, _)| fits || *ratio != 0.5) {
            let width = width_of(text);
            let left = (ratio * length.saturating_sub(width) as f32).round() as i32;
            self.draw_text(x.saturating_add(left), top, scale, INK, text);
        }
    }
}

/// Number with one decimal place, or none if it would be zero.
fn short_number(value: f32) -> String {
    let rounded = (value * 10.0).round() / 10.0;
    if rounded.fract() == 0.0 {
        format!("{rounded:.0}")
    } else {
        format!("{rounded:.1}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_places_cells_and_gaps() {
        let colours = [[200, 0, 0], [0, 200, 0], [0, 0, 200]];
        let tiles: Vec<Image> = colours
            .iter()
            .map(|&colour| Image::filled(4, 3, colour).unwrap())
            .collect();
        let sheet = grid(&tiles, 2, 1).unwrap();
        assert_eq!((sheet.width(), sheet.height()), (9, 7));
        assert_eq!(sheet.pixel(3, 2), Some(colours[0]));
        assert_eq!(sheet.pixel(4, 0), Some(PAPER));
        assert_eq!(sheet.pixel(5, 0), Some(colours[1]));
        assert_eq!(sheet.pixel(0, 3), Some(PAPER));
        assert_eq!(sheet.pixel(0, 4), Some(colours[2]));
        assert_eq!(sheet.pixel(8, 6), Some(PAPER));
    }

    #[test]
    fn no_images_and_huge_sheets_are_refused() {
        assert!(matches!(grid(&[], 3, 2), Err(RasterError::ImageSize { .. })));
        let tile = Image::filled(16_000, 1, PAPER).unwrap();
        assert!(grid(&[tile.clone(), tile], 2, u32::MAX).is_err());
    }

    #[test]
    fn colour_bar_runs_from_dark_to_light_and_is_cut_at_the_border() {
        let mut image = Image::filled(120, 40, PAPER).unwrap();
        image.draw_colour_bar(10, 4, 100, 1, 0.02);
        let value = |x| {
            image
                .pixel(x, 8)
                .unwrap()
                .iter()
                .map(|&c| u32::from(c))
                .sum::<u32>()
        };
        assert!(value(10) < value(60) && value(60) < value(109));
        image.draw_colour_bar(-50, -5, 1000, 3, f32::NAN);
    }

    #[test]
    fn numbers_have_one_decimal_place_or_none() {
        assert_eq!(short_number(20.0), "20");
        assert_eq!(short_number(2.5), "2.5");
        assert_eq!(short_number(0.0), "0");
    }
}
