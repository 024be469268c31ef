//! Contract of a page: it is well-formed and self-contained, escapes all text, and stays within its
//! size for any input.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use proptest::prelude::*;
use scraper::{Html, Selector};
use unic_report::*;

const HOSTILE: &str = "</script><script>alert(1)</script> \"'&<img src=x onerror=y>";

fn picture(bytes: usize) -> Picture {
    Picture {
        format: PictureFormat::Jpeg,
        bytes: vec![0xa5; bytes],
        width: 96,
        height: 64,
    }
}

fn movie(frames: usize, bytes: usize) -> Movie {
    let frame = |t: usize| MovieFrame {
        picture: picture(bytes),
        time: format!("{t} s"),
        values: vec![String::new(), format!("{t} mm")],
    };
    let view = |name: &str, series| MovieView {
        name: name.into(),
        series,
    };
    Movie {
        title: format!("walk {HOSTILE}"),
        note: HOSTILE.into(),
        fps: 30.0,
        views: vec![view("simulation", None), view(HOSTILE, Some(0))],
        frames: (0..frames).map(frame).collect(),
    }
}

fn chart(points: Vec<(f64, f64)>) -> Chart {
    let series = |name: &str| Series {
        name: name.into(),
        points: points.clone(),
    };
    Chart {
        title: "Drift".into(),
        x: "time, s".into(),
        y: "RMSE, mm".into(),
        series: vec![series(HOSTILE), series("ridge")],
    }
}

fn table(values: [f64; 2]) -> Table {
    let column = |order| TableColumn {
        name: HOSTILE.into(),
        unit: "mm".into(),
        digits: 1,
        order,
    };
    let row = |value: f64| TableRow {
        name: HOSTILE.into(),
        values: vec![Value::Number(value), Value::None],
    };
    Table {
        title: HOSTILE.into(),
        columns: vec![column(Order::LessIsBetter), column(Order::OneIsBest)],
        rows: values.map(row).to_vec(),
    }
}

fn full(movies: Vec<Movie>) -> Report {
    let text = || HOSTILE.to_owned();
    Report {
        title: text(),
        lead: text(),
        caveats: vec![text(), text()],
        figures: vec![KeyFigure {
            value: text(),
            unit: text(),
            label: text(),
        }],
        movies,
        movies_note: text(),
        heat: Some(HeatMap {
            bar: ColourBar {
                stops: vec![[0, 0, 0], [9, 99, 255]],
                max: 50.0,
                unit: "mm".into(),
            },
            strips: vec![HeatStrip {
                title: text(),
                pictures: vec![CaptionedPicture {
                    picture: picture(60),
                    caption: text(),
                }],
            }],
            note: text(),
        }),
        drift: Some(chart(vec![(0.0, 1.0), (1.0, 2.0)])),
        drift_note: text(),
        tables: vec![table([1.0, 2.0]), table([f64::NAN, 1e300])],
        facts: vec![Facts {
            title: text(),
            rows: vec![Fact {
                name: text(),
                value: text(),
            }],
        }],
        definitions: vec![Definition {
            term: text(),
            meaning: text(),
        }],
        colophon: text(),
    }
}

fn parse(page: &str) -> Html {
    let document = Html::parse_document(page);
    assert!(document.errors.is_empty(), "{:?}", document.errors);
    document
}

fn count(document: &Html, selector: &str) -> usize {
    document.select(&Selector::parse(selector).unwrap()).count()
}

/// Asserts that nothing makes a browser load data from outside the page.
fn assert_self_contained(document: &Html) {
    for element in document.select(&Selector::parse("*").unwrap()) {
        for (name, value) in element.value().attrs() {
            let is_link = ["src", "href", "srcset", "action", "poster", "data"].contains(&name);
            assert!(!is_link || value.starts_with("data:"), "{name}={value}");
            assert!(!name.starts_with("on"), "{name}={value}");
            assert!(!value.contains("url("), "{name}={value}");
        }
    }
    for element in document.select(&Selector::parse("style, script").unwrap()) {
        let text: String = element.text().collect();
        for outside in ["http", "url(", "@import", "//cdn", "fetch(", "import("] {
            assert!(!text.contains(outside), "{outside}");
        }
    }
}

/// Asserts that every number of every drawing is finite and small.
fn assert_drawings_are_finite(document: &Html) {
    let mut numbers = 0;
    for element in document.select(&Selector::parse("svg, svg *").unwrap()) {
        let shape = element.value().attrs().filter(|(name, _)| {
            [
                "d",
                "x",
                "y",
                "x1",
                "x2",
                "y1",
                "y2",
                "width",
                "height",
                "viewBox",
                "transform",
            ]
            .contains(name)
        });
        for (name, value) in shape {
            let separated = value.replace(|c: char| c.is_ascii_alphabetic() || "(),".contains(c), " ");
            for number in separated.split_whitespace() {
                assert!(number.parse::<f64>().unwrap().abs() < 1e5, "{name}={value}");
                numbers += 1;
            }
            assert!(!value.contains("NaN") && !value.contains("inf"), "{name}={value}");
        }
    }
    assert!(numbers > 0);
}

