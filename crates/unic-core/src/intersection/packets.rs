//! Partition of vertices into packets of neighbours, which search a tree together.

use crate::aabb_tree::{LANES, clustered};
use glam::Vec3;
use std::collections::BTreeMap;

/// Number of packets in a group: as many as a packet has lanes, so that their centres are a packet.
const GROUP_PACKETS: usize = LANES;

/// Entry of an empty slot.
const NO_VERTEX: u32 = u32::MAX;

/// Partition of vertices into packets of [`LANES`] neighbours, and of packets into groups of
/// neighbours.
///
/// All vertices of a group are of one contact class: the same parts of the body may push them. A
/// place in a packet is a slot; slots at the end of a class are empty. Asset: made once from the
/// rest shape.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Packets {
    vertex_of_slot: Vec<u32>,
    slot_of_vertex: Vec<u32>,
    class_of_group: Vec<u32>,
}

impl Packets {
    /// Number of slots in a group of packets.
    pub(crate) const GROUP: usize = GROUP_PACKETS * LANES;

    /// Partitions the chosen vertices by their positions at rest. Vertices with different keys are
    /// in different contact classes.
    pub(crate) fn partition<Key: Ord>(
        chosen: impl Iterator<Item = usize>,
        rest: &[Vec3],
        key: impl Fn(usize) -> Key,
    ) -> Self {
        // Ordered by key: the order of a hash map would differ from run to run.
        let mut classes: BTreeMap<Key, Vec<u32>> = BTreeMap::new();
        for vertex in chosen {
            classes.entry(key(vertex)).or_default().push(vertex as u32);
        }
        let (mut vertex_of_slot, mut class_of_group) = (Vec::new(), Vec::new());
        for (class, vertices) in classes.into_values().enumerate() {
            let ordered = clustered(vertices, rest, &[LANES, Self::GROUP]);
            vertex_of_slot.extend(ordered);
            // Padding to whole groups keeps every group, which one thread searches, in one class.
            let end = vertex_of_slot.len().next_multiple_of(Self::GROUP);
            vertex_of_slot.resize(end, NO_VERTEX);
            class_of_group.resize(end / Self::GROUP, class as u32);
        }
        let mut slot_of_vertex = vec![0; rest.len()];
        let slots = vertex_of_slot.iter().enumerate();
        for (slot, &vertex) in slots.filter(|(_, vertex)| **vertex != NO_VERTEX) {
            slot_of_vertex[vertex as usize] = slot as u32;
        }
        Self {
            vertex_of_slot,
            slot_of_vertex,
            class_of_group,
        }
    }

    /// Number of a vertex's contact class.
    pub(crate) fn class_of_vertex(&self, vertex: usize) -> usize {
        self.class_of_group[self.slot_of_vertex[vertex] as usize / Self::GROUP] as usize
    }

    /// Number of contact classes.
    pub(crate) fn class_count(&self) -> usize {
        self.class_of_group.last().map_or(0, |&class| class as usize + 1)
    }

    /// Number of slots, empty ones included.
    pub(crate) fn len(&self) -> usize {
        self.vertex_of_slot.len()
    }

    /// Slot of each vertex; zero for a vertex that was not chosen.
    pub(crate) fn slots(&self) -> &[u32] {
        &self.slot_of_vertex
    }

    /// Vertex in each slot; [`u32::MAX`] in an empty one.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.vertex_of_slot
    }

    /// Vertices of a packet, without its empty slots.
    pub(crate) fn packet(&self, packet: usize) -> &[u32] {
        let slots = &self.vertex_of_slot[packet * LANES..][..LANES];
        // Empty slots are at the end of a packet.
        &slots[..slots.partition_point(|&vertex| vertex != NO_VERTEX)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::point;
    use proptest::{collection::vec, prelude::*};

    proptest! {
        #[test]
        fn every_chosen_vertex_has_a_slot_in_its_class(rest in vec(point(1.0), 0..1500), classes in 1usize..7) {
            let is_chosen = |vertex: &usize| !vertex.is_multiple_of(3);
            let key = |vertex: usize| vertex % classes;
            let packets = Packets::partition((0..rest.len()).filter(is_chosen), &rest, key);
            for vertex in (0..rest.len()).filter(is_chosen) {
                prop_assert_eq!(packets.vertices()[packets.slots()[vertex] as usize] as usize, vertex);
            }
            let chosen = (0..rest.len()).filter(is_chosen).count();
            let packed: Vec<_> = (0..packets.len() / LANES).map(|packet| packets.packet(packet)).collect();
            prop_assert_eq!(packed.iter().map(|packet| packet.len()).sum::<usize>(), chosen);
            for group in packets.vertices().chunks(Packets::GROUP) {
                let held: Vec<_> = group.iter().filter(|vertex| **vertex != NO_VERTEX).collect();
                prop_assert!(held.iter().all(|&&v| key(v as usize) == key(*held[0] as usize)));
                prop_assert!(held.iter().all(|&&v| packets.class_of_vertex(v as usize) < packets.class_count()));
            }
        }
    }

    #[test]
    fn neighbours_share_packets() {
        let grid: Vec<Vec3> = (0..4096)
            .map(|i| Vec3::new((i % 64) as f32, 0.0, (i / 64) as f32))
            .collect();
        let packets = Packets::partition(0..grid.len(), &grid, |_| 0);
        for packet in 0..packets.len() / LANES {
            let places = packets.packet(packet).iter().map(|&v| grid[v as usize]);
            let bounds = crate::bounds::Aabb::around(&places.collect::<Vec<_>>());
            assert!((bounds.max - bounds.min).max_element() <= 7.0);
        }
    }
}
