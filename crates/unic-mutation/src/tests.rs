//! A harness that finds nothing proves nothing: readers with one fault each must be found.

use super::*;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const SOUND: &str = "count 3\nvalue 1.5\nvalue 2.5\nvalue 3.5\n";

/// Whether a reader of text with a fault is found out.
fn is_found(name: &str, read: fn(&str) -> Result<(), String>) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let path = workshop(folder.path(), name).join("sound.txt");
    fs::write(&path, SOUND).unwrap();
    let subject = Subject {
        name,
        path: &path,
        container: Container::Plain,
    };
    let run = || {
        survive(&subject, |path| {
            read(&String::from_utf8_lossy(&fs::read(path).unwrap()))
        })
    };
    let found = catch_unwind(AssertUnwindSafe(run)).is_err();
    let beside = fs::read_dir(folder.path().join("mutations")).unwrap().count();
    assert_eq!(
        found,
        beside == 2,
        "a file is kept exactly when something was found"
    );
    found
}

fn count_of(text: &str) -> Option<usize> {
    text.lines().next()?.strip_prefix("count ")?.parse().ok()
}

#[test]
fn a_careful_reader_passes() {
    assert!(!is_found("careful", |text| match count_of(text) {
        Some(count) if text.lines().count() == count + 1 => Ok(()),
        _ => Err("expected a count and as many values".into()),
    }));
}

#[test]
fn a_reader_that_trusts_a_count_is_found() {
    assert!(is_found("trusting", |text| {
        let count = count_of(text).ok_or("expected a count")?;
        let values: Vec<&str> = text.lines().skip(1).collect();
        (0..count).for_each(|i| assert!(!values[i].is_empty()));
        Ok(())
    }));
}

#[test]
fn a_reader_that_asks_for_what_it_is_told_to_is_found() {
    assert!(is_found("greedy", |text| {
        let count = count_of(text).ok_or("expected a count")?;
        // A refused request ends the program; this one fails as a panic.
        let mut values: Vec<f64> = Vec::new();
        values.try_reserve_exact(count).map_err(|e| e.to_string())?;
        Ok(())
    }));
}

#[test]
fn refusals_without_a_sentence_are_found() {
    assert!(is_found("mute", |text| match text {
        SOUND => Ok(()),
        _ => Err(String::new()),
    }));
    assert!(is_found("parrot", |text| match text {
        SOUND => Ok(()),
        _ => Err(format!("expected something else, found {text}")),
    }));
}

#[test]
fn archives_are_taken_apart_and_put_together() {
    let names = ["a.npy", "b.npy", "c.npy"];
    let parts = names.map(|n| (n.to_owned(), n.repeat(50).into_bytes())).to_vec();
    let archive = Parts {
        container: Container::Zip,
        parts,
    };
    let again = Parts::of(Container::Zip, &archive.bytes());
    assert_eq!(again.parts, archive.parts);
    let tensors = [&5u64.to_le_bytes()[..], b"{   }", &[1, 2, 3]].concat();
    assert_eq!(Parts::of(Container::Safetensors, &tensors).bytes(), tensors);
}

#[test]
fn a_stream_repeats() {
    let draw = |seed| container::damaged(Container::Plain, SOUND.as_bytes(), &mut Random::new("a", seed));
    let files: Vec<Vec<u8>> = (0..1000).map(draw).collect();
    assert_eq!(files, (0..1000).map(draw).collect::<Vec<_>>());
    let damaged = files.iter().filter(|f| *f != SOUND.as_bytes()).count();
    assert!(damaged > 900, "{damaged} of 1000 files are damaged");
}
