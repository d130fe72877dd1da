//! scratch
use sim::optimum::*;
use sim::scene::Scene;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let criterion = a[2].parse().unwrap();
    let search = Search {
        criterion,
        frames: a[3].parse().unwrap(),
        tolerance: a[4].parse().unwrap(),
        ..Search::default()
    };
    let scene = Scene::load(&a[1], &a[5..]).unwrap();
    let t = std::time::Instant::now();
    let mut n = 0;
    let best = optimum(&scene, &search, |f| {
        n += f;
        true
    })
    .unwrap();
    let s = t.elapsed().as_secs_f64();
    for (r, e) in &best.curve {
        let d = e.distinguishability();
        println!(
            "{r:.3} {:7} B2W {:.3} F {:.3} BER {:.2e} err {}",
            e.errors.frames(),
            d.b2w,
            d.fisher,
            e.errors.rate(),
            e.errors.errors()
        );
    }
    println!(
        "l2a {:.4} {:?} border {} value {:.4e} not worse {:?} frames {} total {n} {s:.2} s {:.0}/s",
        best.l2a,
        best.l2a_95,
        best.at_border,
        best.value,
        best.not_worse,
        best.frames,
        n as f64 / s
    );
}
