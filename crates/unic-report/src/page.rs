//! Layout of the page.

use crate::{Fact, Facts, Movie, Report, Table};
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("player.js");

/// Content security policy: the browser loads nothing from outside the page.
const POLICY: &str =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// Renders a report with the given movies in place of its own.
pub(crate) fn render(report: &Report, movies: &[Movie]) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            (head(&report.title))
            body {
                (heading(report))
                main {
                    (motion(report, movies))
                    (heat(report))
                    (drift(report))
                    (section("Scores", !report.tables.is_empty(), tables(&report.tables)))
                    (section("Facts", !report.facts.is_empty(), html! {
                        div.facts { @for group in &report.facts { (facts(group)) } }
                    }))
                    (definitions(report))
                }
                footer { (report.colophon) }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    page.into_string()
}

fn head(title: &str) -> Markup {
    html! {
        head {
            meta charset="utf-8";
            meta http-equiv="Content-Security-Policy" content=(POLICY);
            meta name="viewport" content="width=device-width, initial-scale=1";
            meta name="color-scheme" content="light dark";
            title { (title) }
            link rel="icon" href="data:,";
            style { (PreEscaped(STYLE)) }
            // The class is set before anything is drawn: strips that movies replace do not flash
            // up.
            script { "document.documentElement.classList.add('scripted')" }
        }
    }
}

fn heading(report: &Report) -> Markup {
    html! {
        header {
            h1 { (report.title) }
            p.lead { (report.lead) }
            @for caveat in &report.caveats { p.caveat { (caveat) } }
            @if !report.figures.is_empty() {
                dl.figures {
                    @for figure in &report.figures {
                        div {
                            dt { (figure.label) }
                            dd { (figure.value) @if !figure.unit.is_empty() { " " small { (figure.unit) } } }
                        }
                    }
                }
            }
        }
    }
}

/// Section with a heading; empty without content.
fn section(title: &str, has_content: bool, content: Markup) -> Markup {
    html! { @if has_content { section { h2 { (title) } (content) } } }
}

fn motion(report: &Report, movies: &[Movie]) -> Markup {
    // Movies without frames have no markup: alone they would leave an empty section.
    let moves = movies.iter().any(|movie| !movie.frames.is_empty());
    section(
        "Motion",
        moves,
        html! {
            @if !report.movies_note.is_empty() { p.note { (report.movies_note) } }
            @for movie in movies { (movie.markup()) }
        },
    )
}

fn heat(report: &Report) -> Markup {
    let Some(heat) = report.heat.as_ref().filter(|heat| !heat.strips.is_empty()) else {
        return html! {};
    };
    section("Where the errors are", true, heat.markup())
}

fn drift(report: &Report) -> Markup {
    let Some(chart) = &report.drift else {
        return html! {};
    };
    section(
        &chart.title,
        true,
        html! {
            (chart.markup())
            @if !report.drift_note.is_empty() { p.note { (report.drift_note) } }
        },
    )
}

fn tables(tables: &[Table]) -> Markup {
    html! {
        @for (i, table) in tables.iter().enumerate() {
            details open[i == 0] {
                summary { (table.title) }
                (table.markup())
            }
        }
        @if tables.iter().any(Table::has_best) { p.note { "Underlined: the best of a column." } }
    }
}

fn facts(group: &Facts) -> Markup {
    html! {
        div {
            h3 { (group.title) }
            dl { @for Fact { name, value } in &group.rows { dt { (name) } dd { (value) } } }
        }
    }
}

fn definitions(report: &Report) -> Markup {
    section(
        "What the words mean",
        !report.definitions.is_empty(),
        html! {
            dl.definitions {
                @for definition in &report.definitions { div { dt { (definition.term) } dd { (definition.meaning) } } }
            }
        },
    )
}
