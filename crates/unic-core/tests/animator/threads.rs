//! Threads: the same bytes on any number of them, and no allocation in a step.

use super::*;

#[test]
fn the_same_inputs_give_the_same_bytes_on_any_number_of_threads() {
    let poses = motion(8);
    for variant in variants() {
        let model = model(&variant);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            let run_in = |mode| {
                let mut animator = Animator::new(Arc::clone(&model));
                animator.set_intersection(mode);
                run(&mut animator, &poses);
                (bits(animator.garment()), animator.state().clone())
            };
            pool.install(|| MODES.map(run_in))
        };
        let one = on(1);
        for threads in [2, 5] {
            assert!(on(threads) == one, "{}, {threads} threads", variant.name);
        }
        let own: [Arc<dyn Threads>; 3] = [
            Arc::new(Serial),
            Arc::new(Workers::new(3)),
            Arc::new(Workers::new(4)),
        ];
        for threads in own {
            let run_in = |mode| {
                let mut animator = Animator::new(Arc::clone(&model));
                animator.set_threads(Arc::clone(&threads));
                animator.set_intersection(mode);
                run(&mut animator, &poses);
                (bits(animator.garment()), animator.state().clone())
            };
            assert!(MODES.map(run_in) == one, "{}, {threads:?}", variant.name);
        }
    }
}

/// Threads of an engine, started for every run. They count the allocations of the jobs, without
/// those of starting threads.
#[derive(Debug)]
struct Workers {
    count: usize,
    runs: AtomicUsize,
    allocations: AtomicU64,
}

impl Workers {
    fn new(count: usize) -> Self {
        Self {
            count,
            runs: AtomicUsize::new(0),
            allocations: AtomicU64::new(0),
        }
    }

    fn run_counted(&self, job: &(dyn Fn() + Sync)) {
        let counted = allocation_counter::measure(job);
        self.allocations.fetch_add(counted.count_total, Ordering::Relaxed);
    }
}

impl Threads for Workers {
    fn thread_count(&self) -> usize {
        self.count
    }

    fn run(&self, jobs: usize, job: &(dyn Fn() + Sync)) {
        self.runs.fetch_add(1, Ordering::Relaxed);
        allocation_counter::opt_out(|| {
            std::thread::scope(|scope| {
                for _ in 0..jobs {
                    scope.spawn(|| self.run_counted(job));
                }
            });
        });
    }
}

/// Neither the calling thread nor the engine's threads allocate.
#[test]
fn a_step_allocates_nothing_after_the_first_ones() {
    let poses = motion(12);
    let cases = variants()
        .into_iter()
        .flat_map(|v| MODES.map(|mode| (v.clone(), mode)));
    for ((variant, mode), precision) in cases.zip(Precision::ALL.into_iter().cycle()) {
        let model = Model::clone(&model(&variant)).with_precision(precision);
        let share = if precision == Precision::Bf16 { 0.5 } else { 1.0 };
        let model = Arc::new(model.with_sampling(share).unwrap());
        for threads in [1, 3] {
            let workers = Arc::new(Workers::new(threads));
            let mut animator = Animator::new(Arc::clone(&model));
            animator.set_threads(Arc::clone(&workers) as Arc<dyn Threads>);
            animator.set_intersection(mode);
            run(&mut animator, &poses[..4]);
            workers.allocations.store(0, Ordering::Relaxed);
            let counted = allocation_counter::measure(|| {
                for t in 4..poses.len() {
                    animator.step(&input(&poses, t)).unwrap();
                }
            });
            let of_workers = workers.allocations.load(Ordering::Relaxed);
            let counts = (counted.count_total, of_workers);
            assert_eq!(counts, (0, 0), "{}, {mode:?}, {threads} threads", variant.name);
            let has_run = workers.runs.load(Ordering::Relaxed) > 0;
            assert_eq!(has_run, threads > 1, "{}, {mode:?}", variant.name);
        }
    }
}

/// Sampled vertices move as in the full model, and all others are interpolated.
#[test]
fn a_sampled_garment_agrees_with_the_full_one_at_the_samples() {
    let poses = motion(8);
    for variant in variants_without_projection().filter(has_field) {
        let full = model(&variant);
        let sampled = Arc::new(Model::clone(&full).with_sampling(0.4).unwrap());
        let samples = sampled.sampling().unwrap().samples().to_vec();
        assert!(samples.len() < full.vertex_count() / 2);
        let [mut all, mut few] = [&full, &sampled].map(|m| Animator::new(Arc::clone(m)));
        for animator in [&mut all, &mut few] {
            animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        }
        let mut distance = 0f32;
        for t in 1..poses.len() {
            let truth = all.step(&input(&poses, t)).unwrap().positions.to_vec();
            let found = few.step(&input(&poses, t)).unwrap().positions;
            for &v in &samples {
                let error = (found[v as usize] - truth[v as usize]).length();
                assert!(error < 1e-4, "{}, frame {t}, sample {v}: {error} m", variant.name);
            }
            distance = distance.max(largest_distance(found, &truth));
        }
        assert!(distance > 1e-3, "{}: every vertex was evaluated", variant.name);
        let whole = Arc::new(Model::clone(&sampled).with_sampling(1.0).unwrap());
        assert_eq!(run(&mut Animator::new(whole), &poses), run(&mut all, &poses));
    }
}

#[test]
fn every_precision_and_sampling_gives_the_same_bytes_on_any_number_of_threads() {
    let poses = motion(6);
    for (variant, precision) in variants().into_iter().zip(Precision::ALL.into_iter().cycle()) {
        let model = Model::clone(&model(&variant)).with_precision(precision);
        let model = Arc::new(model.with_sampling(0.5).unwrap());
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap()
                .install(|| run(&mut Animator::new(Arc::clone(&model)), &poses))
        };
        let one = on(1);
        assert!(on(2) == one && on(5) == one, "{}, {precision:?}", variant.name);
        let mut animator = Animator::new(Arc::clone(&model));
        animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        animator.step(&input(&poses, 1)).unwrap();
        let mut other = Animator::new(Arc::clone(&model));
        other.restore(animator.state().clone()).unwrap();
        assert!(other.step(&input(&poses, 2)).unwrap().positions == one[2]);
    }
}
