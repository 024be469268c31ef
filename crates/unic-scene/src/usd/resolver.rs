//! Files that a USD file refers to.

use openusd::ar::{Asset, AssetInfo, DefaultResolver, ResolvedPath, Resolver};
use std::{
    io,
    path::{Path, PathBuf},
};

/// Finds files in the folder of the file and below it: one that comes from elsewhere must not make
/// the program read other files.
pub(super) struct Beside {
    files: DefaultResolver,
    folder: Option<PathBuf>,
}

impl Beside {
    /// Makes the resolver of a file.
    pub(super) fn new(file: &Path) -> Self {
        let folder = file.canonicalize().ok();
        Self {
            files: DefaultResolver::new(),
            folder: folder.and_then(|file| Some(file.parent()?.to_path_buf())),
        }
    }

    fn is_beside(&self, path: &Path) -> bool {
        self.folder
            .as_ref()
            .is_some_and(|folder| path.starts_with(folder))
    }
}

impl Resolver for Beside {
    fn create_identifier(&self, asset_path: &str, anchor: Option<&ResolvedPath>) -> String {
        self.files.create_identifier(asset_path, anchor)
    }

    fn resolve(&self, asset_path: &str) -> Option<ResolvedPath> {
        let resolved = self.files.resolve(asset_path)?;
        self.is_beside(&resolved).then_some(resolved)
    }

    fn resolve_for_new_asset(&self, _: &str) -> Option<ResolvedPath> {
        // Nothing is written.
        None
    }

    fn open_asset(&self, resolved: &ResolvedPath) -> io::Result<Box<dyn Asset>> {
        match self.is_beside(resolved) {
            true => self.files.open_asset(resolved),
            false => Err(io::Error::from(io::ErrorKind::PermissionDenied)),
        }
    }

    fn get_asset_info(&self, asset_path: &str, resolved: &ResolvedPath) -> AssetInfo {
        self.files.get_asset_info(asset_path, resolved)
    }
}
