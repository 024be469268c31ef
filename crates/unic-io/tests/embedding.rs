//! Contract: docs/guides/embed.md shows the program of crates/unic-core/examples/embed.rs.

const PAGE: &str = include_str!("../../../docs/guides/embed.md");
const EXAMPLE: &str = include_str!("../../unic-core/examples/embed.rs");

#[test]
fn page_shows_the_example() {
    let program = EXAMPLE.split_once("\n\n").map_or("", |(_, program)| program);
    assert!(program.starts_with("use "), "{program}");
    assert!(
        PAGE.contains(&format!("```rust,no_run\n{program}```\n")),
        "docs/guides/embed.md has another program than crates/unic-core/examples/embed.rs:\n{program}"
    );
}
