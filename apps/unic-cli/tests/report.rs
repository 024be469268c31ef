//! Contract: `unic eval --report` writes one HTML file that holds everything and opens offline. It
//! shows the worst frames of the clips and names those that training has used.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::{fs, path::Path, sync::LazyLock};
use tempfile::TempDir;
use unic_io::npy::Dim;

/// A capture and a model trained on it, shared by the tests of this file.
static TRAINED: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    train(folder.path(), "tube.unic", "--steps 40");
    folder
});

/// Sorted names of the files in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn the_page_shows_every_clip_and_loads_nothing() {
    let folder = TRAINED.path();
    let scores = json(folder, "eval tube.unic tube --report deep/page.html --json");
    assert_eq!(names(&folder.join("deep")), ["page.html"]);
    let page = fs::read_to_string(folder.join("deep/page.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>"));
    assert!(page.len() < 12_000_000, "{}", page.len());
    assert!(!page.contains("http://") && !page.contains("https://"));
    // Two clips of 30 frames without the first, which is given, and four error maps of each.
    assert_eq!(page.matches("<figure class=\"movie\"").count(), 2);
    assert_eq!(
        page.matches("data:image/jpeg;base64,/9j/").count(),
        2 * (FRAMES - 1 + 4)
    );
    assert_eq!(page.matches(", the worst frame of all clips</p>").count(), 1);
    assert_eq!(page.matches(", the worst of this clip</p>").count(), 1);
    assert_eq!(page.matches("the whole clip of 1.0 s").count(), 2 * 2);
    assert_eq!(page.matches("<path class=\"line").count(), 9);
    // Errors and measures of life of both clips and of all.
    assert_eq!(page.matches("<table>").count(), 2 * 3);
    assert_eq!(page.matches("life in free running").count() % 3, 0);
    assert_eq!(page.matches("<th scope=\"row\">simulation</th>").count(), 3);
    assert!(page.contains("On 2 clips that training has never seen"));
    let rmse = scores["model"]["free_running"]["rmse_mm"].as_f64().unwrap();
    assert!(page.contains(&format!("{rmse:.1} mm RMSE from the simulation")));
    // Each movie shows ridge with the model's intersection handling beside the model.
    assert_eq!(page.matches("</i>ridge handled</span>").count(), 2);
    for row in [
        "linear dynamics",
        "ridge",
        "ridge handled",
        "hold",
        "prior",
        "skinning mean",
    ] {
        assert!(page.contains(&format!("<th scope=\"row\">{row}</th>")), "{row}");
    }
}

#[test]
fn the_first_movie_is_also_written_as_a_gif() {
    let folder = TRAINED.path();
    succeeds(
        folder,
        "eval tube.unic tube --report with.html --movie deeper/with.gif",
    );
    assert_eq!(names(&folder.join("deeper")), ["with.gif"]);
    let movie = fs::read(folder.join("deeper/with.gif")).unwrap();
    assert!(movie.starts_with(b"GIF89a") && movie.ends_with(b";"));
    // Each frame begins with a graphic control extension: three bytes, its delay and transparent
    // colour, then the image. The three bytes alone may also occur within a picture.
    let begins_a_frame = |bytes: &[u8]| bytes.starts_with(&[0x21, 0xf9, 4]) && bytes[7..] == [0, 0x2c];
    let frames = movie.windows(9).filter(|bytes| begins_a_frame(bytes)).count();
    assert_eq!(frames, FRAMES - 1);
}

#[test]
fn the_page_names_clips_that_training_has_used() {
    let folder = TRAINED.path();
    for (clip, words) in [
        ("one", "On 1 clip that training has seen"),
        ("three", "On 1 clip that training was validated on"),
    ] {
        let line = format!("eval tube.unic tube --clips {clip} --report {clip}.html");
        succeeds(folder, &line);
        let page = fs::read_to_string(folder.join(format!("{clip}.html"))).unwrap();
        assert!(page.contains(words), "{clip}");
        assert!(page.contains("<p class=\"caveat\">Training "), "{clip}");
    }
}

