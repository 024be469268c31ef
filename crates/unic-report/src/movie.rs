use crate::Picture;
use maud::{Markup, html};

/// A moving picture: several views of the same moment side by side in each frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Movie {
    /// What moves.
    pub title: String,
    /// One line below it.
    pub note: String,
    /// Frames per second in real time.
    pub fps: f32,
    /// The views from left to right, of equal width.
    pub views: Vec<View>,
    /// In the order of time.
    pub frames: Vec<Frame>,
}

/// What one column of a [`Movie`] shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct View {
    /// Its name.
    pub name: String,
    /// Index of the series in the chart that it belongs to, and has the colour of.
    pub series: Option<usize>,
}

/// One moment of a [`Movie`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// All views.
    pub picture: Picture,
    /// When, in words.
    pub time: String,
    /// One short text a view, its error for instance; may be empty.
    pub values: Vec<String>,
}

/// Frames of the strip that stands for the movie where scripts do not run and on paper.
const STILLS: usize = 4;

/// Bytes of a frame's tags and of a movie's, at most, without their texts.
const FRAME_MARKUP: usize = 400;
const MOVIE_MARKUP: usize = 2_000;
/// Bytes that a character of text becomes, at most: `&quot;`.
const ESCAPE: usize = 6;

impl Movie {
    /// Bytes of the markup with every `stride`th frame, at most.
    pub(crate) fn most_bytes(&self, stride: usize) -> usize {
        let frames = self.frames.iter().step_by(stride.max(1));
        let names: usize = self.views.iter().map(|view| view.name.len()).sum();
        let text =
            |frame: &Frame| names + frame.time.len() + frame.values.iter().map(String::len).sum::<usize>();
        let bytes = |frame: &Frame| frame.picture.encoded_len() + FRAME_MARKUP + 3 * ESCAPE * text(frame);
        frames.map(bytes).sum::<usize>()
            + MOVIE_MARKUP
            + 3 * ESCAPE * (names + self.title.len() + self.note.len())
    }

    /// Every `stride`th frame, at as much lower a rate.
    pub(crate) fn thinned(&self, stride: usize) -> Self {
        let stride = stride.max(1);
        Self {
            title: self.title.clone(),
            note: self.note.clone(),
            fps: self.fps / stride as f32,
            views: self.views.clone(),
            frames: self.frames.iter().step_by(stride).cloned().collect(),
        }
    }

    /// The frames are `img` elements: those of the strip show as they are, and the script draws all
    /// of them on the canvas, so that no picture is in the page twice.
    pub(crate) fn markup(&self) -> Markup {
        let Some(first) = self.frames.first() else {
            return html! {};
        };
        html! {
            figure.movie data-fps=(self.rate()) {
                h3 { (self.title) }
                (self.heading(first))
                canvas width=(first.picture.width) height=(first.picture.height) hidden role="img" aria-label=(self.title) {}
                div.frames {
                    @for (i, frame) in self.frames.iter().enumerate() { (self.frame(i, frame)) }
                }
                (self.controls(first))
                @if !self.note.is_empty() { figcaption { (self.note) } }
            }
        }
    }

    /// A rate that a script can divide by.
    fn rate(&self) -> f32 {
        match self.fps.is_finite() && self.fps > 0.0 {
            true => self.fps,
            false => 1.0,
        }
    }

    fn heading(&self, first: &Frame) -> Markup {
        let value = |i: usize| first.values.get(i).map_or("", String::as_str);
        html! {
            div.views {
                @for (i, view) in self.views.iter().enumerate() {
                    div {
                        span.name {
                            @if let Some(series) = view.series { i.dot.(crate::chart::colour_class(series)) {} }
                            (view.name)
                        }
                        span.value { (value(i)) }
                    }
                }
            }
        }
    }

    fn frame(&self, index: usize, frame: &Frame) -> Markup {
        let named = self
            .views
            .iter()
            .zip(&frame.values)
            .filter(|(_, value)| !value.is_empty());
        let named: Vec<String> = named
            .map(|(view, value)| format!("{} {value}", view.name))
            .collect();
        let alt = format!("{} {}", frame.time, named.join(", "));
        let picture = &frame.picture;
        html! {
            img.still[is_still(index, self.frames.len())] src=(picture.data_uri()) alt=(alt.trim_end())
                width=(picture.width) height=(picture.height)
                data-time=(frame.time) data-values=(frame.values.join("|"));
        }
    }

    fn controls(&self, first: &Frame) -> Markup {
        let last = self.frames.len() - 1;
        html! {
            @if last > 0 {
                div.controls hidden {
                    button.play type="button" aria-label="play or pause" { "▶" }
                    input.scrub type="range" min="0" max=(last) value="0" step="1" aria-label="frame";
                    output.time { (first.time) }
                    button.speed type="button" aria-label="speed" { "1×" }
                }
            }
        }
    }
}

fn is_still(index: usize, count: usize) -> bool {
    (0..STILLS).any(|k| index == k * (count - 1) / (STILLS - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_hold_the_first_frame_and_the_last() {
        let stills = |count| (0..count).filter(|&i| is_still(i, count)).collect::<Vec<_>>();
        assert_eq!(stills(90), [0, 29, 59, 89]);
        assert_eq!(stills(2), [0, 1]);
        assert_eq!(stills(1), [0]);
    }
}
