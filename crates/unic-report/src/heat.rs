use crate::Picture;
use maud::{Markup, html};

/// Pictures in which colours are errors, with their common colour bar.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeatMap {
    /// Colour bar of all pictures.
    pub bar: ColourBar,
    /// Strips of pictures, one per clip.
    pub strips: Vec<HeatStrip>,
    /// Explanation of the colours and of the choice of frames; may be empty.
    pub note: String,
}

/// Pictures of one clip.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeatStrip {
    /// Name of the clip.
    pub title: String,
    /// Pictures by ascending time.
    pub pictures: Vec<CaptionedPicture>,
}

/// A picture with a line of text below it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CaptionedPicture {
    /// Encoded picture.
    pub picture: Picture,
    /// Text below the picture, and its description for screen readers.
    pub caption: String,
}

/// Colour bar of a linear scale that starts at 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColourBar {
    /// sRGB colours at equal distances from 0 to `max`.
    pub stops: Vec<[u8; 3]>,
    /// Largest value of the scale.
    pub max: f32,
    /// Unit of the scale.
    pub unit: String,
}

/// Number of equal parts between the labels of a colour bar.
const LABELS: usize = 4;

impl HeatMap {
    pub(crate) fn markup(&self) -> Markup {
        html! {
            (self.bar.markup())
            @for strip in &self.strips {
                figure.heat {
                    h3 { (strip.title) }
                    div.strip {
                        @for CaptionedPicture { picture, caption } in &strip.pictures {
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
        // A gradient needs two colours, and labels a finite range.
        if stops.len() < 2 || !(self.max.is_finite() && self.max > 0.0) {
            return html! {};
        }
        let label = |k: usize| crate::axis::short_number(f64::from(self.max) * k as f64 / LABELS as f64);
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
