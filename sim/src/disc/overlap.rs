//! The covered part of a pixel without blur, in closed form.
//!
//! A linear map takes an ellipse to the unit disc and the pixel's square to a parallelogram. The common area of a disc and a convex polygon
//! has a boundary of chords and arcs: it is the polygon through their ends, and a circular segment on each arc. All positions are relative
//! to the pixel, so a disc of a thousand pixels loses no digits.

use glam::{DMat2, DVec2};

/// The corners of the pixel's square about its centre, in order.
const SQUARE: [DVec2; 4] = [
    DVec2::new(-0.5, -0.5),
    DVec2::new(0.5, -0.5),
    DVec2::new(0.5, 0.5),
    DVec2::new(-0.5, 0.5),
];

/// The common area of the ellipse `centre + shape·(cos φ, sin φ)` and the pixel at the origin, in px².
///
/// ```
/// use glam::{DMat2, DVec2};
/// let circle = DMat2::from_diagonal(DVec2::splat(0.3));
/// let seen = sim::disc::overlap::ellipse(circle, DVec2::new(0.5, 0.0));
/// // Half of it.
/// assert!((seen - std::f64::consts::PI * 0.045).abs() < 1e-15);
/// ```
pub fn ellipse(shape: DMat2, centre: DVec2) -> f64 {
    let area = shape.determinant();
    let to_disc = shape.inverse();
    // A mirror image would reverse the order of the corners.
    let mirror = DVec2::new(1.0, area.signum());
    let corners = SQUARE.map(|corner| to_disc * (corner - centre) * mirror);
    area.abs() * disc(&corners)
}

/// The common area of the polygon `vertices` (in order, in either direction) and the pixel at the origin, in px².
///
/// By Green's theorem: the sum, over the parts of its edges between the pixel's rows, of the width of pixel left of them.
pub fn polygon(vertices: &[DVec2]) -> f64 {
    let next = vertices.iter().cycle().skip(1);
    vertices.iter().zip(next).map(|(&a, &b)| left_of(a, b)).sum::<f64>().abs()
}

/// ∫ dv over the edge from `a` to `b`, between the pixel's upper and lower side, of the width of pixel left of it.
fn left_of(a: DVec2, b: DVec2) -> f64 {
    let way = b - a;
    let crossing = |side: f64, from: f64, way: f64| ((side - from) / way).clamp(0.0, 1.0);
    let mut cuts = [
        0.0,
        crossing(-0.5, a.x, way.x),
        crossing(0.5, a.x, way.x),
        crossing(-0.5, a.y, way.y),
        crossing(0.5, a.y, way.y),
        1.0,
    ];
    // An edge along an axis crosses none of its parallel sides.
    cuts.iter_mut().filter(|cut| cut.is_nan()).for_each(|cut| *cut = 0.0);
    cuts.sort_by(f64::total_cmp);
    let piece = |from: f64, to: f64| {
        let middle = a + way * f64::midpoint(from, to);
        if middle.y.abs() < 0.5 {
            (middle.x.clamp(-0.5, 0.5) + 0.5) * way.y * (to - from)
        } else {
            0.0
        }
    };
    cuts.windows(2).map(|cut| piece(cut[0], cut[1])).sum()
}

/// The common area of the unit disc and a parallelogram, whose corners turn from x to y.
fn disc(corners: &[DVec2; 4]) -> f64 {
    if corners.iter().all(|corner| corner.length_squared() <= 1.0) {
        return triangle(corners[0], corners[1], corners[2]) * 2.0;
    }
    let edges = || (0..4).map(|k| (corners[k], corners[(k + 1) % 4]));
    if edges().all(|(a, b)| distance(a, b) > 1.0 - GRAZING) {
        return std::f64::consts::PI;
    }
    let mut chords = edges().filter_map(|(a, b)| inside_disc(a, b));
    let Some((first, mut last)) = chords.next() else {
        return 0.0;
    };
    let mut area = 0.0;
    for (from, to) in chords {
        area += triangle(first, last, from) + segment(last, from) + triangle(first, from, to);
        last = to;
    }
    area + segment(last, first)
}

/// A smaller cut of an edge into the disc's radius is ignored: some 1e-18 of its area.
const GRAZING: f64 = 1e-12;

/// The distance at which the line from `a` to `b` passes to the left of the origin.
fn distance(a: DVec2, b: DVec2) -> f64 {
    a.perp_dot((b - a).normalize_or_zero())
}

/// The part of the segment from `a` to `b` inside the unit disc.
fn inside_disc(a: DVec2, b: DVec2) -> Option<(DVec2, DVec2)> {
    let length = a.distance(b);
    let along = (b - a) / length;
    let distance = a.perp_dot(along);
    let half_chord = ((1.0 - distance) * (1.0 + distance)).max(0.0).sqrt();
    let middle = -a.dot(along);
    let (from, to) = (middle - half_chord, middle + half_chord);
    let point = |at: f64| a + along * at;
    (from.max(0.0) < to.min(length)).then(|| (if from > 0.0 { point(from) } else { a }, if to < length { point(to) } else { b }))
}

fn triangle(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a) / 2.0
}

