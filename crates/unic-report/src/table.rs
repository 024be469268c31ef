use maud::{Markup, html};

/// Numbers in rows and columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// The subject.
    pub title: String,
    /// From left to right, after the rows' names.
    pub columns: Vec<Column>,
    /// From top to bottom; the first one is what the page is about.
    pub rows: Vec<Row>,
}

/// A column of a [`Table`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Heading.
    pub name: String,
    /// Below the heading; may be empty.
    pub unit: String,
    /// Digits after the point.
    pub digits: usize,
    /// Which number of the column is the best, and printed bold.
    pub order: Order,
}

/// What is good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Errors.
    LessIsBetter,
    /// Ratios to the truth.
    OneIsBest,
}

/// A row of a [`Table`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// What was measured.
    pub name: String,
    /// One a column; missing ones count as [`Value::None`].
    pub values: Vec<Value>,
}

/// One cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Value {
    /// There is no such number.
    #[default]
    None,
    /// A number; one that is not finite is shown as diverged.
    Number(f64),
}

impl Value {
    fn finite(self) -> Option<f64> {
        match self {
            Self::Number(number) if number.is_finite() => Some(number),
            _ => None,
        }
    }

    fn text(self, digits: usize) -> String {
        match self {
            Self::None => "–".to_owned(),
            // Nobody reads more digits, and a diverged number has hundreds before the point.
            Self::Number(number) if number.abs() < 1e7 => {
                format!("{number:.digits$}", digits = digits.min(9))
            }
            Self::Number(number) if number.is_finite() => format!("{number:.1e}"),
            Self::Number(_) => "diverged".to_owned(),
        }
    }
}

impl Order {
    /// Smaller is better.
    fn badness(self, value: f64) -> f64 {
        match self {
            Self::LessIsBetter => value,
            Self::OneIsBest => (value - 1.0).abs(),
        }
    }
}

impl Table {
    pub(crate) fn markup(&self) -> Markup {
        let best: Vec<Option<String>> = (0..self.columns.len()).map(|c| self.best(c)).collect();
        html! {
            div.scroll tabindex="0" role="region" aria-label=(self.title) {
                table {
                    thead { tr {
                        td {}
                        @for column in &self.columns {
                            th scope="col" { (column.name) @if !column.unit.is_empty() { span.unit { (column.unit) } } }
                        }
                    } }
                    tbody { @for row in &self.rows { (self.row(row, &best)) } }
                }
            }
        }
    }

    fn row(&self, row: &Row, best: &[Option<String>]) -> Markup {
        let cells = self.columns.iter().zip(best).enumerate();
        html! {
            tr {
                th scope="row" { (row.name) }
                @for (c, (column, best)) in cells {
                    @let value = row.values.get(c).copied().unwrap_or_default();
                    @let text = value.text(column.digits);
                    td.best[best.as_ref() == Some(&text)] { (text) }
                }
            }
        }
    }

    /// Does any number stand out?
    pub(crate) fn has_best(&self) -> bool {
        (0..self.columns.len()).any(|c| self.best(c).is_some())
    }

    /// The best number of a column as it is printed, so that rows that print the same stand out together; none
    /// where there is nothing to compare.
    fn best(&self, column: usize) -> Option<String> {
        let Column { order, digits, .. } = self.columns.get(column)?;
        let values = self
            .rows
            .iter()
            .filter_map(|row| row.values.get(column)?.finite());
        let values: Vec<f64> = values.collect();
        let best = values
            .iter()
            .min_by(|a, b| order.badness(**a).total_cmp(&order.badness(**b)))?;
        (values.len() > 1).then(|| Value::Number(*best).text(*digits))
    }
}
