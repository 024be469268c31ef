use crate::axis::{short_number, ticks_from_zero};
use maud::{Markup, html};
use std::fmt::Write;

/// Line chart whose two axes start at zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// Title of the section, which also describes the drawing for screen readers.
    pub title: String,
    /// Quantity and unit of the horizontal axis.
    pub x: String,
    /// Quantity and unit of the vertical axis.
    pub y: String,
    /// Lines of the chart. The first one is the subject of the page and is drawn bold.
    pub series: Vec<Series>,
}

/// A line of a [`Chart`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y) by ascending x. Negative and non-finite values leave a gap.
    pub points: Vec<(f64, f64)>,
}

/// Size of the drawing, user units.
const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 300.0;

/// Margins between the border of the drawing and the axes, user units.
const LEFT: f64 = 58.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 48.0;

/// Most points of a line: a drawing cannot show more.
const MOST_POINTS: usize = 720;

/// Largest end of the vertical axis, in medians of all values.
///
/// A line that diverges leaves the drawing, and the others stay readable.
const MOST_MEDIANS: f64 = 4.0;

/// Number of series colours in the style sheet.
const COLOURS: usize = 9;

/// CSS class of a series' colour.
pub(crate) fn colour_class(series: usize) -> String {
    format!("s{}", series % COLOURS)
}

impl Chart {
    pub(crate) fn markup(&self) -> Markup {
        let axes = Axes::around(&self.series);
        html! {
            figure.chart {
                ul.legend {
                    @for (i, series) in self.series.iter().enumerate() {
                        li { i.dot.(colour_class(i)) {} (series.name) }
                    }
                }
                svg viewBox=(format!("0 0 {WIDTH} {HEIGHT}")) role="img" aria-label=(self.title) {
                    (axes.markup())
                    text.name x=(LEFT + axes.width() / 2.0) y=(HEIGHT - 6.0) text-anchor="middle" { (self.x) }
                    text.name transform=(format!("translate(14 {}) rotate(-90)", TOP + axes.height() / 2.0))
                        text-anchor="middle" { (self.y) }
                    // An inner drawing clips lines at its border.
                    svg x=(LEFT) y=(TOP) width=(axes.width()) height=(axes.height()) {
                        // In reverse, so that the first line is drawn over the others.
                        @for (i, series) in self.series.iter().enumerate().rev() {
                            path.line.(colour_class(i)) d=(axes.path(&series.points)) {}
                        }
                    }
                }
            }
        }
    }
}

/// Axes of a drawing, which map numbers to user units.
struct Axes {
    /// Largest x.
    x_end: f64,
    x_ticks: Vec<f64>,
    /// Ticks of the vertical axis, which ends at the last one.
    y_ticks: Vec<f64>,
}

impl Axes {
    /// Axes that show all series.
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
        // The upper median of an even number of values is good enough for a limit.
        let median = heights.get(heights.len() / 2).copied().unwrap_or(0.0);
        let y_end = match median > 0.0 {
            true => highest.min(MOST_MEDIANS * median),
            false => highest,
        };
        let x_ticks = ticks_from_zero(x_end, 8);
        Self {
            // Lines end at the right border; an axis without any length takes that of its ticks.
            x_end: match x_end > 1e-9 && x_end.is_finite() {
                true => x_end,
                false => x_ticks[x_ticks.len() - 1],
            },
            x_ticks,
            y_ticks: ticks_from_zero(y_end, 5),
        }
    }

    /// Width of the area between the axes, user units.
    fn width(&self) -> f64 {
        WIDTH - LEFT - RIGHT
    }

    /// Height of the area between the axes, user units.
    fn height(&self) -> f64 {
        HEIGHT - TOP - BOTTOM
    }

    /// Largest y.
    fn y_end(&self) -> f64 {
        self.y_ticks.last().copied().unwrap_or(1.0)
    }

    /// Distance of x from the left border of the axes, user units.
    fn x(&self, x: f64) -> f64 {
        x / self.x_end * self.width()
    }

    /// Distance of y from the top border of the axes, user units.
    fn y(&self, y: f64) -> f64 {
        // Values far outside the drawing are clamped, so that their numbers stay short.
        (1.0 - (y / self.y_end()).min(10.0)) * self.height()
    }

    fn markup(&self) -> Markup {
        let (right, bottom) = (LEFT + self.width(), TOP + self.height());
        html! {
            @for &tick in &self.y_ticks {
                @let y = short(TOP + self.y(tick));
                line.rule x1=(LEFT) x2=(right) y1=(y) y2=(y) {}
                text x=(LEFT - 8.0) y=(y) dy="0.35em" text-anchor="end" { (short_number(tick)) }
            }
            @for &tick in self.x_ticks.iter().filter(|&&tick| tick <= self.x_end * (1.0 + 1e-9)) {
                @let x = short(LEFT + self.x(tick));
                line.tick x1=(x) x2=(x) y1=(bottom) y2=(bottom + 4.0) {}
                text x=(x) y=(bottom + 18.0) text-anchor="middle" { (short_number(tick)) }
            }
        }
    }

    /// SVG path of a line, relative to the top left corner of the axes.
    fn path(&self, points: &[(f64, f64)]) -> String {
        // Every n-th point is kept; peaks between them may be lost.
        let stride = points.len().div_ceil(MOST_POINTS).max(1);
        let mut path = String::new();
        let mut is_drawing = false;
        for point in points.iter().step_by(stride) {
            if is_drawable(point) {
                let (x, y) = (short(self.x(point.0)), short(self.y(point.1)));
                // Writing to a string cannot fail. `h0` draws a dot for a point between two gaps.
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

/// Returns true for a point inside the drawing or above it.
fn is_drawable((x, y): &(f64, f64)) -> bool {
    let usable = |value: f64| value.is_finite() && (0.0..1e12).contains(&value);
    usable(*x) && usable(*y)
}

/// Rounds to a tenth of a user unit, which keeps paths short.
fn short(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(points: &[(f64, f64)]) -> Axes {
        Axes::around(&[Series {
            name: String::new(),
            points: points.to_vec(),
        }])
    }

    #[test]
    fn extreme_values_lie_in_the_corners_of_the_axes() {
        let points = [(0.0, 0.0), (2.0, 10.0), (4.0, 20.0)];
        let axes = axes(&points);
        let (width, height) = (axes.width(), axes.height());
        assert_eq!((axes.x(0.0), axes.x(4.0)), (0.0, width));
        assert_eq!((axes.y(0.0), axes.y(20.0)), (height, 0.0));
        let (x, y) = (width / 2.0, height / 2.0);
        assert_eq!(axes.path(&points), format!("M0 {height}h0L{x} {y}L{width} 0"));
    }

    #[test]
    fn non_finite_values_leave_a_gap() {
        let points = [(0.0, 1.0), (1.0, f64::NAN), (2.0, 1.0), (3.0, 1.0)];
        let path = axes(&points).path(&points);
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
        assert_eq!(axes(&points).y_end(), 40.0);
    }

    #[test]
    fn long_lines_are_thinned() {
        let points: Vec<(f64, f64)> = (0..100_000).map(|t| (f64::from(t), 1.0)).collect();
        assert!(axes(&points).path(&points).matches('L').count() < MOST_POINTS);
    }
}
