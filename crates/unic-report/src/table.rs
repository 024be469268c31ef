use maud::{Markup, html};

/// Table of numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Title of the table.
    pub title: String,
    /// Columns from left to right, without that of the rows' names.
    pub columns: Vec<TableColumn>,
    /// Rows from top to bottom; the first one is the subject of the page.
    pub rows: Vec<TableRow>,
}

/// A column of a [`Table`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TableColumn {
    /// Heading.
    pub name: String,
    /// Unit below the heading; may be empty.
    pub unit: String,
    /// Number of digits after the decimal point.
    pub digits: usize,
    /// Order of the column's numbers. The best one is bold and underlined.
    pub order: Order,
}

/// Order of numbers from good to bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The least number is the best: errors.
    LessIsBetter,
    /// The number nearest to one is the best: ratios to the ground truth.
    OneIsBest,
    /// No number is the best: the ground truth's is another one.
    Unordered,
}

/// A row of a [`Table`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableRow {
    /// Name of the model or baseline.
    pub name: String,
    /// Value of each column; missing ones count as [`Value::None`].
    pub values: Vec<Value>,
}

/// Value of a table cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Value {
    /// No number: the cell shows a dash.
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
            // Diverged numbers may have hundreds of digits before the point: they are shown with an
            // exponent below.
            Self::Number(number) if number.abs() < 1e7 => {
                // A bound on the digits keeps cells short whatever the column asks for.
                format!("{number:.digits$}", digits = digits.min(9))
            }
            Self::Number(number) if number.is_finite() => format!("{number:.1e}"),
            Self::Number(_) => "diverged".to_owned(),
        }
    }
}

impl Order {
    /// Cost of a value; the least cost is the best.
    fn cost(self, value: f64) -> f64 {
        match self {
            Self::LessIsBetter => value,
            Self::OneIsBest => (value - 1.0).abs(),
            Self::Unordered => 0.0,
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

    fn row(&self, row: &TableRow, best: &[Option<String>]) -> Markup {
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

    /// Returns true if any column has a best number.
    pub(crate) fn has_best(&self) -> bool {
        (0..self.columns.len()).any(|c| self.best(c).is_some())
    }

    /// Best number of a column as text; none without two numbers to compare.
    ///
    /// Cells are compared by their text, so that all rows with the same text are marked.
    fn best(&self, column: usize) -> Option<String> {
        let TableColumn { order, digits, .. } = self.columns.get(column)?;
        if *order == Order::Unordered {
            return None;
        }
        let values = self
            .rows
            .iter()
            .filter_map(|row| row.values.get(column)?.finite());
        let values: Vec<f64> = values.collect();
        let best = values
            .iter()
            .min_by(|a, b| order.cost(**a).total_cmp(&order.cost(**b)))?;
        (values.len() > 1).then(|| Value::Number(*best).text(*digits))
    }
}
