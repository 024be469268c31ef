//! Contract of the fuzzer: it finds the fault of every faulty reader, and passes a careful one.

use super::*;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const VALID: &str = "count 3\nvalue 1.5\nvalue 2.5\nvalue 3.5\n";

/// Returns true if the fuzzer finds a fault of a reader of text.
fn is_found(name: &str, read: fn(&str) -> Result<(), String>) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let path = scratch_folder(folder.path(), name).join("valid.txt");
    fs::write(&path, VALID).unwrap();
    let target = FuzzTarget {
        name,
        path: &path,
        container: Container::Plain,
    };
    let run = || {
        fuzz(&target, |path| {
            read(&String::from_utf8_lossy(&fs::read(path).unwrap()))
        })
    };
    let found = catch_unwind(AssertUnwindSafe(run)).is_err();
    let beside = fs::read_dir(folder.path().join("mutations")).unwrap().count();
    assert_eq!(
        found,
        beside == 2,
        "a file is kept if and only if a fault was found"
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
fn a_reader_that_allocates_a_claimed_size_is_found() {
    assert!(is_found("greedy", |text| {
        let count = count_of(text).ok_or("expected a count")?;
        // `try_reserve_exact` returns an error where a refused request would abort the program.
        let mut values: Vec<f64> = Vec::new();
        values.try_reserve_exact(count).map_err(|e| e.to_string())?;
        Ok(())
    }));
}

#[test]
fn refusals_without_a_valid_sentence_are_found() {
    assert!(is_found("empty message", |text| match text {
        VALID => Ok(()),
        _ => Err(String::new()),
    }));
    assert!(is_found("repeated file", |text| match text {
        VALID => Ok(()),
        _ => Err(format!("expected something else, found {text}")),
    }));
}

#[test]
fn containers_are_split_and_assembled() {
    let part = |name: &str| container::Part {
        name: name.to_owned(),
        content: name.repeat(50).into_bytes(),
    };
    let archive = Parts {
        container: Container::Zip,
        parts: ["a.npy", "b.npy", "c.npy"].map(part).to_vec(),
    };
    let again = Parts::of(Container::Zip, &archive.bytes());
    assert_eq!(again.parts, archive.parts);
    let tensors = [&5u64.to_le_bytes()[..], b"{   }", &[1, 2, 3]].concat();
    assert_eq!(Parts::of(Container::Safetensors, &tensors).bytes(), tensors);
}

#[test]
fn the_same_seeds_give_the_same_files() {
    let draw = |seed| container::damaged(Container::Plain, VALID.as_bytes(), &mut Random::new("a", seed));
    let files: Vec<Vec<u8>> = (0..1000).map(draw).collect();
    assert_eq!(files, (0..1000).map(draw).collect::<Vec<_>>());
    let damaged = files.iter().filter(|f| *f != VALID.as_bytes()).count();
    assert!(damaged > 900, "{damaged} of 1000 files are damaged");
}
