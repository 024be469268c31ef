use crate::Picture;
use maud::{Markup, html};

/// Moving picture with several views of the same moment side by side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Movie {
    /// Heading, such as the name of the clip.
    pub title: String,
    /// Line of text below the movie; may be empty.
    pub note: String,
    /// Frames per second in real time.
    pub fps: f32,
    /// Views from left to right, of equal width.
    pub views: Vec<MovieView>,
    /// Frames by ascending time.
    pub frames: Vec<MovieFrame>,
}

/// One column of a [`Movie`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MovieView {
    /// Name above the view.
    pub name: String,
    /// Index of the view's series in the chart, whose colour the view has; `None` without a series.
    pub series: Option<usize>,
}

/// One moment of a [`Movie`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MovieFrame {
    /// Picture of all views.
    pub picture: Picture,
    /// Time of the frame, in words.
    pub time: String,
    /// Short text of each view, such as its error; may be empty.
    pub values: Vec<String>,
}

/// Number of frames in the strip that replaces a movie without scripts and in print.
const STILLS: usize = 4;

/// Upper bound on the bytes of a frame's tags without their texts.
const FRAME_MARKUP: usize = 400;

/// Upper bound on the bytes of a movie's tags without frames and texts.
const MOVIE_MARKUP: usize = 2_000;

/// Upper bound on the bytes of an escaped byte of text: `&quot;`.
const ESCAPE: usize = 6;

impl Movie {
    /// Upper bound on the bytes of the markup with every `stride`th frame.
    pub(crate) fn most_bytes(&self, stride: usize) -> usize {
        let frames = self.frames.iter().step_by(stride.max(1));
        let names: usize = self.views.iter().map(|view| view.name.len()).sum();
        let values = |frame: &MovieFrame| frame.values.iter().map(String::len).sum::<usize>();
        let text = |frame: &MovieFrame| names + frame.time.len() + values(frame);
        // No text appears more than three times, for instance in `alt`, `data-time` and `output`.
        let bytes =
            |frame: &MovieFrame| frame.picture.encoded_len() + FRAME_MARKUP + 3 * ESCAPE * text(frame);
        frames.map(bytes).sum::<usize>()
            + MOVIE_MARKUP
            + 3 * ESCAPE * (names + self.title.len() + self.note.len())
    }

    /// Movie of every `stride`th frame, with a frame rate that is `stride` times lower.
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

    /// Markup of the movie; empty without frames.
    pub(crate) fn markup(&self) -> Markup {
        // All frames are `img` elements. Style sheets show those of the strip without scripts; the
        // script draws them all on the canvas. No picture is in the page twice.
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

    /// Frame rate that a script can divide by: positive and finite.
    fn rate(&self) -> f32 {
        match self.fps.is_finite() && self.fps > 0.0 {
            true => self.fps,
            false => 1.0,
        }
    }

    /// Names and values of the views above the pictures.
    fn heading(&self, first: &MovieFrame) -> Markup {
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

    fn frame(&self, index: usize, frame: &MovieFrame) -> Markup {
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
            // The script reads time and values from the attributes and splits the values at `|`.
            img.still[is_still(index, self.frames.len())] src=(picture.data_uri()) alt=(alt.trim_end())
                width=(picture.width) height=(picture.height)
                data-time=(frame.time) data-values=(frame.values.join("|"));
        }
    }

    /// Play button, slider, time and speed; none for a single frame.
    fn controls(&self, first: &MovieFrame) -> Markup {
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

/// Returns true for the frames of the strip: the first, the last and evenly spaced ones between.
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
