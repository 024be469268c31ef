//! Contract: `unic demo --quick` makes a report, a model and an animation from nothing. It skips
//! finished stages, and never replaces files of other work.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::fs;

#[test]
fn a_demo_writes_all_results_and_skips_finished_stages() {
    let folder = tempfile::tempdir().unwrap();
    let stdout = succeeds(folder.path(), "demo --quick");
    assert!(stdout.contains("unic_demo/report.html"), "{stdout}");
    let out = folder.path().join("unic_demo");
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>"), "{}", &page[..60]);
    assert!(
        !page.contains("http://") && !page.contains("https://"),
        "the page must open offline"
    );
    let animation = fs::read(out.join("animation.glb")).unwrap();
    assert_eq!(&animation[..4], b"glTF");
    let model = fs::read(out.join("demo.unic")).unwrap();

    // A stage whose file is missing runs again. The others do not.
    fs::remove_file(out.join("animation.glb")).unwrap();
    succeeds(folder.path(), "demo --quick");
    assert_eq!(fs::read(out.join("animation.glb")).unwrap(), animation);
    assert_eq!(fs::read(out.join("demo.unic")).unwrap(), model);

    let other = unic(folder.path(), "demo --quick --garment skirt");
    assert_eq!(other.status.code(), Some(2));
    let text = String::from_utf8_lossy(&other.stderr);
    assert!(
        text.contains("demo.toml") && text.contains("--overwrite"),
        "{text}"
    );
    #[cfg(unix)]
    {
        // The first stage is enough to see that all of them start anew.
        let line = "demo --quick --garment skirt --overwrite";
        interrupted(folder.path(), line, "unic_demo/capture/simulation.toml", "skirt");
        let results = [
            "capture/capture.toml",
            "demo.unic",
            "report.html",
            "animation.glb",
        ];
        let kept = results.iter().chain(&["demo.run/config.toml"]);
        let kept: Vec<_> = kept.filter(|name| out.join(name).exists()).collect();
        assert!(kept.is_empty(), "{kept:?}");
    }
}

#[test]
fn a_folder_with_other_files_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("mine")).unwrap();
    fs::write(folder.path().join("mine/report.html"), "mine").unwrap();
    fs::write(folder.path().join("mine/lock"), "mine, too").unwrap();
    let refused = unic(folder.path(), "demo --quick --out mine");
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("mine/report.html"));
    let mut kept: Vec<_> = fs::read_dir(folder.path().join("mine"))
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    kept.sort();
    assert_eq!(kept, ["lock", "report.html"]);
    assert_eq!(fs::read(folder.path().join("mine/report.html")).unwrap(), b"mine");
}