#[test]
fn invalid_names_of_a_page_are_refused() {
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

/// Frame in which the model has its largest error.
struct WorstFrame {
    seconds: f64,
    rmse_mm: f64,
}

/// Finds the worst frame of a clip in the positions that `eval --dump` has written.
fn worst_of(dump: &Path) -> WorstFrame {
    let mut dump = unic_io::Npz::open(dump).unwrap();
    let dims = [Dim::Any("T"), Dim::Is(VERTICES), Dim::Is(3)];
    let [model, truth] =
        ["model.free_running", "truth"].map(|name| dump.array::<f32>(name, &dims).unwrap().data);
    let frames = truth.chunks(3 * VERTICES).zip(model.chunks(3 * VERTICES));
    let rmse = |(truth, model): (&[f32], &[f32])| {
        let squares = truth.iter().zip(model).map(|(a, b)| f64::from(a - b).powi(2));
        1e3 * (squares.sum::<f64>() / VERTICES as f64).sqrt()
    };
    let errors: Vec<f64> = frames.map(rmse).collect();
    let worst = (0..errors.len())
        .max_by(|&a, &b| errors[a].total_cmp(&errors[b]))
        .unwrap();
    WorstFrame {
        seconds: worst as f64 / f64::from(FPS),
        rmse_mm: errors[worst],
    }
}

#[test]
fn the_worst_frame_is_that_of_all_measured_clips() {
    let folder = TRAINED.path();
    let clips = ["one", "two", "three", "four", "five"];
    let line = format!(
        "eval tube.unic tube --clips {} --report all.html --dump dump",
        clips.join(",")
    );
    succeeds(folder, &line);
    let page = fs::read_to_string(folder.join("all.html")).unwrap();
    let mut worst: Vec<_> = clips
        .iter()
        .map(|clip| (worst_of(&folder.join(format!("dump/{clip}.npz"))), *clip))
        .collect();
    worst.sort_by(|(a, _), (b, _)| b.rmse_mm.total_cmp(&a.rmse_mm));
    let (WorstFrame { seconds, rmse_mm }, _) = &worst[0];
    let caption = format!("{seconds:.2} s: {rmse_mm:.1} mm, the worst frame of all clips");
    assert!(page.contains(&caption), "{caption}");
    assert!(page.contains("Of 5 clips the 3 with the worst frames"));
    for (rank, (_, clip)) in worst.iter().enumerate() {
        let is_shown = page.contains(&format!("<h3>{clip}, the whole clip of 1.0 s</h3>"));
        assert_eq!(is_shown, rank < 3, "{clip}");
    }
}

#[test]
fn the_title_is_escaped_and_names_capture_and_garment() {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let manifest = folder.path().join("tube/capture.toml");
    let text = fs::read_to_string(&manifest).unwrap();
    let hostile = text.replace("name = \"tube\"", "name = \"<b>tube & co</b>\"");
    assert_ne!(hostile, text);
    fs::write(
        &manifest,
        format!("{hostile}\n[source]\ngarment = \"wear/<i>coat.obj\"\n"),
    )
    .unwrap();
    train(folder.path(), "tube.unic", "--steps 4");
    succeeds(
        folder.path(),
        "eval tube.unic tube --clips four --report page.html",
    );
    let page = fs::read_to_string(folder.path().join("page.html")).unwrap();
    let title = "&lt;b&gt;tube &amp; co&lt;/b&gt;: &lt;i&gt;coat";
    assert!(page.contains(&format!("<h1>{title}</h1>")));
    assert!(page.contains(&format!("<title>{title}</title>")));
}

#[test]
fn validation_on_a_training_clip_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let only = [(unic_testdata::take("only", 0, FRAMES), unic_io::Split::Train)];
    unic_testdata::write_capture(&folder.join("tube"), &unic_testdata::Figure::tube(), &only);
    let text = succeeds(folder, &format!("train tube {SHORT} --steps 20 --out m.unic"));
    let caveat = "which it was trained on";
    assert!(text.contains(caveat), "{text}");
    let validation = &metadata(&folder.join("m.unic"))["about"]["training"]["validation"];
    assert_eq!(validation["motion"], "trained_on", "{validation}");
    let line = "eval m.unic tube --split train";
    let table = succeeds(folder, &format!("{line} --report page.html"));
    let seen = "Training has seen only: errors there are no measure of unseen motion.";
    assert!(table.contains(seen) && table.contains(caveat), "{table}");
    let scores = json(folder, &format!("{line} --json"));
    assert_eq!(scores["caveats"][0], seen);
    let page = fs::read_to_string(folder.join("page.html")).unwrap();
    assert!(page.contains(&format!("<p class=\"caveat\">{seen}</p>")));
    assert!(page.contains("mm on only, which it was trained on</dd>"));
}
