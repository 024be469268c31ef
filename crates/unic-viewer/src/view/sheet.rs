//! Pictures of a whole view: panes with captions, the scale of the heat map, the drift curve.

use super::layout::cells;
use super::quantity::Quantity;
use super::session::ViewSession;
use super::track::TrackKind;
use crate::{Scene, ViewerError};
use unic_raster::{Camera, Image};

/// Background, sRGB.
const PAPER: [u8; 3] = [250, 250, 249];
/// Text, sRGB.
const INK: [u8; 3] = [45, 47, 52];
/// Axis of the drift curve and its playhead, sRGB.
const AXIS: [u8; 3] = [205, 206, 208];
/// Colours of drift curves, sRGB, one a track in turn.
pub(super) const CURVES: [[u8; 3]; 6] = [
    [31, 119, 180],
    [214, 92, 44],
    [44, 140, 80],
    [140, 86, 170],
    [190, 150, 30],
    [90, 90, 96],
];
/// Height of a line of text at scale 1, pixels.
const LINE: u32 = 8;
/// Width of a character at scale 1, pixels.
const CHARACTER: u32 = 6;

/// Places in a picture of a view.
#[derive(Clone, Debug, PartialEq)]
pub struct SheetLayout {
    size: [u32; 2],
    /// Scale of the font.
    scale: u32,
    /// Height of a caption, pixels.
    band: u32,
    /// Height of the strip below the panes, pixels.
    strip: u32,
    /// Left, top, width and height of each pane with its caption.
    cells: Vec<[u32; 4]>,
}

impl SheetLayout {
    /// Divides a picture of `size` (width, height) pixels among `panes` panes.
    ///
    /// # Errors
    /// A size in which a pane has no pixels.
    pub fn new(panes: usize, size: [u32; 2]) -> Result<Self, ViewerError> {
        let scale = if size[0].min(size[1]) < 420 { 1 } else { 2 };
        let band = LINE * scale + 2 * (2 + 2 * scale);
        // Small pictures have no room for a curve.
        let strip = if size[1] < 240 { 0 } else { band.max(size[1] / 9) };
        let smallest = band + strip + 8;
        if size[1] < smallest || size[0] < 8 * panes.max(1) as u32 {
            return Err(ViewerError::Size {
                most: unic_raster::MAX_IMAGE_SIDE,
                width: size[0],
                height: size[1],
            });
        }
        let cells = cells(panes, [size[0] as f32, (size[1] - strip) as f32]);
        let whole = |cell: [f32; 4]| cell.map(|side| side as u32);
        let cells: Vec<[u32; 4]> = cells.into_iter().map(whole).collect();
        if cells.iter().any(|cell| cell[2] == 0 || cell[3] <= band) {
            return Err(ViewerError::Size {
                most: unic_raster::MAX_IMAGE_SIDE,
                width: size[0],
                height: size[1],
            });
        }
        Ok(Self {
            size,
            scale,
            band,
            strip,
            cells,
        })
    }

    /// Width and height of the whole picture, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Width and height of the picture in each pane, pixels.
    pub fn pane_size(&self) -> [u32; 2] {
        let [_, _, width, height] = self.cells[0];
        [width, height - self.band]
    }

    /// Text that fits into a number of pixels.
    fn fitted(&self, text: &str, pixels: u32) -> String {
        let most = (pixels / (CHARACTER * self.scale)) as usize;
        match text.chars().count() > most {
            true => {
                let kept: String = text.chars().take(most.saturating_sub(2)).collect();
                format!("{kept}..")
            }
            false => text.to_owned(),
        }
    }
}

/// Draws all panes of a session that are shown, by `draw` for pictures of
/// [`pane_size`](SheetLayout::pane_size).
///
/// # Errors
/// Those of `draw`; pictures of another size.
pub fn draw_sheet(
    session: &ViewSession,
    layout: &SheetLayout,
    mut draw: impl FnMut(&Scene, &Camera) -> Result<Image, ViewerError>,
) -> Result<Image, ViewerError> {
    let mut sheet = Image::filled(layout.size[0], layout.size[1], PAPER)?;
    let [width, height] = layout.pane_size();
    let pad = (2 + 2 * layout.scale) as i32;
    for (&track, &[left, top, cell, _]) in session.visible().iter().zip(&layout.cells) {
        let picture = session.with_scene(track, width as f32 / height as f32, &mut draw)?;
        sheet.draw_image(left as i32, (top + layout.band) as i32, &picture);
        let caption = layout.fitted(&session.caption(track), cell.saturating_sub(2 * pad as u32));
        let mut x = left as i32 + pad;
        if has_curve(session, track) {
            let side = LINE * layout.scale;
            sheet.fill_rect(x, top as i32 + pad, side / 2, side, curve_colour(track));
            x += side as i32;
        }
        sheet.draw_text(x, top as i32 + pad, layout.scale, INK, &caption);
    }
    if session.quantity == Quantity::Error {
        draw_scale(&mut sheet, session, layout);
    }
    if layout.strip > 0 {
        draw_strip(&mut sheet, session, layout);
    }
    Ok(sheet)
}

