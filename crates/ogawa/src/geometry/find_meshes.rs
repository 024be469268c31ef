//! Finding the meshes of an archive.

use super::{
    GEOMETRY, POLY_MESH, SUBDIVISION, TRANSFORM,
    attribute::Scope,
    mesh::{Mesh, MeshKind, Values},
};
use crate::{
    archive::{Archive, Object, ObjectId, Property, Samples, find},
    error::{Error, Result, excerpt},
};
use std::io::{Read, Seek};

/// Samples of an object's own transform, if they change.
fn transform_samples(object: &Object) -> Option<Samples> {
    let properties = object.property(TRANSFORM).map_or(&[][..], Property::properties);
    let changing = |name| -> Option<Samples> {
        let samples = find(properties, name)?.samples().copied();
        samples.filter(|samples| !samples.is_constant())
    };
    longest([".vals", ".inherits"].map(changing))
}

/// Samples with the largest count; the first ones of several.
fn longest<const N: usize>(samples: [Option<Samples>; N]) -> Option<Samples> {
    samples
        .into_iter()
        .flatten()
        .reduce(|longest, other| match other.count() > longest.count() {
            true => other,
            false => longest,
        })
}

impl<R: Read + Seek> Archive<R> {
    /// All meshes, in the order of [`Archive::objects`].
    ///
    /// # Errors
    /// An object with the schema of a mesh that lacks positions or faces.
    pub fn meshes(&self) -> Result<Vec<Mesh>> {
        let kind = |schema: &str| match schema {
            POLY_MESH => Some(MeshKind::Polygons),
            SUBDIVISION => Some(MeshKind::Subdivision),
            _ => None,
        };
        let mut meshes = Vec::new();
        // Parents come before their children, so that each object is looked at once.
        let mut timelines: Vec<Option<Samples>> = Vec::new();
        for (id, object) in self.objects() {
            let inherited = object.parent().and_then(|parent| timelines[parent.0]);
            let timeline = longest([inherited, transform_samples(object)]);
            timelines.push(timeline);
            if let Some(kind) = kind(object.schema()) {
                meshes.push(self.mesh(id, kind, timeline)?);
            }
        }
        Ok(meshes)
    }

    fn mesh(&self, id: ObjectId, kind: MeshKind, transforms: Option<Samples>) -> Result<Mesh> {
        let object = self.object(id);
        let properties = object.property(GEOMETRY).map_or(&[][..], Property::properties);
        let optional = |name| find(properties, name).and_then(Property::samples).copied();
        let required = |name: &'static str| {
            optional(name).ok_or_else(|| {
                let expected = format!("samples `{GEOMETRY}/{name}`");
                Error::content(&self.full_name(id), expected, "none")
            })
        };
        let values = |name| -> Result<Option<Values>> {
            let Some(property) = find(properties, name) else {
                return Ok(None);
            };
            self.values(id, property)
        };
        let positions = required("P")?;
        Ok(Mesh {
            object: id,
            name: object.name.clone(),
            kind,
            timeline: match positions.is_constant() {
                true => longest([Some(positions), transforms]).unwrap_or(positions),
                false => positions,
            },
            positions,
            counts: required(".faceCounts")?,
            corners: required(".faceIndices")?,
            uvs: values("uv")?,
            normals: values("N")?,
            velocities: optional(".velocities"),
        })
    }

    /// Samples of an attribute: a property of values, or a compound of values and indices.
    fn values(&self, id: ObjectId, property: &Property) -> Result<Option<Values>> {
        let Some(scope) = Scope::decode(&property.metadata) else {
            let found = excerpt(property.metadata.get("geoScope").unwrap_or_default());
            let expected = "the scope con, uni, var, vtx or fvr";
            return Err(Error::content(&self.full_name(id), expected, found));
        };
        let within = |name| {
            find(property.properties(), name)
                .and_then(Property::samples)
                .copied()
        };
        let values = property.samples().copied().or_else(|| within(".vals"));
        Ok(values.map(|values| Values {
            scope,
            values,
            indices: within(".indices"),
        }))
    }
}
