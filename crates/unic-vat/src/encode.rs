//! Pictures of positions and normals.

use crate::{Error, Result, layout::Layout};
use exr::prelude::{Encoding, Image, SpecificChannels, Vec2 as Texel, WritableImage};
use glam::Vec3;
use png::{BitDepth, ColorType};
use std::{io::Cursor, path::Path};

/// Encodes positions in metres as an EXR of 32-bit floats, compressed without loss. Texels without
/// a vertex are zero.
pub(crate) fn exr_bytes(path: &Path, layout: Layout, positions: &[Vec3]) -> Result<Vec<u8>> {
    let channels = SpecificChannels::rgb(|Texel(x, y)| {
        let place = layout.value(x, y).map_or(Vec3::ZERO, |value| positions[value]);
        (place.x, place.y, place.z)
    });
    let size = (layout.columns, layout.height());
    let image = Image::from_encoded_channels(size, Encoding::SMALL_LOSSLESS, channels);
    let mut bytes = Vec::new();
    let written = image.write().non_parallel().to_buffered(Cursor::new(&mut bytes));
    written.map_err(|e| encoding_error(path, e))?;
    Ok(bytes)
}

/// Encodes positions as a PNG of 16-bit numbers: 0 and 65535 are the bounds.
pub(crate) fn positions_png(
    path: &Path,
    layout: Layout,
    positions: &[Vec3],
    [minimum, maximum]: [Vec3; 2],
) -> Result<Vec<u8>> {
    // An animation in a plane has no extent across it.
    let extent = (maximum - minimum).max(Vec3::splat(f32::MIN_POSITIVE));
    let words = |position: Vec3| {
        let words = (position - minimum) / extent * f32::from(u16::MAX);
        words.to_array().map(|word| (word.round() as u16).to_be_bytes())
    };
    let texel = |value: Option<usize>| value.map_or([[0; 2]; 3], |value| words(positions[value]));
    let pixels = pixels(layout).flat_map(texel).flatten().collect::<Vec<u8>>();
    png_bytes(path, layout, BitDepth::Sixteen, &pixels)
}

/// Encodes unit normals as a PNG of 8-bit numbers: 0 and 255 are −1 and 1.
pub(crate) fn normals_png(path: &Path, layout: Layout, normals: &[Vec3]) -> Result<Vec<u8>> {
    let bytes = |normal: Vec3| {
        let bytes = (0.5 * normal + 0.5) * f32::from(u8::MAX);
        bytes.to_array().map(|byte| byte.round() as u8)
    };
    let texel = |value: Option<usize>| bytes(value.map_or(Vec3::ZERO, |value| normals[value]));
    let pixels = pixels(layout).flat_map(texel).collect::<Vec<u8>>();
    png_bytes(path, layout, BitDepth::Eight, &pixels)
}

/// Iterates over the texels, row by row from the upper left corner.
fn pixels(layout: Layout) -> impl Iterator<Item = Option<usize>> {
    (0..layout.height()).flat_map(move |y| (0..layout.columns).map(move |x| layout.value(x, y)))
}

fn png_bytes(path: &Path, layout: Layout, depth: BitDepth, pixels: &[u8]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // The sides are at most `LARGEST_SIDE`.
    let mut encoder = png::Encoder::new(&mut bytes, layout.columns as u32, layout.height() as u32);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().map_err(|e| encoding_error(path, e))?;
    (writer.write_image_data(pixels)).map_err(|e| encoding_error(path, e))?;
    writer.finish().map_err(|e| encoding_error(path, e))?;
    Ok(bytes)
}

fn encoding_error(path: &Path, reason: impl ToString) -> Error {
    Error::Encode {
        path: path.to_path_buf(),
        reason: reason.to_string(),
    }
}
