//! Contract: the program in docs/embedding.md is the example that runs.

const PAGE: &str = include_str!("../../../docs/embedding.md");
const EXAMPLE: &str = include_str!("../examples/embed.rs");

#[test]
fn the_page_shows_the_example() {
    let program = EXAMPLE.split_once("\n\n").map_or("", |(_, program)| program);
    assert!(program.starts_with("use "), "{program}");
    assert!(
        PAGE.contains(&format!("```rust,no_run\n{program}```\n")),
        "docs/embedding.md has another program than crates/unic-io/examples/embed.rs:\n{program}"
    );
}
