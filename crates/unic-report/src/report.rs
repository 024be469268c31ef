use crate::{Chart, HeatMap, Movie, Table, page};

/// Most bytes of a page: what a mail or an issue still takes.
pub const MAX_PAGE_BYTES: usize = 12_000_000;

/// Everything that a page says, in its order; what is empty leaves no trace.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Heading, and the window's title.
    pub title: String,
    /// One sentence with the result.
    pub lead: String,
    /// Reasons why the result does not mean what it seems to, a sentence each, set off below it.
    pub caveats: Vec<String>,
    /// The same as numbers to be seen from afar; the first is what the page is about.
    pub figures: Vec<KeyFigure>,
    /// Moving pictures.
    pub movies: Vec<Movie>,
    /// Above them; may be empty.
    pub movies_note: String,
    /// Where on the garment the errors are.
    pub heat: Option<HeatMap>,
    /// How the error grows.
    pub drift: Option<Chart>,
    /// Below the chart; may be empty.
    pub drift_note: String,
    /// The first is open, the others can be opened.
    pub tables: Vec<Table>,
    /// What was measured, with what, on what.
    pub facts: Vec<Facts>,
    /// The footnote: what each row and column means.
    pub definitions: Vec<Definition>,
    /// The last line: who made this page, and when.
    pub colophon: String,
}

/// A large number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeyFigure {
    /// The number as text.
    pub value: String,
    /// Its unit.
    pub unit: String,
    /// What it is.
    pub label: String,
}

/// Names and values under a heading.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// Heading.
    pub title: String,
    /// Name and value.
    pub rows: Vec<(String, String)>,
}

/// What a word means.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Definition {
    /// As in a table.
    pub term: String,
    /// One sentence.
    pub meaning: String,
}

impl Report {
    /// The page.
    ///
    /// Where it would exceed [`MAX_PAGE_BYTES`], all movies show every second, third, ... frame, at
    /// as much lower a rate, or are left out; text, charts and heat maps are never cut.
    pub fn html(&self) -> String {
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
        let stride = (1..=most).find(|&stride| bytes(stride) <= room);
        let movies: Vec<Movie> = match stride {
            Some(stride) => self.movies.iter().map(|movie| movie.thinned(stride)).collect(),
            None => Vec::new(),
        };
        page::render(self, &movies)
    }
}
