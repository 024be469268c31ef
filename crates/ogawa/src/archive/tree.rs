//! Reading the tree of objects and their properties.

use super::{
    HASHES_LENGTH,
    fields::Fields,
    headers::{ObjectHeader, PropertyHeader},
    metadata::Metadata,
    object::{Object, ObjectId},
    property::{Content, Property, Samples},
};
use crate::{
    container::{Child, Container, Group},
    error::{Error, Result},
};
use std::{
    collections::HashSet,
    io::{Read, Seek},
};

/// Largest number of ancestors of an object.
const MAX_OBJECT_DEPTH: u16 = 1000;
/// Largest number of compounds around a property.
const MAX_COMPOUND_DEPTH: u16 = 64;

/// Reader of all headers of a file.
///
/// Broken files can point to the same bytes many times. Headers are read once, and no more bytes of
/// them than the file has, so that time and memory stay in proportion to the file.
pub(super) struct TreeReader<'a, R> {
    container: &'a mut Container<R>,
    /// Metadata that headers refer to by index.
    table: &'a [Metadata],
    samplings: usize,
    /// Number of bytes of headers that may still be read.
    budget: u64,
    /// Offsets of groups that have been read.
    visited: HashSet<u64>,
}

impl<'a, R: Read + Seek> TreeReader<'a, R> {
    pub(super) fn new(container: &'a mut Container<R>, table: &'a [Metadata], samplings: usize) -> Self {
        Self {
            budget: container.file_len(),
            container,
            table,
            samplings,
            visited: HashSet::new(),
        }
    }

    /// Reads all objects, parents before their children.
    pub(super) fn read(mut self, top: Group, metadata: Metadata) -> Result<Vec<Object>> {
        let header = ObjectHeader {
            name: "".into(),
            metadata,
        };
        let mut objects = vec![object(header, None, 0)];
        let mut groups = vec![top];
        let mut next = 0;
        while let Some(&group) = groups.get(next) {
            self.visit(group)?;
            let (properties, headers) = (self.properties(group)?, self.object_headers(group)?);
            let depth = objects[next].depth + 1;
            if depth > MAX_OBJECT_DEPTH && !headers.is_empty() {
                let expected = format!("at most {MAX_OBJECT_DEPTH} objects inside each other");
                return Err(Error::damaged(group.offset(), expected, "more"));
            }
            objects[next].properties = properties;
            objects[next].children = objects.len()..objects.len() + headers.len();
            for (i, header) in headers.into_iter().enumerate() {
                // Child 0 is the compound property of the object.
                groups.push(self.container.group(group, i as u64 + 1)?);
                objects.push(object(header, Some(ObjectId(next)), depth));
            }
            next += 1;
        }
        Ok(objects)
    }

    /// Properties of an object.
    fn properties(&mut self, object: Group) -> Result<Box<[Property]>> {
        if object.is_empty() {
            return Ok(Box::default());
        }
        let group = self.container.group(object, 0)?;
        self.compound(group, 0)
    }

    fn object_headers(&mut self, object: Group) -> Result<Vec<ObjectHeader>> {
        let mut bytes = Vec::new();
        let offset = self.last_data(object, &mut bytes)?;
        bytes.truncate(bytes.len().saturating_sub(HASHES_LENGTH));
        let mut fields = Fields::new(&bytes, offset);
        let mut headers = Vec::new();
        while !fields.is_empty() {
            headers.push(ObjectHeader::decode(&mut fields, self.table)?);
        }
        Ok(headers)
    }

    fn compound(&mut self, group: Group, depth: u16) -> Result<Box<[Property]>> {
        self.visit(group)?;
        let mut bytes = Vec::new();
        let offset = self.last_data(group, &mut bytes)?;
        if depth > MAX_COMPOUND_DEPTH && !bytes.is_empty() {
            let expected = format!("at most {MAX_COMPOUND_DEPTH} compounds inside each other");
            return Err(Error::damaged(group.offset(), expected, "more"));
        }
        let mut fields = Fields::new(&bytes, offset);
        let mut properties = Vec::new();
        while !fields.is_empty() {
            let offset = fields.offset();
            let header = PropertyHeader::decode(&mut fields, self.table)?;
            let child = self.container.group(group, properties.len() as u64)?;
            let content = match header.samples {
                None => Content::Compound(self.compound(child, depth + 1)?),
                Some(header) => {
                    let samples = Samples {
                        group: child,
                        layout: header.layout,
                        data_type: header.data_type,
                        count: header.count,
                        changes: header.changes,
                        sampling: header.sampling,
                    };
                    Content::Samples(self.checked(samples, offset)?)
                }
            };
            properties.push(Property {
                name: header.name,
                metadata: header.metadata,
                content,
            });
        }
        Ok(properties.into())
    }

    /// Refuses samples that the group does not have, and times that the archive does not have.
    fn checked(&self, samples: Samples, header: u64) -> Result<Samples> {
        let expected = samples.stored() * samples.children_per_sample();
        if samples.group.len() < expected {
            let found = samples.group.len().to_string();
            let expected = format!("a property of at least {expected} children");
            return Err(Error::damaged(samples.group.offset(), expected, found));
        }
        if samples.sampling as usize >= self.samplings {
            let expected = format!("an index of a time sampling below {}", self.samplings);
            return Err(Error::damaged(header, expected, samples.sampling.to_string()));
        }
        Ok(samples)
    }

    /// Reads the last child of a group if it is data, and returns their offset.
    fn last_data(&mut self, group: Group, into: &mut Vec<u8>) -> Result<u64> {
        into.clear();
        let Some(last) = group.len().checked_sub(1) else {
            return Ok(0);
        };
        if let Child::Group(_) = self.container.child(group, last)? {
            return Ok(0);
        }
        let data = self.container.data(group, last)?;
        let Some(budget) = self.budget.checked_sub(data.len()) else {
            let expected = "headers that are read once";
            return Err(Error::damaged(
                data.offset(),
                expected,
                "more bytes of headers than the file has",
            ));
        };
        self.budget = budget;
        self.container.read(data, 0, into)?;
        Ok(data.offset())
    }

    /// Refuses a group that has been read before: a cycle, or one with several parents.
    fn visit(&mut self, group: Group) -> Result<()> {
        if group.offset() != 0 && !self.visited.insert(group.offset()) {
            let expected = "a tree of groups";
            return Err(Error::damaged(
                group.offset(),
                expected,
                "a group with two parents",
            ));
        }
        Ok(())
    }
}

fn object(header: ObjectHeader, parent: Option<ObjectId>, depth: u16) -> Object {
    Object {
        name: header.name,
        metadata: header.metadata,
        properties: Box::default(),
        parent,
        children: 0..0,
        depth,
    }
}
