//! Garment vertices in packets of neighbours, which look at the body together.

use crate::bvh::{LANES, clustered};
use glam::Vec3;
use std::collections::BTreeMap;

/// Packets in a group: their centres are a packet.
const GROUP_PACKETS: usize = LANES;

/// Stands for no vertex.
const NO_VERTEX: u32 = u32::MAX;

/// The vertices of a garment in packets of [`LANES`] neighbours that the same parts of the body may
/// push; packets in groups of neighbours.
///
/// A place in a packet is a slot; some are empty. Asset: made once from the rest shape.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Packets {
    vertex_of_slot: Vec<u32>,
    slot_of_vertex: Vec<u32>,
    kind_of_group: Vec<u32>,
}

impl Packets {
    /// Slots in a group of packets.
    pub(crate) const GROUP: usize = GROUP_PACKETS * LANES;

    /// Of the chosen vertices; `kind` tells apart what may not share a packet.
    pub(crate) fn of<Kind: Ord>(
        chosen: impl Iterator<Item = usize>,
        rest: &[Vec3],
        kind: impl Fn(usize) -> Kind,
    ) -> Self {
        let mut kinds: BTreeMap<Kind, Vec<u32>> = BTreeMap::new();
        for vertex in chosen {
            kinds.entry(kind(vertex)).or_default().push(vertex as u32);
        }
        let (mut vertex_of_slot, mut kind_of_group) = (Vec::new(), Vec::new());
        for (kind, vertices) in kinds.into_values().enumerate() {
            let ordered = clustered(vertices, rest, &[LANES, Self::GROUP]);
            vertex_of_slot.extend(ordered);
            let end = vertex_of_slot.len().next_multiple_of(Self::GROUP);
            vertex_of_slot.resize(end, NO_VERTEX);
            kind_of_group.resize(end / Self::GROUP, kind as u32);
        }
        let mut slot_of_vertex = vec![0; rest.len()];
        let slots = vertex_of_slot.iter().enumerate();
        for (slot, &vertex) in slots.filter(|(_, vertex)| **vertex != NO_VERTEX) {
            slot_of_vertex[vertex as usize] = slot as u32;
        }
        Self {
            vertex_of_slot,
            slot_of_vertex,
            kind_of_group,
        }
    }

    /// The number of a vertex's kind.
    pub(crate) fn kind_of_vertex(&self, vertex: usize) -> usize {
        self.kind_of_group[self.slot_of_vertex[vertex] as usize / Self::GROUP] as usize
    }

    /// Kinds that there are.
    pub(crate) fn kinds(&self) -> usize {
        self.kind_of_group.last().map_or(0, |&kind| kind as usize + 1)
    }

    /// Slots: those of all groups.
    pub(crate) fn len(&self) -> usize {
        self.vertex_of_slot.len()
    }

    /// The slot of each vertex; zero for one that was not chosen.
    pub(crate) fn slots(&self) -> &[u32] {
        &self.slot_of_vertex
    }

    /// The vertex in each slot; what is no vertex in an empty one.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.vertex_of_slot
    }

    /// The vertices of a packet.
    pub(crate) fn packet(&self, packet: usize) -> &[u32] {
        let slots = &self.vertex_of_slot[packet * LANES..][..LANES];
        &slots[..slots.partition_point(|&vertex| vertex != NO_VERTEX)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::point;
    use proptest::{collection::vec, prelude::*};

    proptest! {
        #[test]
        fn every_chosen_vertex_has_a_slot_among_its_kind(rest in vec(point(1.0), 0..1500), kinds in 1usize..7) {
            let is_chosen = |vertex: &usize| !vertex.is_multiple_of(3);
            let kind = |vertex: usize| vertex % kinds;
            let packets = Packets::of((0..rest.len()).filter(is_chosen), &rest, kind);
            for vertex in (0..rest.len()).filter(is_chosen) {
                prop_assert_eq!(packets.vertices()[packets.slots()[vertex] as usize] as usize, vertex);
            }
            let chosen = (0..rest.len()).filter(is_chosen).count();
            let packed: Vec<_> = (0..packets.len() / LANES).map(|packet| packets.packet(packet)).collect();
            prop_assert_eq!(packed.iter().map(|packet| packet.len()).sum::<usize>(), chosen);
            for group in packets.vertices().chunks(Packets::GROUP) {
                let held: Vec<_> = group.iter().filter(|vertex| **vertex != NO_VERTEX).collect();
                prop_assert!(held.iter().all(|&&v| kind(v as usize) == kind(*held[0] as usize)));
                prop_assert!(held.iter().all(|&&v| packets.kind_of_vertex(v as usize) < packets.kinds()));
            }
        }
    }

    #[test]
    fn neighbours_share_packets() {
        let grid: Vec<Vec3> = (0..4096)
            .map(|i| Vec3::new((i % 64) as f32, 0.0, (i / 64) as f32))
            .collect();
        let packets = Packets::of(0..grid.len(), &grid, |_| 0);
        for packet in 0..packets.len() / LANES {
            let places = packets.packet(packet).iter().map(|&v| grid[v as usize]);
            let bounds = crate::bvh::Aabb::around(&places.collect::<Vec<_>>());
            assert!((bounds.max - bounds.min).max_element() <= 7.0);
        }
    }
}
