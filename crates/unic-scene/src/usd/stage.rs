//! The stage of a file and its prims of use.

use super::{resolver::Beside, value};
use crate::fault::Fault;
use openusd::{
    sdf::{self, Value},
    usd::{PrimPredicate, Stage},
};
use std::{collections::HashSet, fmt::Display, path::Path};

/// A stage with the paths of its prims, parents first.
pub(super) struct Prims {
    pub(super) stage: Stage,
    /// Bytes of the files of the stage.
    pub(super) length: usize,
    /// Meshes, skeletons and all prims above them.
    pub(super) needed: Vec<sdf::Path>,
    pub(super) meshes: Vec<sdf::Path>,
    pub(super) skeletons: Vec<sdf::Path>,
    pub(super) animations: Vec<sdf::Path>,
}

impl Prims {
    /// Opens a file with the files beside it that it refers to.
    pub(super) fn open(path: &Path) -> Result<Self, Fault> {
        let file =
            std::fs::metadata(path).map_err(|e| Fault::new("a file that can be opened", e.to_string()))?;
        let Some(text) = path.to_str() else {
            return Err(Fault::new("a path in Unicode for a USD file", "another"));
        };
        let stage = Stage::builder()
            .resolver(Beside::new(path))
            .open(text)
            .map_err(fault)?;
        let mut prims = Self {
            length: length(&stage, file.len()),
            stage,
            needed: Vec::new(),
            meshes: Vec::new(),
            skeletons: Vec::new(),
            animations: Vec::new(),
        };
        let mut all = Vec::new();
        let visited = prims
            .stage
            .traverse(PrimPredicate::DEFAULT, |path| all.push(path.clone()));
        visited.map_err(fault)?;
        let mut needed = HashSet::new();
        for path in &all {
            let kind = prims.stage.prim(path.clone()).type_name().map_err(fault)?;
            let list = match kind.as_ref().map(|kind| kind.as_str()) {
                Some("Mesh") => &mut prims.meshes,
                Some("Skeleton") => &mut prims.skeletons,
                Some("SkelAnimation") => &mut prims.animations,
                _ => continue,
            };
            list.push(path.clone());
            needed.extend(path.ancestors());
        }
        prims.needed = all.into_iter().filter(|path| needed.contains(path)).collect();
        Ok(prims)
    }

    /// Program that wrote the file.
    pub(super) fn generator(&self) -> Option<String> {
        // Blender states itself in the documentation, Houdini and others in their own dictionaries.
        match self.stage.stage_metadata("documentation") {
            Ok(Some(Value::String(text))) => text.lines().next().map(str::to_owned),
            _ => None,
        }
        .filter(|text| !text.is_empty())
    }

    /// Composed value of an attribute outside any animation.
    pub(super) fn value(&self, prim: &sdf::Path, name: &str) -> Result<Option<Value>, Fault> {
        let attribute = self.stage.prim(prim.clone()).attribute(name);
        attribute.get::<Value>().map_err(fault)
    }

    /// First target of a relationship of a prim or of the nearest one above it that has some.
    pub(super) fn inherited_target(&self, prim: &sdf::Path, name: &str) -> Result<Option<sdf::Path>, Fault> {
        for path in prim.ancestors() {
            if path.is_abs_root() {
                break;
            }
            let relationship = self.stage.prim(path).relationship(name);
            if let Some(target) = relationship
                .forwarded_targets()
                .map_err(fault)?
                .into_iter()
                .next()
            {
                return Ok(Some(target));
            }
        }
        Ok(None)
    }

    /// Tokens of an attribute; none if it is missing.
    pub(super) fn tokens(&self, prim: &sdf::Path, name: &str) -> Result<Vec<String>, Fault> {
        Ok(self
            .value(prim, name)?
            .and_then(value::tokens)
            .unwrap_or_default())
    }
}

/// Bytes of all files of a stage.
fn length(stage: &Stage, root: u64) -> usize {
    let sizes = stage
        .layer_identifiers()
        .into_iter()
        .filter_map(|layer| Some(std::fs::metadata(layer).ok()?.len()));
    // The root may be named by another path than its own.
    usize::try_from(sizes.sum::<u64>().max(root)).unwrap_or(usize::MAX)
}

/// Reason of the library why a file is not read.
pub(super) fn fault(reason: impl Display) -> Fault {
    // The alternative form has the causes in one line.
    Fault::new("a USD file", format!("a damaged one ({reason:#})"))
}