#[test]
fn a_full_page_is_well_formed_and_self_contained() {
    let page = full(vec![movie(7, 90), movie(1, 90)]).html();
    let document = parse(&page);
    assert_self_contained(&document);
    assert_drawings_are_finite(&document);
    assert_eq!(count(&document, "section"), 6);
    assert_eq!(count(&document, ".movie"), 2);
    assert_eq!(count(&document, ".frames img"), 8);
    assert_eq!(count(&document, ".controls"), 1);
    assert_eq!(count(&document, "details"), 2);
    assert_eq!(count(&document, "details[open]"), 1);
}

#[test]
fn text_is_escaped() {
    let report = full(vec![movie(3, 90)]);
    let document = parse(&report.html());
    assert_eq!(count(&document, "script"), 2);
    assert_eq!(count(&document, "img"), 4);
    assert_eq!(count(&document, "[onerror]"), 0);
    let heading = document.select(&Selector::parse("h1").unwrap()).next().unwrap();
    assert_eq!(heading.text().collect::<String>(), HOSTILE);
}

#[test]
fn without_scripts_a_strip_of_pictures_is_visible() {
    let document = parse(&full(vec![movie(50, 90)]).html());
    assert_eq!(count(&document, ".frames img.still"), 4);
    assert_eq!(
        count(
            &document,
            ".frames[hidden], .frames img[hidden], .frames img[loading]"
        ),
        0
    );
    assert_eq!(count(&document, ".controls[hidden]"), 1);
    assert_eq!(count(&document, "canvas[hidden]"), 1);
}

#[test]
fn an_empty_report_is_a_page_without_sections() {
    let document = parse(&Report::default().html());
    assert_eq!(count(&document, "section"), 0);
    assert_eq!(count(&document, ".caveat"), 0);
    let hollow = Report {
        movies: vec![Movie::default()],
        heat: Some(HeatMap::default()),
        drift: Some(Chart::default()),
        tables: vec![Table::default()],
        ..Report::default()
    };
    let document = parse(&hollow.html());
    assert_drawings_are_finite(&document);
}

#[test]
fn movies_lose_frames_before_a_page_grows_too_large() {
    // 40 MB of pictures: only every fourth frame fits.
    let document = full(vec![movie(300, 50_000), movie(300, 50_000)]);
    let page = document.html();
    assert!(page.len() <= MAX_PAGE_BYTES, "{}", page.len());
    assert!(page.len() > MAX_PAGE_BYTES / 2, "{}", page.len());
    let parsed = parse(&page);
    assert_eq!(count(&parsed, ".frames img"), 150);
    assert_eq!(count(&parsed, ".movie[data-fps='7.5']"), 2);
    let hopeless = full(vec![movie(1, MAX_PAGE_BYTES)]).html();
    assert!(hopeless.len() < 100_000);
    assert_eq!(count(&parse(&hopeless), ".movie"), 0);
}

#[test]
fn caveats_stand_between_the_result_and_its_numbers() {
    let document = parse(&full(vec![]).html());
    assert_eq!(
        count(&document, "header > .lead + .caveat + .caveat + .figures"),
        1
    );
}

#[test]
fn small_movies_keep_every_frame() {
    let document = parse(&full(vec![movie(300, 10_000)]).html());
    assert_eq!(count(&document, ".frames img"), 300);
}

#[test]
fn the_best_number_of_a_column_is_marked() {
    let best = |values: [f64; 2]| {
        let report = Report {
            tables: vec![table(values)],
            ..Report::default()
        };
        let document = parse(&report.html());
        let selector = Selector::parse("td.best").unwrap();
        let cells = document.select(&selector);
        cells
            .map(|cell| cell.text().collect::<String>())
            .collect::<Vec<_>>()
    };
    assert_eq!(best([3.0, 2.0]), ["2.0"]);
    assert_eq!(best([3.0, f64::NAN]), Vec::<String>::new());
    // Numbers with the same text are equally good.
    assert_eq!(best([2.04, 2.01]), ["2.0", "2.0"]);
    let page = Report {
        tables: vec![table([f64::NAN, 2.0])],
        ..Report::default()
    };
    assert!(page.html().contains("diverged"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_numbers_make_a_page(points: Vec<(f64, f64)>, values: [f64; 2], fps: f32, max: f32) {
        let mut report = full(vec![Movie { fps, ..movie(2, 30) }]);
        report.drift = Some(chart(points));
        report.tables = vec![table(values)];
        if let Some(heat) = &mut report.heat {
            heat.bar.max = max;
        }
        let page = report.html();
        prop_assert!(page.len() < 200_000);
        assert_drawings_are_finite(&parse(&page));
    }

    #[test]
    fn any_text_makes_a_page(text: String) {
        let report = Report { title: text.clone(), drift: Some(chart(vec![])), ..full(vec![]) };
        let document = Html::parse_document(&report.html());
        prop_assert_eq!(count(&document, "script"), 2);
    }
}
