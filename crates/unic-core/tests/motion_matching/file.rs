//! The file of a database: round trip, and bytes that are refused.

use crate::common::{FIGURE_MIRROR, build, figure, figure_settings, gliding, winding};
use unic_core::motion_matching::{ChecksumRule, Database, DatabaseFileError};

fn database() -> Database {
    let mut settings = figure_settings();
    settings.mirror = Some(FIGURE_MIRROR.to_vec());
    build(&figure(), &[gliding(40, 0.3), winding(70, 1.1)], settings)
}

#[test]
fn a_database_that_is_read_is_the_one_that_was_written() {
    let bytes = database().to_bytes().unwrap();
    let read = Database::from_bytes(&bytes).unwrap();
    assert_eq!(read, database());
    assert_eq!(read.to_bytes().unwrap(), bytes);
}

#[test]
fn other_bytes_are_refused() {
    let sound = database().to_bytes().unwrap();
    let changed = |at: usize| {
        let mut bytes = sound.clone();
        bytes[at] ^= 1;
        Database::from_bytes(&bytes).unwrap_err()
    };
    assert!(matches!(Database::from_bytes(b""), Err(DatabaseFileError::Magic)));
    assert!(matches!(changed(0), DatabaseFileError::Magic));
    assert!(matches!(
        changed(8),
        DatabaseFileError::Version { expected: 1, .. }
    ));
    for at in [12, 20, 30, sound.len() / 2, sound.len() - 1] {
        assert!(
            matches!(changed(at), DatabaseFileError::Damaged { .. }),
            "byte {at}"
        );
    }
    let read = |bytes: &[u8]| Database::from_bytes_with(bytes, ChecksumRule::Ignore).unwrap_err();
    assert!(matches!(
        read(&sound[..sound.len() - 4]),
        DatabaseFileError::Length { .. }
    ));
}

/// Sizes that a header states are compared with the length of the file before anything is
/// allocated.
#[test]
fn hostile_sizes_are_refused() {
    let sound = database().to_bytes().unwrap();
    let header = u32::from_le_bytes(sound[16..20].try_into().unwrap()) as usize;
    let text = String::from_utf8(sound[24..24 + header].to_vec()).unwrap();
    let names: Vec<String> = (0..33).map(|i| format!("\"tag {i}\"")).collect();
    let too_many = format!("\"tags\":[{}]", names.join(","));
    for (from, to) in [
        ("\"frames\":220", "\"frames\":18446744073709551615"),
        ("\"len\":40", "\"len\":18446744073709551615"),
        ("\"len\":40", "\"len\":0"),
        ("\"first\":40", "\"first\":39"),
        ("\"fps\":30.0", "\"fps\":0.0"),
        ("\"tags\":[]", too_many.as_str()),
        ("\"tags\":[]", "\"tags\":[\"walk\",\"walk\"]"),
    ] {
        assert!(text.contains(from), "{from}");
        let changed = text.replacen(from, to, 1);
        let mut bytes = sound[..16].to_vec();
        bytes.extend((changed.len() as u32).to_le_bytes());
        bytes.extend([0; 4]);
        bytes.extend(changed.as_bytes());
        bytes.resize(bytes.len().next_multiple_of(16), b' ');
        bytes.extend(&sound[(24 + header).next_multiple_of(16)..]);
        let mut refused = false;
        let counted = allocation_counter::measure(|| {
            refused = Database::from_bytes_with(&bytes, ChecksumRule::Ignore).is_err();
        });
        assert!(refused, "{to}");
        assert!(
            counted.bytes_max < 4 * bytes.len() as u64,
            "{to}: {} bytes",
            counted.bytes_max
        );
    }
}
