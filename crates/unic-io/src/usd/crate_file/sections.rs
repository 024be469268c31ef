//! Sections of a crate file: everything except the values.

use super::{
    compression::{integers, lz4_of_literals},
    sink::Sink,
    specs::{Spec, SpecKind},
    value::Value,
};
use crate::error::Result;
use std::collections::HashMap;

/// Length of the name of a section, bytes.
const NAME_BYTES: usize = 16;
/// Index behind the last field of a set.
const END_OF_SET: u32 = u32::MAX;

/// Tables that are collected while the specs are made.
#[derive(Debug)]
pub(super) struct Sections {
    tokens: Vec<String>,
    token_of_text: HashMap<String, u32>,
    /// Tokens of the strings.
    strings: Vec<u32>,
    /// Name and value of each field.
    fields: Vec<(u32, Value)>,
    /// Indices of fields, set after set, each with [`END_OF_SET`] behind it.
    sets: Vec<u32>,
}

impl Sections {
    /// Makes tables with one token, the empty one: the index of a property's name must not be 0.
    pub(super) fn new() -> Self {
        let mut sections = Self {
            tokens: Vec::new(),
            token_of_text: HashMap::new(),
            strings: Vec::new(),
            fields: Vec::new(),
            sets: Vec::new(),
        };
        sections.token_index("");
        sections
    }

    /// Returns a token as a value.
    pub(super) fn token(&mut self, text: &str) -> Value {
        Value::token(self.token_index(text))
    }

    /// Returns a string as a value.
    pub(super) fn string(&mut self, text: &str) -> Value {
        let token = self.token_index(text);
        self.strings.push(token);
        Value::string(self.strings.len() as u32 - 1)
    }

    /// Makes a spec without children.
    pub(super) fn spec(&mut self, name: &str, kind: SpecKind, fields: &[(&str, Value)]) -> Spec {
        let first = self.sets.len() as u32;
        for &(name, value) in fields {
            let name = self.token_index(name);
            self.sets.push(self.fields.len() as u32);
            self.fields.push((name, value));
        }
        self.sets.push(END_OF_SET);
        Spec {
            name: self.token_index(name),
            kind,
            fields: first,
            children: Vec::new(),
        }
    }

    fn token_index(&mut self, text: &str) -> u32 {
        if let Some(&index) = self.token_of_text.get(text) {
            return index;
        }
        let index = self.tokens.len() as u32;
        self.tokens.push(text.to_owned());
        self.token_of_text.insert(text.to_owned(), index);
        index
    }

    /// Writes all sections and the table of contents, and gives the file its name.
    pub(super) fn write(self, mut sink: Sink, tree: &Spec) -> Result<()> {
        let mut contents = Contents::default();
        let mut texts: Vec<u8> = Vec::new();
        for token in &self.tokens {
            texts.extend(token.as_bytes());
            texts.push(0);
        }
        contents.section(&mut sink, "TOKENS", |sink| {
            sink.numbers(&[self.tokens.len() as u64, texts.len() as u64])?;
            sized(sink, &lz4_of_literals(&texts))
        })?;
        contents.section(&mut sink, "STRINGS", |sink| {
            sink.numbers(&[self.strings.len() as u64])?;
            sink.numbers(&self.strings)
        })?;
        contents.section(&mut sink, "FIELDS", |sink| {
            let (names, values): (Vec<u32>, Vec<u64>) = self.fields.iter().map(|(n, v)| (n, v.0)).unzip();
            columns(sink, names.len(), &[&names])?;
            sized(sink, &lz4_of_literals(bytemuck::cast_slice(&values)))
        })?;
        contents.section(&mut sink, "FIELDSETS", |sink| {
            columns(sink, self.sets.len(), &[&self.sets])
        })?;
        // The path of a spec has its own index, because both are in the order of the tree.
        let indices: Vec<u32> = (0..).take(tree.count()).collect();
        contents.section(&mut sink, "PATHS", |sink| {
            let paths = tree.paths();
            // The number of paths stands before the table and in it.
            sink.numbers(&[indices.len() as u64])?;
            let [parts, jumps] = [&paths.parts, &paths.jumps].map(|column| bytemuck::cast_slice(column));
            columns(sink, indices.len(), &[&indices, parts, jumps])
        })?;
        contents.section(&mut sink, "SPECS", |sink| {
            let fields: Vec<u32> = tree.iter().map(|spec| spec.fields).collect();
            let kinds: Vec<u32> = tree.iter().map(|spec| spec.kind as u32).collect();
            columns(sink, indices.len(), &[&indices, &fields, &kinds])
        })?;
        contents.finish(sink)
    }
}

/// Writes a table: its number of rows, then its columns, each with its size before it.
fn columns(sink: &mut Sink, rows: usize, columns: &[&[u32]]) -> Result<()> {
    sink.numbers(&[rows as u64])?;
    columns
        .iter()
        .try_for_each(|column| sized(sink, &integers(column)))
}

/// Writes bytes with their number before them.
fn sized(sink: &mut Sink, bytes: &[u8]) -> Result<()> {
    sink.numbers(&[bytes.len() as u64])?;
    sink.bytes(bytes)
}

/// Table of contents.
#[derive(Debug, Default)]
struct Contents {
    rows: Vec<([u8; NAME_BYTES], [u64; 2])>,
}

impl Contents {
    fn section(
        &mut self,
        sink: &mut Sink,
        name: &str,
        write: impl FnOnce(&mut Sink) -> Result<()>,
    ) -> Result<()> {
        sink.align()?;
        let start = sink.place();
        write(sink)?;
        let mut padded = [0; NAME_BYTES];
        padded[..name.len()].copy_from_slice(name.as_bytes());
        self.rows.push((padded, [start, sink.place() - start]));
        Ok(())
    }

    fn finish(self, mut sink: Sink) -> Result<()> {
        sink.align()?;
        let place = sink.place();
        sink.numbers(&[self.rows.len() as u64])?;
        for (name, range) in self.rows {
            sink.bytes(&name)?;
            sink.numbers(&range)?;
        }
        sink.finish(place)
    }
}
