//! Entry of the library, which the engine finds by its symbol.
#![allow(
    unsafe_code,
    reason = "the trait is the contract with the engine's C interface"
)]

use godot::init::{ExtensionLibrary, gdextension};

/// Extension as the engine sees it.
struct UnicExtension;

// SAFETY: the macro writes the entry point, and the methods are those of the crate `godot`.
#[gdextension]
unsafe impl ExtensionLibrary for UnicExtension {}