/// The area between the arc of the unit circle from one point on to another and its chord: (θ − sin θ)/2.
fn segment(from: DVec2, to: DVec2) -> f64 {
    let turn = from.perp_dot(to).atan2(from.dot(to));
    // Points that coincide up to rounding: without `GRAZING` edges no arc is this close to a whole turn.
    let turn = match turn {
        _ if turn >= 0.0 => turn,
        _ if turn > -1e-6 => 0.0,
        _ => turn + std::f64::consts::TAU,
    };
    if turn > 0.1 {
        return (turn - turn.sin()) / 2.0;
    }
    let square = turn * turn;
    turn * square / 12.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// The area by many thin columns: exact within a column except for its sagitta.
    fn by_columns(shape: DMat2, centre: DVec2) -> f64 {
        const COLUMNS: usize = 20_000;
        let inverse = shape.inverse();
        let column = |k: usize| {
            let u = (k as f64 + 0.5) / COLUMNS as f64 - 0.5;
            // |inverse·(u − cx, v − cy)| = 1 is a quadratic equation in v.
            let (constant, slope) = (inverse * DVec2::new(u - centre.x, -centre.y), inverse.y_axis);
            let (a, b, c) = (slope.length_squared(), constant.dot(slope), constant.length_squared() - 1.0);
            let root = (b * b - a * c).max(0.0).sqrt();
            ((root - b) / a).clamp(-0.5, 0.5) - ((-root - b) / a).clamp(-0.5, 0.5)
        };
        (0..COLUMNS).map(column).sum::<f64>() / COLUMNS as f64
    }

    #[test]
    fn the_closed_form_agrees_with_thin_columns() {
        let shapes = [
            DMat2::from_diagonal(DVec2::splat(1.1)),
            DMat2::from_diagonal(DVec2::splat(0.51)),
            DMat2::from_diagonal(DVec2::splat(300.0)),
            DMat2::from_cols(DVec2::new(1.7, 0.3), DVec2::new(-0.2, 1.1)),
            DMat2::from_cols(DVec2::new(-0.7, 0.4), DVec2::new(0.1, 0.06)),
        ];
        for shape in shapes {
            for k in 0..200 {
                let on_rim = shape * DVec2::from_angle(f64::from(k));
                let near = DVec2::from_angle(f64::from(7 * k)) * 0.8;
                let (exact, columns) = (ellipse(shape, near - on_rim), by_columns(shape, near - on_rim));
                assert!((exact - columns).abs() < 1e-5, "{shape}, {k}: {exact} against {columns}");
            }
        }
    }

    #[test]
    fn touching_is_no_trap() {
        // The disc in the square touches all sides or one side, or extends beyond by one bit.
        for radius in [0.5, 0.5f64.next_up(), 0.5f64.next_down(), 0.5 + 1e-9, 0.5 + 1e-13] {
            let shape = DMat2::from_diagonal(DVec2::splat(radius));
            assert!((ellipse(shape, DVec2::ZERO) - PI * 0.25).abs() < 1e-8, "{radius}");
            assert!(ellipse(shape, DVec2::new(1.0, 0.0)) < 1e-8, "{radius}");
        }
        // The rim passes through corners.
        let shape = DMat2::from_diagonal(DVec2::splat(0.5f64.sqrt()));
        assert!((ellipse(shape, DVec2::ZERO) - 1.0).abs() < 1e-14);
        let shape = DMat2::from_diagonal(DVec2::splat(5.0));
        for centre in [
            DVec2::new(3.5, 4.5),
            DVec2::new(4.5, 3.5),
            DVec2::new(5.5, 0.5),
            DVec2::new(0.5, 4.5),
        ] {
            let columns = by_columns(shape, centre);
            assert!((ellipse(shape, centre) - columns).abs() < 1e-7, "{centre}");
        }
    }

    #[test]
    fn the_pixels_share_an_outline_out() {
        let shape = DMat2::from_cols(DVec2::new(30.0, 4.0), DVec2::new(-7.0, 21.0));
        let square = [
            DVec2::new(-20.3, 1.0),
            DVec2::new(2.0, -25.7),
            DVec2::new(30.0, 3.0),
            DVec2::new(0.0, 28.0),
        ];
        let pixels = || (-50..=50).flat_map(|x| (-50..=50).map(move |y| DVec2::new(f64::from(x), f64::from(y))));
        let sum: f64 = pixels().map(|pixel| ellipse(shape, -pixel)).sum();
        assert!((sum / (PI * shape.determinant()) - 1.0).abs() < 1e-13);
        let sum: f64 = pixels().map(|pixel| polygon(&square.map(|v| v - pixel))).sum();
        let area = triangle(square[0], square[1], square[2]) + triangle(square[0], square[2], square[3]);
        assert!((sum / area - 1.0).abs() < 1e-13, "{sum} against {area}");
    }

    #[test]
    fn an_upright_rectangle_covers_its_part() {
        let rectangle = [
            DVec2::new(-0.5, -9.0),
            DVec2::new(0.2, -9.0),
            DVec2::new(0.2, 0.1),
            DVec2::new(-0.5, 0.1),
        ];
        assert!((polygon(&rectangle) - 0.7 * 0.6).abs() < 1e-15);
    }
}
