use crate::{Chart, HeatMap, Movie, Table, page};

/// Largest size of a page, bytes: mail servers and issue trackers accept it as an attachment.
pub const MAX_PAGE_BYTES: usize = 12_000_000;

/// Contents of a page from top to bottom. Empty fields leave no trace.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Heading and window title.
    pub title: String,
    /// Result in one sentence.
    pub lead: String,
    /// Reasons to doubt the result, one sentence each, set off below it.
    pub caveats: Vec<String>,
    /// Result as a few large numbers; the first one is the subject of the page.
    pub figures: Vec<KeyFigure>,
    /// Moving pictures.
    pub movies: Vec<Movie>,
    /// Text above the movies; may be empty.
    pub movies_note: String,
    /// Error maps of the garment.
    pub heat: Option<HeatMap>,
    /// Chart of the error over time.
    pub drift: Option<Chart>,
    /// Text below the chart; may be empty.
    pub drift_note: String,
    /// Tables, of which the first one is expanded.
    pub tables: Vec<Table>,
    /// Groups of facts about the model, the data and the measurement.
    pub facts: Vec<Facts>,
    /// Definitions of the terms in rows and columns.
    pub definitions: Vec<Definition>,
    /// Last line: program and date.
    pub colophon: String,
}

/// A large number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeyFigure {
    /// Number as text.
    pub value: String,
    /// Unit of the number; may be empty.
    pub unit: String,
    /// Meaning of the number, in a few words.
    pub label: String,
}

/// Group of facts under a heading.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// Heading.
    pub title: String,
    /// Facts from top to bottom.
    pub rows: Vec<Fact>,
}

/// A name with its value.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Fact {
    /// Name.
    pub name: String,
    /// Value as text.
    pub value: String,
}

/// Definition of a term.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Definition {
    /// Term as it appears in a table.
    pub term: String,
    /// Meaning of the term, in one sentence.
    pub meaning: String,
}

impl Report {
    /// Renders the page.
    ///
    /// If it would exceed [`MAX_PAGE_BYTES`], all movies show every second, third, ... frame at a
    /// lower frame rate, or are left out. Text, charts and heat maps are never cut.
    pub fn html(&self) -> String {
        // The page without movies is rendered once to find its size.
        let room = MAX_PAGE_BYTES.saturating_sub(page::render(self, &[]).len());
        let most = self
            .movies
            .iter()
            .map(|movie| movie.frames.len())
            .max()
            .unwrap_or(0);
        let bytes = |stride| {
            self.movies
                .iter()
                .map(|movie| movie.most_bytes(stride))
                .sum::<usize>()
        };
        // The bound is computed from sizes alone: no page is rendered to be thrown away.
        let stride = (1..=most).find(|&stride| bytes(stride) <= room);
        let movies: Vec<Movie> = match stride {
            Some(stride) => self.movies.iter().map(|movie| movie.thinned(stride)).collect(),
            None => Vec::new(),
        };
        page::render(self, &movies)
    }
}
