use crate::Picture;
use maud::{Markup, html};

/// Pictures whose colours are errors, with the scale that all of them share.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeatMap {
    /// The scale.
    pub bar: ColourBar,
    /// One a clip.
    pub strips: Vec<HeatStrip>,
    /// What the colours mean and which frames these are.
    pub note: String,
}

/// Pictures of one clip.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeatStrip {
    /// The clip.
    pub title: String,
    /// In the order of time, with a line below each.
    pub pictures: Vec<(Picture, String)>,
}

/// A linear scale of colours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColourBar {
    /// sRGB at equal distances from 0 to `max`.
    pub stops: Vec<[u8; 3]>,
    /// Where the scale ends.
    pub max: f32,
    /// Of the scale.
    pub unit: String,
}

/// Labels of a colour bar: quarters of it.
const LABELS: usize = 4;

impl HeatMap {
    pub(crate) fn markup(&self) -> Markup {
        html! {
            (self.bar.markup())
            @for strip in &self.strips {
                figure.heat {
                    h3 { (strip.title) }
                    div.strip {
                        @for (picture, caption) in &strip.pictures {
                            div { (picture.img(caption)) p { (caption) } }
                        }
                    }
                }
            }
            @if !self.note.is_empty() { p.note { (self.note) } }
        }
    }
}

impl ColourBar {
    fn markup(&self) -> Markup {
        let stops: Vec<String> = self
            .stops
            .iter()
            .map(|[r, g, b]| format!("rgb({r},{g},{b})"))
            .collect();
        if stops.len() < 2 || !(self.max.is_finite() && self.max > 0.0) {
            return html! {};
        }
        let label = |k: usize| crate::axis::figure(f64::from(self.max) * k as f64 / LABELS as f64);
        html! {
            div.bar role="img" aria-label=(format!("colours from 0 to {} {}", label(LABELS), self.unit)) {
                div.ramp style=(format!("background:linear-gradient(to right,{})", stops.join(","))) {}
                div.labels {
                    @for k in 0..LABELS { span { (label(k)) } }
                    span { (label(LABELS)) " " (self.unit) }
                }
            }
        }
    }
}
