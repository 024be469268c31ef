use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::RasterError;
use crate::font::{self, CELL_HEIGHT, CELL_WIDTH};

/// Largest width or height of an [`Image`], pixels.
///
/// It bounds memory and the fixed-point coordinates of the rasteriser.
pub const MAX_IMAGE_SIDE: u32 = 16_384;

/// Picture of 8-bit sRGB colours, row by row from the top left corner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 3]>,
}

impl Image {
    /// Image of one sRGB colour.
    ///
    /// # Errors
    /// [`RasterError::ImageSize`] unless both sides are within 1 to [`MAX_IMAGE_SIDE`] pixels.
    pub fn filled(width: u32, height: u32, colour: [u8; 3]) -> Result<Self, RasterError> {
        check_size(u64::from(width), u64::from(height))?;
        let pixels = vec![colour; width as usize * height as usize];
        Ok(Self {
            width,
            height,
            pixels,
        })
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, (height × width), row by row from the top left corner.
    pub fn pixels(&self) -> &[[u8; 3]] {
        &self.pixels
    }

    /// Pixels, row by row from the top left corner, to be written.
    pub fn pixels_mut(&mut self) -> &mut [[u8; 3]] {
        &mut self.pixels
    }

    /// Colour of the pixel in column `x` (from the left) and row `y` (from the top); `None`
    /// outside.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        // Without this check, the index would be in the next row.
        if x >= self.width {
            return None;
        }
        let index = y as usize * self.width as usize + x as usize;
        self.pixels.get(index).copied()
    }

    /// Fills the part of a rectangle that lies inside the image.
    ///
    /// The corner (`x`, `y`) may be negative.
    pub fn fill_rect(&mut self, x: i32, y: i32, width: u32, height: u32, colour: [u8; 3]) {
        let columns = clamped_range(x, width, self.width);
        for row in clamped_range(y, height, self.height) {
            let start = row * self.width as usize;
            self.pixels[start + columns.start..start + columns.end].fill(colour);
        }
    }

    /// Copies the part of `tile` that lies inside this image, with its top left corner at (`x`,
    /// `y`).
    pub fn draw_image(&mut self, x: i32, y: i32, tile: &Self) {
        let columns = clamped_range(x, tile.width, self.width);
        if columns.is_empty() {
            return;
        }
        let skipped = (columns.start as i64 - i64::from(x)) as usize;
        for row in clamped_range(y, tile.height, self.height) {
            let tile_row = (row as i64 - i64::from(y)) as usize;
            let from = tile_row * tile.width as usize + skipped;
            let to = row * self.width as usize;
            self.pixels[to + columns.start..to + columns.end]
                .copy_from_slice(&tile.pixels[from..from + columns.len()]);
        }
    }

    /// Draws text with its top left corner at (`x`, `y`).
    ///
    /// A line is `8 * scale` pixels high and a character `6 * scale` wide. `\n` starts a new line.
    /// Characters outside printable ASCII appear as `?`. Parts outside the image are cut off.
    pub fn draw_text(&mut self, x: i32, y: i32, scale: u32, colour: [u8; 3], text: &str) {
        let step = |cells: usize, cell: u32| {
            let pixels = cells as u64 * u64::from(cell) * u64::from(scale);
            i32::try_from(pixels).unwrap_or(i32::MAX)
        };
        for (line_index, line) in text.split('\n').enumerate() {
            let top = y.saturating_add(step(line_index, CELL_HEIGHT));
            for (column, character) in line.chars().enumerate() {
                let left = x.saturating_add(step(column, CELL_WIDTH));
                // The rest of a line is outside too: long texts end here.
                if top >= self.height as i32 || left >= self.width as i32 {
                    break;
                }
                self.draw_glyph(left, top, scale, colour, character);
            }
        }
    }

    fn draw_glyph(&mut self, x: i32, y: i32, scale: u32, colour: [u8; 3], character: char) {
        let size = scale.min(MAX_IMAGE_SIDE) as i32;
        for (row, bits) in (0..).zip(font::glyph(character)) {
            for column in (0..5).filter(|column| bits >> (4 - column) & 1 == 1) {
                let (left, top) = (x.saturating_add(column * size), y.saturating_add(row * size));
                self.fill_rect(left, top, size as u32, size as u32, colour);
            }
        }
    }

    /// Encodes the image as a PNG file, marked as sRGB.
    ///
    /// # Errors
    /// [`RasterError::Encode`] if the encoder fails.
    pub fn encode_png(&self) -> Result<Vec<u8>, RasterError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }

    /// Encodes the image as a JPEG file, for moving pictures.
    ///
    /// `quality` is 1 to 100, as in libjpeg; below 90, colours have half the resolution.
    ///
    /// # Errors
    /// [`RasterError::EncodeJpeg`] if the encoder fails.
    pub fn encode_jpeg(&self, quality: u8) -> Result<Vec<u8>, RasterError> {
        let mut bytes = Vec::new();
        let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, quality.clamp(1, 100));
        encoder.set_optimized_huffman_tables(true);
        // MAX_IMAGE_SIDE fits 16 bits.
        let (width, height) = (self.width as u16, self.height as u16);
        let rgb = jpeg_encoder::ColorType::Rgb;
        encoder.encode(self.pixels.as_flattened(), width, height, rgb)?;
        Ok(bytes)
    }

    /// Writes a PNG file atomically: a reader of `path` finds the old file or the complete new one.
    ///
    /// The bytes go to a temporary file in the same folder, are synced, and the file is renamed.
    ///
    /// # Errors
    /// [`RasterError::Encode`] if the encoder fails, [`RasterError::Write`] if the file cannot be
    /// written.
    pub fn save_png(&self, path: impl AsRef<Path>) -> Result<(), RasterError> {
        let path = path.as_ref();
        let bytes = self.encode_png()?;
        write_atomically(path, &bytes).map_err(|source| RasterError::Write {
            path: path.to_owned(),
            source,
        })
    }
}

pub(crate) fn check_size(width: u64, height: u64) -> Result<(), RasterError> {
    let allowed = 1..=u64::from(MAX_IMAGE_SIDE);
    if allowed.contains(&width) && allowed.contains(&height) {
        return Ok(());
    }
    Err(RasterError::ImageSize {
        width,
        height,
        max: MAX_IMAGE_SIDE,
    })
}

/// Part within `0..limit` of the range that starts at `start`; empty if there is none.
fn clamped_range(start: i32, length: u32, limit: u32) -> std::ops::Range<usize> {
    let clamp = |value: i64| value.clamp(0, i64::from(limit)) as usize;
    clamp(i64::from(start))..clamp(i64::from(start) + i64::from(length))
}

fn write_atomically(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let temporary = temporary_beside(path)?;
    let written = write_synced(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // The first error is the one to report; a leftover file is harmless.
        let _ = fs::remove_file(&temporary);
    }
    written
}

/// Hidden file name in the folder of `path` that no other writer uses.
fn temporary_beside(path: &Path) -> io::Result<PathBuf> {
    // The process and a counter make the name unique among concurrent writers.
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let file_name = path
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"))?;
    let mut name = OsString::from(".");
    name.push(file_name);
    let count = COUNTER.fetch_add(1, Ordering::Relaxed);
    name.push(format!(".{}.{count}.part", std::process::id()));
    Ok(path.with_file_name(name))
}

fn write_synced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}
