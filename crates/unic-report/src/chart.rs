use crate::axis::{figure, ticks_from_zero};
use maud::{Markup, html};
use std::fmt::Write;

/// Lines over a common axis, both axes from zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// Quantity and unit of the horizontal axis.
    pub x: String,
    /// Quantity and unit of the vertical axis.
    pub y: String,
    /// The lines; the first one is what the page is about, and drawn bold.
    pub series: Vec<Series>,
}

/// A line of a [`Chart`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// (x, y) in the order of x. What is not finite, or negative, leaves a gap.
    pub points: Vec<(f64, f64)>,
}

/// User units of the drawing.
const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 48.0;

/// A line has no more points than its pixels can show.
const MOST_POINTS: usize = 720;

/// The vertical axis ends at most here, in medians of all values: a line that diverges leaves the
/// drawing and the others stay readable.
const MOST_MEDIANS: f64 = 4.0;

/// Colours that the style sheet has.
const COLOURS: usize = 9;

/// Class of a series' colour.
pub(crate) fn colour_class(series: usize) -> String {
    format!("s{}", series % COLOURS)
}

impl Chart {
    pub(crate) fn markup(&self) -> Markup {
        let frame = Frame::around(&self.series);
        html! {
            figure.chart {
                ul.legend {
                    @for (i, series) in self.series.iter().enumerate() {
                        li { i.dot.(colour_class(i)) {} (series.name) }
                    }
                }
                svg viewBox=(format!("0 0 {WIDTH} {HEIGHT}")) role="img" aria-label=(self.title) {
                    (frame.axes())
                    text.name x=(LEFT + frame.width() / 2.0) y=(HEIGHT - 6.0) text-anchor="middle" { (self.x) }
                    text.name transform=(format!("translate(14 {}) rotate(-90)", TOP + frame.height() / 2.0))
                        text-anchor="middle" { (self.y) }
                    // An inner drawing cuts off what leaves it.
                    svg x=(LEFT) y=(TOP) width=(frame.width()) height=(frame.height()) {
                        @for (i, series) in self.series.iter().enumerate().rev() {
                            path.line.(colour_class(i)) d=(frame.path(&series.points)) {}
                        }
                    }
                }
            }
        }
    }
}

/// Where numbers lie in the drawing.
struct Frame {
    x_end: f64,
    x_ticks: Vec<f64>,
    y_ticks: Vec<f64>,
}

impl Frame {
    fn around(series: &[Series]) -> Self {
        let points = || {
            series
                .iter()
                .flat_map(|s| s.points.iter().copied())
                .filter(is_drawable)
        };
        let x_end = points().map(|(x, _)| x).fold(0.0, f64::max);
        let mut heights: Vec<f64> = points().map(|(_, y)| y).collect();
        heights.sort_by(f64::total_cmp);
        let highest = heights.last().copied().unwrap_or(0.0);
        let median = heights.get(heights.len() / 2).copied().unwrap_or(0.0);
        let y_end = match median > 0.0 {
            true => highest.min(MOST_MEDIANS * median),
            false => highest,
        };
        let x_ticks = ticks_from_zero(x_end, 8);
        Self {
            x_end: match x_end > 1e-9 && x_end.is_finite() {
                true => x_end,
                false => x_ticks[x_ticks.len() - 1],
            },
            x_ticks,
            y_ticks: ticks_from_zero(y_end, 5),
        }
    }

    fn width(&self) -> f64 {
        WIDTH - LEFT - RIGHT
    }

    fn height(&self) -> f64 {
        HEIGHT - TOP - BOTTOM
    }

    fn y_end(&self) -> f64 {
        self.y_ticks.last().copied().unwrap_or(1.0)
    }

    /// From the left edge of the axes.
    fn x(&self, x: f64) -> f64 {
        x / self.x_end * self.width()
    }

    /// From the top edge of the axes; not farther away than a page, so that digits stay few.
    fn y(&self, y: f64) -> f64 {
        (1.0 - (y / self.y_end()).min(10.0)) * self.height()
    }

    fn axes(&self) -> Markup {
        let (right, bottom) = (LEFT + self.width(), TOP + self.height());
        html! {
            @for &tick in &self.y_ticks {
                @let y = short(TOP + self.y(tick));
                line.rule x1=(LEFT) x2=(right) y1=(y) y2=(y) {}
                text x=(LEFT - 8.0) y=(y) dy="0.35em" text-anchor="end" { (figure(tick)) }
            }
            @for &tick in self.x_ticks.iter().filter(|&&tick| tick <= self.x_end * (1.0 + 1e-9)) {
                @let x = short(LEFT + self.x(tick));
                line.tick x1=(x) x2=(x) y1=(bottom) y2=(bottom + 4.0) {}
                text x=(x) y=(bottom + 18.0) text-anchor="middle" { (figure(tick)) }
            }
        }
    }

    /// Commands of a path, relative to the axes' top left corner; a point on its own is a dot.
    fn path(&self, points: &[(f64, f64)]) -> String {
        let stride = points.len().div_ceil(MOST_POINTS).max(1);
        let mut path = String::new();
        let mut is_drawing = false;
        for point in points.iter().step_by(stride) {
            if is_drawable(point) {
                let (x, y) = (short(self.x(point.0)), short(self.y(point.1)));
                // Writing to a string cannot fail.
                let _ = match is_drawing {
                    true => write!(path, "L{x} {y}"),
                    false => write!(path, "M{x} {y}h0"),
                };
            }
            is_drawing = is_drawable(point);
        }
        path
    }
}

/// In the drawing, or above it.
fn is_drawable((x, y): &(f64, f64)) -> bool {
    let usable = |value: f64| value.is_finite() && (0.0..1e12).contains(&value);
    usable(*x) && usable(*y)
}

/// A tenth of a pixel is enough.
fn short(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(points: &[(f64, f64)]) -> Frame {
        Frame::around(&[Series {
            name: String::new(),
            points: points.to_vec(),
        }])
    }

    #[test]
    fn corners_of_the_axes_are_where_the_numbers_say() {
        let points = [(0.0, 0.0), (2.0, 10.0), (4.0, 20.0)];
        let frame = frame(&points);
        let (width, height) = (frame.width(), frame.height());
        assert_eq!((frame.x(0.0), frame.x(4.0)), (0.0, width));
        assert_eq!((frame.y(0.0), frame.y(20.0)), (height, 0.0));
        let (x, y) = (width / 2.0, height / 2.0);
        assert_eq!(frame.path(&points), format!("M0 {height}h0L{x} {y}L{width} 0"));
    }

    #[test]
    fn what_is_not_finite_is_a_gap() {
        let points = [(0.0, 1.0), (1.0, f64::NAN), (2.0, 1.0), (3.0, 1.0)];
        let path = frame(&points).path(&points);
        assert_eq!(
            (path.matches('M').count(), path.matches('L').count()),
            (2, 1),
            "{path}"
        );
    }

    #[test]
    fn a_line_that_diverges_does_not_flatten_the_others() {
        let mut points: Vec<(f64, f64)> = (0..50).map(|t| (f64::from(t), 10.0)).collect();
        points.push((50.0, 1e9));
        assert_eq!(frame(&points).y_end(), 40.0);
    }

    #[test]
    fn long_lines_are_thinned() {
        let points: Vec<(f64, f64)> = (0..100_000).map(|t| (f64::from(t), 1.0)).collect();
        assert!(frame(&points).path(&points).matches('L').count() < MOST_POINTS);
    }
}