/// Colour of the drift curve of a track, sRGB.
pub(super) fn curve_colour(track: usize) -> [u8; 3] {
    CURVES[track % CURVES.len()]
}

/// Whether a track has a drift curve.
pub(super) fn has_curve(session: &ViewSession, track: usize) -> bool {
    let track = &session.tracks()[track];
    track.kind() != TrackKind::Truth && track.truth().is_some()
}

/// Draws the scale of the heat map into the lower left corner of the first pane, on paper.
fn draw_scale(sheet: &mut Image, session: &ViewSession, layout: &SheetLayout) {
    let [left, top, width, height] = layout.cells[0];
    let scale = layout.scale;
    let length = (width * 2 / 5).clamp(60.min(width), 260);
    let (thickness, pad) = (12 * scale + 11 * scale, 6 * scale);
    let y = (top + height).saturating_sub(thickness + 2 * pad) as i32;
    let x = (left + pad) as i32;
    sheet.fill_rect(x, y, length + 2 * pad, thickness + pad + pad / 2, PAPER);
    sheet.draw_colour_bar(x + pad as i32, y + pad as i32, length, scale, session.heat_most_m);
}

/// Draws the time and the drift curves below the panes.
fn draw_strip(sheet: &mut Image, session: &ViewSession, layout: &SheetLayout) {
    let [width, height] = layout.size;
    let (scale, pad) = (layout.scale, 2 + 2 * layout.scale);
    let top = (height - layout.strip) as i32;
    let time = format!("{:.2} s", session.seconds());
    sheet.draw_text(pad as i32, top + pad as i32, scale, INK, &time);
    let curves: Vec<(usize, Vec<f32>)> = (0..session.tracks().len())
        .filter(|&track| has_curve(session, track))
        .map(|track| (track, session.tracks()[track].rmse_m()))
        .collect();
    let Some(most_m) = top_of_curves(curves.iter().map(|(_, curve)| curve.as_slice())) else {
        return;
    };
    let label = format!("RMSE, top {:.0} mm", most_m * 1e3);
    sheet.draw_text(
        pad as i32,
        top + (pad + LINE * scale + 4) as i32,
        scale,
        INK,
        &label,
    );
    let left = (CHARACTER * scale * 18).min(width / 3) as i32;
    let chart = Chart {
        left,
        top: top + pad as i32,
        width: (width as i32 - left - pad as i32).max(1),
        height: (layout.strip as i32 - 2 * pad as i32).max(1),
    };
    sheet.fill_rect(chart.left, chart.top + chart.height, chart.width as u32, 1, AXIS);
    let duration = session.duration().max(1e-6);
    let head = chart.left + (session.seconds() / duration * chart.width as f32) as i32;
    sheet.fill_rect(head, chart.top, scale, chart.height as u32, INK);
    for (track, curve) in &curves {
        let (frames, fps) = session.rate(*track);
        let share = frames as f32 / fps / duration;
        chart.draw(sheet, curve, frames, share, (most_m, scale, curve_colour(*track)));
    }
}

/// Value at the top of a chart of curves, metres; none without a curve.
pub(super) fn top_of_curves<'a>(curves: impl Iterator<Item = &'a [f32]>) -> Option<f32> {
    let values = curves.flatten().copied().filter(|value| value.is_finite());
    let most = values.fold(None, |most: Option<f32>, value| {
        Some(most.map_or(value, |most| most.max(value)))
    });
    // Whole centimetres, so that the scale does not change with every new frame.
    most.map(|most| (most * 100.0).ceil().max(1.0) / 100.0)
}

/// Rectangle of a chart, pixels.
struct Chart {
    left: i32,
    top: i32,
    width: i32,
    height: i32,
}

impl Chart {
    /// Draws a curve of `frames` values over a share of the width, as far as it is known.
    fn draw(
        &self,
        sheet: &mut Image,
        curve: &[f32],
        frames: usize,
        share: f32,
        (most_m, thickness, colour): (f32, u32, [u8; 3]),
    ) {
        let columns = (self.width as f32 * share) as i32;
        let value_at = |column: i32| {
            let frame = (column as usize * frames) / (columns.max(1) as usize);
            curve.get(frame).copied().filter(|value| value.is_finite())
        };
        let y_of = |value: f32| {
            self.top + ((1.0 - (value / most_m).clamp(0.0, 1.0)) * (self.height - 1) as f32).round() as i32
        };
        let mut before: Option<i32> = None;
        for column in 0..columns {
            let Some(y) = value_at(column).map(y_of) else {
                before = None;
                continue;
            };
            let from = before.unwrap_or(y).min(y);
            let to = before.unwrap_or(y).max(y);
            sheet.fill_rect(
                self.left + column,
                from,
                1,
                (to - from) as u32 + thickness,
                colour,
            );
            before = Some(y);
        }
    }
}
