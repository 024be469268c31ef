//! Intersection handling: of the shown positions and, if the mode corrects it, of the state.

use super::*;

fn posed_body(animator: &Animator) -> BodySnapshot {
    let (mut vertices, mut body) = (Vec::new(), BodySnapshot::default());
    animator.body(&mut vertices);
    body.prepare(&vertices, &animator.model().character().body.faces);
    body
}

#[test]
fn paper_mode_leaves_no_vertex_inside_and_corrects_the_state() {
    let rule = PaperIntersection { relaxation_m: 0.005 };
    let poses = motion(15);
    for name in ["position in the heading frame", "second order", "pose only"] {
        // Given positions end the residual of a replay, which corrected ones do not.
        let model = Arc::new(tight(name).without_replay());
        let (mut paper, mut off) = (Animator::new(Arc::clone(&model)), Animator::new(model));
        paper.set_intersection(IntersectionMode::Paper {
            relaxation_m: rule.relaxation_m,
        });
        for animator in [&mut paper, &mut off] {
            animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        }
        for t in 1..poses.len() {
            let found = paper.step(&input(&poses, t)).unwrap().positions.to_vec();
            let left = off.step(&input(&poses, t)).unwrap().positions.to_vec();
            let body = posed_body(&off);
            assert!(
                left.iter().any(|&p| body.is_inside(p)),
                "{name}, frame {t}: nothing to correct"
            );
            assert!(!found.iter().any(|&p| body.is_inside(p)), "{name}, frame {t}");
            let corrected: Vec<Vec3> = left
                .iter()
                .map(|&p| rule.correct(&body, p).unwrap_or(p))
                .collect();
            assert!(largest_distance(&found, &corrected) < 1e-4, "{name}, frame {t}");
            // The next step starts from the corrected garment.
            off.set_garment(&corrected).unwrap();
        }
    }
}

#[test]
fn robust_mode_shows_no_vertex_inside() {
    let poses = motion(15);
    for (name, corrects) in ["second order", "pose only"]
        .into_iter()
        .flat_map(|name| [Corrects::Display, Corrects::State].map(|corrects| (name, corrects)))
    {
        let model = tight(name);
        let [mut animator, mut off, mut bare] = [(); 3].map(|()| Animator::new(Arc::clone(&model)));
        animator.set_intersection(robust(corrects));
        for animator in [&mut animator, &mut off] {
            animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        }
        for t in 1..poses.len() {
            let shown = animator.step(&input(&poses, t)).unwrap().positions.to_vec();
            let left = off.step(&input(&poses, t)).unwrap().positions.to_vec();
            let mut surface = Surface::build(&model.character().body);
            let mut vertices = Vec::new();
            off.body(&mut vertices);
            surface.refit(&vertices);
            let is_inside = |&&p: &&Vec3| surface.closest(p).unwrap().signed_distance < -1e-4;
            assert!(
                left.iter().find(is_inside).is_some(),
                "{name}, frame {t}: nothing to correct"
            );
            assert_eq!(
                shown.iter().find(is_inside),
                None,
                "{name}, {corrects:?}, frame {t}"
            );
            // The positions of the state, without corrections for display.
            let kept = bare.restore(animator.state().clone()).unwrap().positions.to_vec();
            match corrects {
                Corrects::Display => assert_eq!(kept, left, "{name}, frame {t}"),
                Corrects::State => assert_eq!(kept.iter().find(is_inside), None, "{name}, frame {t}"),
            }
        }
    }
}
