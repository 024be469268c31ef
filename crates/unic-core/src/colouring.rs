//! Graph colouring of constraints: those of one colour share no particle and can be solved in
//! parallel.
//!
//! For solvers: the simulation's, and the projection of shown garments.

/// Splits constraints, each given by its particles, into colours, greedily and in order.
///
/// Returns the indices of the constraints of each colour, ascending. Every constraint has exactly
/// one colour, and no two constraints of a colour name the same particle.
pub fn colour_constraints<const N: usize>(constraints: &[[u32; N]], particle_count: usize) -> Vec<Vec<u32>> {
    // One pass over the uncoloured constraints per colour. The order of the constraints decides the
    // colours, and with them the order of the Gauss-Seidel sweep: it must not depend on threads.
    let mut waiting: Vec<u32> = (0..constraints.len() as u32).collect();
    // Last colour that has used each particle.
    let mut taken_by = vec![u32::MAX; particle_count];
    let mut colours = Vec::new();
    while !waiting.is_empty() {
        let colour = colours.len() as u32;
        let mut chosen = Vec::new();
        waiting.retain(|&constraint| {
            let particles = &constraints[constraint as usize];
            let is_free = particles.iter().all(|&p| taken_by[p as usize] != colour);
            if is_free {
                particles.iter().for_each(|&p| taken_by[p as usize] = colour);
                chosen.push(constraint);
            }
            !is_free
        });
        colours.push(chosen);
    }
    colours
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::{collection::vec, prelude::*};

    proptest! {
        #[test]
        fn every_constraint_has_one_colour_and_no_colour_shares_a_particle(
            constraints in vec([0u32..40, 40..80, 80..120], 0..200),
        ) {
            let colours = colour_constraints(&constraints, 120);
            let mut seen: Vec<u32> = colours.concat();
            seen.sort_unstable();
            prop_assert_eq!(seen, (0..constraints.len() as u32).collect::<Vec<_>>());
            for colour in colours {
                let mut particles: Vec<u32> =
                    colour.iter().flat_map(|&c| constraints[c as usize]).collect();
                let count = particles.len();
                particles.sort_unstable();
                particles.dedup();
                prop_assert_eq!(particles.len(), count);
            }
        }
    }
}
