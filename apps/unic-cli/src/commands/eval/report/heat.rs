//! Error maps: the model's garment in the colours of its errors.

use super::{film::jpeg, words::millimetres};
use crate::{
    commands::eval::moment::{Moment, heat_scale},
    pictures::{Framing, Paint, Studio},
    worst_frames::rmse,
};
use anyhow::Result;
use unic_io::Capture;
use unic_report::{ColourBar, HeatMap, HeatStrip};
use unic_viewer::{Colouring, heat_colour, heat_colours};

/// Pixels of one picture.
const SIZE: [u32; 2] = [360, 420];
const QUALITY: u8 = 88;
/// sRGB: no hue of the scale.
const NEUTRAL_SKIN: [f32; 3] = [0.62, 0.63, 0.65];
/// Stops of the colour bar; between them a browser blends in sRGB, as the scale does.
const STOPS: usize = 11;

/// Places of the three quartiles in `errors`, in the order of time.
pub(super) fn quartiles(errors: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..errors.len()).collect();
    order.sort_by(|&a, &b| errors[a].abs().total_cmp(&errors[b].abs()));
    let last = order.len().saturating_sub(1);
    let ranks = (1..=3).map(|k| last * k / 4);
    let mut chosen: Vec<usize> = ranks.filter_map(|rank| order.get(rank).copied()).collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

/// All strips, in colours of one scale; none where there is nothing to draw.
pub(super) fn map(capture: &Capture, clips: &[(String, Vec<Moment>)]) -> Result<Option<HeatMap>> {
    let all = || clips.iter().flat_map(|(_, moments)| moments);
    if all().next().is_none() {
        return Ok(None);
    }
    let scale_m = heat_scale(all());
    let worst_m = all().map(error).max_by(f64::total_cmp);
    let mark = match clips.len() {
        1 => "the worst frame",
        _ => "the worst frame of all clips",
    };
    let strips = clips.iter().map(|(name, moments)| {
        let is_worst = |worst: f64| Some(worst) == worst_m;
        strip(
            capture,
            name,
            moments,
            (scale_m, &|worst| {
                if is_worst(worst) {
                    mark
                } else {
                    "the worst of this clip"
                }
            }),
        )
    });
    let stop = |k: usize| heat_colour(k as f32 / (STOPS - 1) as f32).map(|c| (255.0 * c).round() as u8);
    Ok(Some(HeatMap {
        bar: ColourBar {
            stops: (0..STOPS).map(stop).collect(),
            max: 1e3 * scale_m,
            unit: "mm and more".into(),
        },
        strips: strips.collect::<Result<_>>()?,
        note: "The model's garment, running freely; a vertex has the colour of its distance from the simulation. Of each clip, the worst of all its frames and those at the quartiles of the error, in the order of time.".into(),
    }))
}

fn error(moment: &Moment) -> f64 {
    rmse(&moment.model, &moment.truth.garment)
}

/// One clip; the scale is in metres, the name that of the worst frame by its error in metres.
fn strip(
    capture: &Capture,
    name: &str,
    moments: &[Moment],
    (scale_m, name_of_worst): (f32, &dyn Fn(f64) -> &'static str),
) -> Result<HeatStrip> {
    let shots: Vec<_> = moments.iter().map(|m| m.with_garment(&m.model)).collect();
    let (character, garment) = (&capture.character, &capture.garment);
    // Close-ups do not reach down to the ground, wherever it is.
    let studio = Studio::close(character, garment, 0.0, &shots, (Framing::Garment, SIZE))?;
    let errors: Vec<f64> = moments.iter().map(error).collect();
    let worst = (0..errors.len()).max_by(|&a, &b| errors[a].total_cmp(&errors[b]));
    let mut pictures = Vec::new();
    for (i, (moment, shot)) in moments.iter().zip(&shots).enumerate() {
        let colours = heat_colours(&moment.errors(), scale_m);
        let paint = Paint {
            skin: NEUTRAL_SKIN,
            cloth: Colouring::PerVertex(&colours),
        };
        let mark = match worst == Some(i) {
            true => format!(", {}", name_of_worst(errors[i])),
            false => String::new(),
        };
        let caption = format!("{:.2} s: {}{mark}", moment.seconds, millimetres(errors[i]));
        pictures.push((jpeg(&studio.draw(shot, paint)?, QUALITY)?, caption));
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
    fn quartiles_are_shown_in_the_order_of_time() {
        let errors: Vec<f64> = (0..81).map(|t| f64::from((t * 50) % 81)).collect();
        let mut shown: Vec<f64> = quartiles(&errors).into_iter().map(|t| errors[t]).collect();
        shown.sort_by(f64::total_cmp);
        assert_eq!(shown, [20.0, 40.0, 60.0]);
        assert!(quartiles(&errors).is_sorted());
        assert_eq!(quartiles(&[1.0, f64::NAN]), [0]);
        assert!(quartiles(&[]).is_empty());
    }
}
