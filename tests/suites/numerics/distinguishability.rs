//! B2W and Fisher's criterion without a class or without scatter, and with collinear features.

use studies::monte_carlo::Evaluation;
use studies::statistics::{COLLINEAR, Distinguishability, Moments};

/// The paper's definition.
fn naive_b2w(on: &Moments, off: &Moments) -> f64 {
    let (a, b) = (on.mean(), off.mean());
    let (s, t) = (on.covariance(), off.covariance());
    ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)) / (s[0][0] + s[1][1] + t[0][0] + t[1][1])
}

/// Fisher's criterion by the inverse covariance, with its determinant in the denominator.
fn naive_fisher(on: &Moments, off: &Moments) -> f64 {
    let (a, b) = (on.mean(), off.mean());
    let (s, t) = (on.covariance(), off.covariance());
    let (xx, xy, yy) = (s[0][0] + t[0][0], s[0][1] + t[0][1], s[1][1] + t[1][1]);
    let [x, y] = [a[0] - b[0], a[1] - b[1]];
    (x * x * yy - 2.0 * x * y * xy + y * y * xx) / (xx * yy - xy * xy)
}

#[test]
fn a_class_without_cells_or_without_scatter_makes_no_infinity() {
    let same = |x: f64, count: usize| Moments::of(&vec![[x, 10.0 * x]; count]);
    let scattered = Moments::of(&[[1.0, 10.0], [1.5, 11.0], [1.2, 10.3]]);
    let nothing = Moments::default();
    // On, Off, and whether B2W is defined.
    let cases = [
        ("no noise at all", same(1.5, 500), same(0.5, 700), None),
        ("On looks like Off, without noise", same(1.0, 500), same(1.0, 700), None),
        ("On looks like Off", scattered, scattered, Some(0.0)),
        ("all On", scattered, nothing, None),
        ("all Off", nothing, scattered, None),
        ("no frames", nothing, nothing, None),
        ("one LED of each", same(2.0, 1), same(1.0, 1), None),
        (
            "a scatter of the smallest of numbers",
            Moments::of(&[[f64::MIN_POSITIVE, 0.0], [0.0, 0.0]]),
            same(-1.0, 2),
            None,
        ),
    ];
    let mut naive_fails = 0;
    for (name, on, off, b2w) in cases {
        naive_fails += usize::from(!naive_b2w(&on, &off).is_finite());
        let ours = Distinguishability::of(&on, &off);
        assert_eq!(ours.b2w, b2w, "{name}: {ours:?}");
        assert!(ours.bvar.is_finite() && ours.wvar.is_finite(), "{name}: {ours:?}");
        assert!(ours.fisher.is_none_or(f64::is_finite), "{name}: {ours:?}");
    }
    assert!(naive_fails >= 5, "{naive_fails}");
    // A class without samples is not a class at (0, 0).
    assert!(naive_b2w(&scattered, &nothing) > 100.0);
    assert_eq!(Evaluation::default().distinguishability(), Distinguishability::default());
}

#[test]
fn one_led_of_a_class_is_enough_where_the_other_scatters() {
    let one = Moments::of(&[[2.0, 40.0]]);
    let others: Vec<[f64; 2]> = (0..63).map(|k| [f64::from(k % 7) / 64.0, f64::from(k % 5)]).collect();
    let ours = Distinguishability::of(&one, &Moments::of(&others));
    let (b2w, fisher) = (ours.b2w.expect("a ratio"), ours.fisher.expect("a criterion"));
    assert!(b2w > 600.0 && fisher > b2w, "{ours:?}");
}

/// A constant feature adds nothing, unless it separates the classes.
#[test]
fn a_feature_that_never_varies_leaves_the_other_one_s_criterion() {
    let with = |gri_on: f64| {
        let on = Moments::of(&[[1.0, gri_on], [3.0, gri_on]]);
        let off = Moments::of(&[[-1.0, 5.0], [-3.0, 5.0]]);
        (naive_fisher(&on, &off), Distinguishability::of(&on, &off).fisher)
    };
    assert!(with(5.0).0.is_nan() && with(6.0).0.is_infinite());
    assert_eq!((with(5.0).1, with(6.0).1), (Some(8.0), None));
}

/// Features (x, x + y/2^k) in units of very different scale: 1 − ρ² is about 4^−k.
fn nearly_collinear(k: i32) -> ([Moments; 2], f64) {
    let (wide, narrow) = (2f64.powi(13), 2f64.powi(-13));
    let part = 2f64.powi(-k);
    let values = |class: i64| {
        (0..200i64).map(move |n| {
            let (x, y) = ((n * 37 + class * 11) % 101, (n * 53 + class * 29) % 97);
            [x + 20 * class, y + 15 * class]
        })
    };
    let moments = |class| {
        let scaled = |[x, y]: [i64; 2]| [wide * x as f64, narrow * (x as f64 + part * y as f64)];
        let mut moments = Moments::default();
        values(class).for_each(|pair| moments.push(scaled(pair)));
        moments
    };
    // The criterion is invariant under linear maps of the features: computed for (x, y) in integers.
    let sums = |class| {
        values(class).fold([0i128; 5], |s, [x, y]| {
            let (x, y) = (i128::from(x), i128::from(y));
            [s[0] + x, s[1] + y, s[2] + x * x, s[3] + x * y, s[4] + y * y]
        })
    };
    let (on, off) = (sums(1), sums(0));
    let scatter = |i: usize, a: usize, b: usize| (200 * (on[i] + off[i]) - on[a] * on[b] - off[a] * off[b]) as f64;
    let (xx, xy, yy) = (scatter(2, 0, 0), scatter(3, 0, 1), scatter(4, 1, 1));
    let (x, y) = ((on[0] - off[0]) as f64, (on[1] - off[1]) as f64);
    let exact = (x * x * yy - 2.0 * x * y * xy + y * y * xx) / (xx * yy - xy * xy);
    ([moments(1), moments(0)], exact)
}

#[test]
fn fisher_s_criterion_is_right_or_undefined_however_alike_the_features_are() {
    let mut naive_worst = 0.0f64;
    let mut defined = 0;
    for k in 0..=40 {
        let ([on, off], exact) = nearly_collinear(k);
        let ours = Distinguishability::of(&on, &off).fisher;
        naive_worst = naive_worst.max((naive_fisher(&on, &off) / exact - 1.0).abs());
        if let Some(fisher) = ours {
            defined += 1;
            assert!((fisher / exact - 1.0).abs() < 1e-6, "2^−{k}: {fisher} for {exact}");
        }
        // Defined while 1 − ρ² exceeds its bound.
        let rest = 4f64.powi(-k);
        assert!(ours.is_some() || rest < 4.0 * COLLINEAR, "2^−{k}");
    }
    assert!(naive_worst > 0.5, "{naive_worst}");
    assert!((14..=17).contains(&defined), "{defined}");
}
