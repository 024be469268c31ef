//! The page of `unic eval --report`: one file that holds everything, written whole or not at all.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::{fs, path::Path, sync::LazyLock};
use tempfile::TempDir;

/// A capture and a model trained on it, shared by the tests of this file.
static TRAINED: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    train(folder.path(), "tube.unic", "--steps 40");
    folder
});

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_page_shows_every_clip_and_needs_nothing_else() {
    let folder = TRAINED.path();
    let scores = json(folder, "eval tube.unic tube --report deep/page.html --json");
    assert_eq!(names(&folder.join("deep")), ["page.html"]);
    let page = fs::read_to_string(folder.join("deep/page.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>"));
    assert!(page.len() < 12_000_000, "{}", page.len());
    assert!(!page.contains("http://") && !page.contains("https://"));
    // Two clips of 30 frames, of which the first is given; four error maps each.
    assert_eq!(page.matches("<figure class=\"movie\"").count(), 2);
    assert_eq!(
        page.matches("data:image/jpeg;base64,/9j/").count(),
        2 * (FRAMES - 1 + 4)
    );
    assert_eq!(page.matches("the worst frame</p>").count(), 2);
    assert_eq!(page.matches("<path class=\"line").count(), 8);
    assert_eq!(page.matches("<table>").count(), 3);
    assert!(page.contains("On 2 clips that training has never seen"));
    let rmse = scores["model"]["free_running"]["rmse_mm"].as_f64().unwrap();
    assert!(page.contains(&format!("{rmse:.1} mm RMSE from the simulation")));
    for row in ["linear dynamics", "hold", "prior", "skinning mean"] {
        assert!(page.contains(&format!("<th scope=\"row\">{row}</th>")), "{row}");
    }
}

#[test]
fn the_first_movie_comes_as_a_gif_too() {
    let folder = TRAINED.path();
    succeeds(
        folder,
        "eval tube.unic tube --report with.html --movie deeper/with.gif",
    );
    assert_eq!(names(&folder.join("deeper")), ["with.gif"]);
    let movie = fs::read(folder.join("deeper/with.gif")).unwrap();
    assert!(movie.starts_with(b"GIF89a") && movie.ends_with(b";"));
    // A graphic control extension a frame, what its delay and its transparent colour are, and the image after it. Three of
    // these bytes alone may also stand in a picture.
    let begins_a_frame = |bytes: &[u8]| bytes.starts_with(&[0x21, 0xf9, 4]) && bytes[7..] == [0, 0x2c];
    let frames = movie.windows(9).filter(|bytes| begins_a_frame(bytes)).count();
    assert_eq!(frames, FRAMES - 1);
}

#[test]
fn the_page_says_what_training_knew() {
    let folder = TRAINED.path();
    for (clip, words) in [
        ("one", "On 1 clip, some of which training has seen"),
        ("three", "On 1 clip, some of which training was steered by"),
    ] {
        let line = format!("eval tube.unic tube --clips {clip} --report {clip}.html");
        succeeds(folder, &line);
        let page = fs::read_to_string(folder.join(format!("{clip}.html"))).unwrap();
        assert!(page.contains(words), "{clip}");
    }
}

#[test]
fn what_is_no_name_of_a_page_is_refused_before_the_work() {
    let folder = TRAINED.path();
    let model = fs::read(folder.join("tube.unic")).unwrap();
    for line in [
        "eval tube.unic tube --report tube.unic",
        "eval tube.unic tube --report tube",
        "eval tube.unic tube --report tube/capture.toml",
        "eval tube.unic tube --report page.html --movie tube.unic",
        "eval tube.unic tube --report page.html --movie page.html",
        "eval --baselines tube --report page.html",
    ] {
        let output = unic(folder, line);
        assert_eq!(output.status.code(), Some(2), "{line}");
    }
    assert_eq!(fs::read(folder.join("tube.unic")).unwrap(), model);
}
