//! Error maps: pictures of the model's garment, each vertex in the colour of its error.

use super::{movie::jpeg, text::millimetres};
use crate::{
    commands::eval::frame_comparison::{FrameComparison, heat_scale},
    pictures::{Framing, Paint, PictureView, Renderer},
    worst_frames::rmse,
};
use anyhow::Result;
use unic_io::Capture;
use unic_raster::{Colouring, heat_colour, heat_colours};
use unic_report::{CaptionedPicture, ColourBar, HeatMap, HeatStrip};

/// Width and height of one picture in pixels.
const SIZE: [u32; 2] = [360, 420];
/// JPEG quality of the pictures.
const QUALITY: u8 = 88;
/// Colour of the skin, sRGB: a grey, since the colour scale has none.
const NEUTRAL_SKIN: [f32; 3] = [0.62, 0.63, 0.65];
/// Number of stops of the colour bar. Between them a browser blends in sRGB, as the scale does.
const STOPS: usize = 11;

/// Indices of the three quartiles of `errors`, in the order of time.
pub(super) fn quartiles(errors: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..errors.len()).collect();
    // `abs` clears the sign of NaN, so that `total_cmp` orders every NaN last.
    order.sort_by(|&a, &b| errors[a].abs().total_cmp(&errors[b].abs()));
    let last = order.len().saturating_sub(1);
    let ranks = (1..=3).map(|k| last * k / 4);
    let mut chosen: Vec<usize> = ranks.filter_map(|rank| order.get(rank).copied()).collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

/// Draws the error maps of all clips on one colour scale. `None` if there are no frames.
///
/// # Errors
/// A picture that cannot be drawn or encoded.
pub(super) fn map(capture: &Capture, clips: &[(String, Vec<FrameComparison>)]) -> Result<Option<HeatMap>> {
    let all = || clips.iter().flat_map(|(_, comparisons)| comparisons);
    if all().next().is_none() {
        return Ok(None);
    }
    let scale_m = heat_scale(all());
    let worst_m = all().map(error).max_by(f64::total_cmp);
    let mark = match clips.len() {
        1 => "the worst frame",
        _ => "the worst frame of all clips",
    };
    let strips = clips.iter().map(|(name, comparisons)| {
        let label = match comparisons.iter().map(error).max_by(f64::total_cmp) == worst_m {
            true => mark,
            false => "the worst of this clip",
        };
        strip(capture, name, comparisons, scale_m, label)
    });
    let stop = |k: usize| heat_colour(k as f32 / (STOPS - 1) as f32).map(|c| (255.0 * c).round() as u8);
    Ok(Some(HeatMap {
        bar: ColourBar {
            stops: (0..STOPS).map(stop).collect(),
            max: 1e3 * scale_m,
            unit: "mm and more".into(),
        },
        strips: strips.collect::<Result<_>>()?,
        note: "The model's garment in free running; the colour of a vertex is its distance from the simulation. Each clip is shown in its worst frame and in frames at the quartiles of the error, in the order of time.".into(),
    }))
}

/// RMSE of a frame in metres.
fn error(comparison: &FrameComparison) -> f64 {
    rmse(&comparison.model, &comparison.truth.garment)
}

/// Draws the strip of one clip. `scale_m` is the error in metres at the end of the colour scale,
/// `worst_label` the addition to the caption of the worst frame.
fn strip(
    capture: &Capture,
    name: &str,
    comparisons: &[FrameComparison],
    scale_m: f32,
    worst_label: &str,
) -> Result<HeatStrip> {
    let snapshots: Vec<_> = comparisons.iter().map(|c| c.with_garment(&c.model)).collect();
    let (character, garment) = (&capture.character, &capture.garment);
    // The ground is out of view in a close-up, so that its height does not matter.
    let view = PictureView {
        framing: Framing::Garment,
        size: SIZE,
    };
    let renderer = Renderer::close(character, garment, 0.0, &snapshots, view)?;
    let errors: Vec<f64> = comparisons.iter().map(error).collect();
    let worst = (0..errors.len()).max_by(|&a, &b| errors[a].total_cmp(&errors[b]));
    let mut pictures = Vec::new();
    for (i, (comparison, snapshot)) in comparisons.iter().zip(&snapshots).enumerate() {
        let colours = heat_colours(&comparison.errors(), scale_m);
        let paint = Paint {
            skin: NEUTRAL_SKIN,
            cloth: Colouring::PerVertex(&colours),
        };
        let mark = match worst == Some(i) {
            true => format!(", {worst_label}"),
            false => String::new(),
        };
        let caption = format!("{:.2} s: {}{mark}", comparison.seconds, millimetres(errors[i]));
        let picture = jpeg(&renderer.draw(snapshot, paint)?, QUALITY)?;
        pictures.push(CaptionedPicture { picture, caption });
    }
    Ok(HeatStrip {
        title: name.to_owned(),
        pictures,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_are_in_the_order_of_time() {
        let errors: Vec<f64> = (0..81).map(|t| f64::from((t * 50) % 81)).collect();
        let mut shown: Vec<f64> = quartiles(&errors).into_iter().map(|t| errors[t]).collect();
        shown.sort_by(f64::total_cmp);
        assert_eq!(shown, [20.0, 40.0, 60.0]);
        assert!(quartiles(&errors).is_sorted());
        assert_eq!(quartiles(&[1.0, f64::NAN]), [0]);
        assert!(quartiles(&[]).is_empty());
    }
}
