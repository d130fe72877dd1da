//! Panels that are almost a line, tiny, huge, or far from the frame's origin; pixels on cell borders.

use rx_pipeline::cells::{CellMap, CellsError};
use rx_pipeline::corners::{Corners, CornersError};

const UNIT: [[f64; 2]; 4] = [[0.0, 0.0], [7.0, 0.0], [7.0, 7.0], [0.0, 7.0]];

/// Heckbert's formulas in f32 with the cofactor inverse: the obvious choice on a small processor.
struct Naive {
    forward: [[f32; 3]; 3],
    inverse: [[f32; 3]; 3],
}

impl Naive {
    fn new([[x0, y0], [x1, y1], [x2, y2], [x3, y3]]: [[f32; 2]; 4]) -> Self {
        let (dx1, dx2, sx) = (x1 - x2, x3 - x2, x0 - x1 + x2 - x3);
        let (dy1, dy2, sy) = (y1 - y2, y3 - y2, y0 - y1 + y2 - y3);
        let determinant = dx1 * dy2 - dx2 * dy1;
        let (p, q) = ((sx * dy2 - dx2 * sy) / determinant, (dx1 * sy - sx * dy1) / determinant);
        let [[a, b, c], [d, e, f], [g, h, i]] = [
            [(x1 - x0 + p * x1) / 7.0, (x3 - x0 + q * x3) / 7.0, x0],
            [(y1 - y0 + p * y1) / 7.0, (y3 - y0 + q * y3) / 7.0, y0],
            [p / 7.0, q / 7.0, 1.0],
        ];
        Self {
            forward: [[a, b, c], [d, e, f], [g, h, i]],
            inverse: [
                [e * i - f * h, c * h - b * i, b * f - c * e],
                [f * g - d * i, a * i - c * g, c * d - a * f],
                [d * h - e * g, b * g - a * h, a * e - b * d],
            ],
        }
    }

    fn project(matrix: &[[f32; 3]; 3], [x, y]: [f32; 2]) -> [f32; 2] {
        let [u, v, w] = matrix.map(|[a, b, c]| a * x + b * y + c);
        [u / w, v / w]
    }

    /// Error from panel to image and back.
    fn round_trip(&self, [u, v]: [f64; 2]) -> f64 {
        let there = Self::project(&self.forward, [u as f32, v as f32]);
        let [p, q] = Self::project(&self.inverse, there);
        (f64::from(p) - u).hypot(f64::from(q) - v)
    }
}

/// Maximum round-trip error of a panel point, in pitches; and maximum distance of a mapped corner from its input, in px.
fn errors(corners: &Corners) -> [f64; 2] {
    let homography = corners.homography();
    let (mut back, mut there) = (0.0f64, 0.0f64);
    for row in 0..=14 {
        for column in 0..=14 {
            let [u, v] = [f64::from(column) / 2.0, f64::from(row) / 2.0];
            let [p, q] = homography.to_panel(homography.to_image([u, v]));
            back = back.max((p - u).hypot(q - v));
        }
    }
    for (led, [x, y]) in UNIT.into_iter().zip(corners.points()) {
        let [p, q] = homography.to_image(led);
        there = there.max((p - f64::from(x)).hypot(q - f64::from(y)));
    }
    [back, there]
}

#[test]
fn corners_nearly_on_a_line_are_exact_or_refused() {
    let mut naive_worst = 0.0f64;
    let (mut accepted, mut refused) = (0, 0);
    for k in 0..=26 {
        let bend = 300.0 * 0.5f32.powi(k);
        // A sliver; a square with one corner moved almost onto the diagonal; a square flattened along its diagonal.
        for points in [
            [[100.0, 100.0], [900.0, 100.0], [900.0, 100.0 + bend], [100.0, 100.0 + bend]],
            [[100.0, 100.0], [900.0, 100.0], [500.0 + bend, 500.0 + bend], [100.0, 900.0]],
            [
                [100.0, 100.0],
                [500.0 + bend, 500.0 - bend],
                [900.0, 900.0],
                [500.0 - bend, 500.0 + bend],
            ],
        ] {
            let Ok(corners) = Corners::new(points) else {
                refused += 1;
                continue;
            };
            accepted += 1;
            let [back, there] = errors(&corners);
            assert!(there < 1e-9, "{points:?}: {there:e} px");
            assert!(back < 1e-6, "{points:?}: {back:e} pitches");
            let naive = Naive::new(points);
            for led in UNIT {
                let error = naive.round_trip(led);
                naive_worst = naive_worst.max(if error.is_finite() { error } else { 7.0 });
            }
        }
    }
    assert!(naive_worst > 0.1, "{naive_worst}");
    assert!(accepted >= 20 && refused >= 20, "{accepted} and {refused}");
}

/// A panel rotated about the vertical axis: its corners as seen from 20 panel widths away.
fn turned(degrees: f64, width_px: f64) -> [[f32; 2]; 4] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    UNIT.map(|[u, v]| {
        let (x, y) = (u / 7.0 - 0.5, v / 7.0 - 0.5);
        let depth = 1.0 + x * sin / 20.0;
        [600.0 + width_px * x * cos / depth, 600.0 + width_px * y / depth].map(|c| c as f32)
    })
}

#[test]
fn a_panel_seen_edge_on_is_refused_and_until_then_exact() {
    let (mut last_accepted, mut last_read) = (0.0, 0.0);
    for step in 0..=900 {
        let degrees = f64::from(step) / 10.0;
        match Corners::new(turned(degrees, 110.0)) {
            Ok(corners) => {
                let [back, there] = errors(&corners);
                assert!(back < 1e-9 && there < 1e-9, "{degrees}°: {back:e}, {there:e}");
                last_accepted = degrees;
                match CellMap::<20_000>::new(&corners, 1200, 1200) {
                    Ok(_) => last_read = degrees,
                    Err(error) => assert!(matches!(error, CellsError::EmptyCell { .. }), "{degrees}°: {error}"),
                }
            }
            Err(error) => assert!(
                matches!(error, CornersError::PitchTooSmall { pitch_px } if pitch_px < 1.5)
                    || matches!(error, CornersError::NotConvex { .. }),
                "{degrees}°: {error}"
            ),
        }
    }
    // 110 px·cos 84.5° is seven pitches of 1.5 px.
    assert!(
        last_read > 80.0 && last_read <= last_accepted && last_accepted < 85.0,
        "{last_read}° and {last_accepted}°"
    );
}

#[test]
fn a_panel_of_5_px_is_refused_and_one_of_1000_px_is_exact() {
    let square = |side: f32, from: f32| {
        let (near, far) = (from, from + side);
        Corners::new([[near, near], [far, near], [far, far], [near, far]])
    };
    assert_eq!(square(5.0, 100.0), Err(CornersError::PitchTooSmall { pitch_px: 5.0 / 7.0 }));
    for from in [0.25, 100.0, 30_000.0, 900_000.0] {
        let corners = square(1000.0, from).expect("a panel");
        let [back, there] = errors(&corners);
        assert!(back < 1e-9 && there < 1e-9, "at {from}: {back:e}, {there:e}");
    }
    let corners = square(1000.0, 100.0).expect("a panel");
    assert!(matches!(
        CellMap::<16_384>::new(&corners, 1300, 1300),
        Err(CellsError::TooLarge { .. })
    ));
}

/// The cell of each pixel in exact integers; the corners are integers too.
fn exact_cell(corners: [[i64; 2]; 4], pixel: [i64; 2]) -> Option<usize> {
    let [[x0, y0], [x1, y1], [x2, y2], [x3, y3]] = corners.map(|point| point.map(i128::from));
    let (dx1, dx2, sx) = (x1 - x2, x3 - x2, x0 - x1 + x2 - x3);
    let (dy1, dy2, sy) = (y1 - y2, y3 - y2, y0 - y1 + y2 - y3);
    let one = dx1 * dy2 - dx2 * dy1;
    let (p, q) = (sx * dy2 - dx2 * sy, dx1 * sy - sx * dy1);
    // The map times 7·determinant.
    let [[a, b, c], [d, e, f], [g, h, i]] = [
        [(x1 - x0) * one + p * x1, (x3 - x0) * one + q * x3, 7 * one * x0],
        [(y1 - y0) * one + p * y1, (y3 - y0) * one + q * y3, 7 * one * y0],
        [p, q, 7 * one],
    ];
    let [x, y] = pixel.map(i128::from);
    let [u, v, w] = [
        [e * i - f * h, c * h - b * i, b * f - c * e],
        [f * g - d * i, a * i - c * g, c * d - a * f],
        [d * h - e * g, b * g - a * h, a * e - b * d],
    ]
    .map(|[r, s, t]| r * x + s * y + t);
    let nearest = |number: i128| {
        let (number, w) = if w < 0 { (-number, -w) } else { (number, w) };
        (2 * number + w).div_euclid(2 * w)
    };
    let (column, row) = (nearest(u), nearest(v));
    let within = (0..8).contains(&column) && (0..8).contains(&row);
    within.then_some((8 * row + column) as usize)
}

/// Distance of a pixel from its cell's border, in pitches.
fn to_border(corners: &Corners, [x, y]: [usize; 2]) -> f64 {
    let position = corners.homography().to_panel([x as f64, y as f64]);
    let distance = |c: f64| (c + 0.5 - (c + 0.5).round()).abs();
    distance(position[0]).min(distance(position[1]))
}

/// Pixels closer to a border than this, in pitches, may belong to either cell.
const BORDER: f64 = 1e-4;

#[test]
fn pixels_belong_to_the_cells_that_whole_numbers_give_them() {
    let (mut on_borders, mut naive_worst) = (0, 0.0f64);
    // Upright panels with borders through pixel centres; then rotated and slanted ones, at the far end of a large sensor.
    let poses: [([[i64; 2]; 4], bool); 5] = [
        ([[8000, 7000], [8056, 7000], [8056, 7056], [8000, 7056]], true),
        ([[7903, 6905], [7945, 6905], [7945, 6975], [7903, 6975]], true),
        ([[8001, 7002], [8071, 7009], [8064, 7079], [7994, 7072]], false),
        ([[7905, 7003], [8000, 7040], [7990, 7100], [7911, 7090]], false),
        ([[7800, 6900], [7912, 6914], [7898, 7012], [7814, 6998]], false),
    ];
    for (points, is_upright) in poses {
        let as_f32 = points.map(|point| point.map(|c| c as f32));
        let corners = Corners::new(as_f32).expect("a panel");
        let map = CellMap::<40_000>::new(&corners, 8192, 8192).expect("cells");
        let naive = Naive::new(as_f32);
        for y in 6880..7120 {
            for x in 7780..8100 {
                let exact = exact_cell(points, [x as i64, y as i64]);
                let near = to_border(&corners, [x, y]) < BORDER;
                on_borders += usize::from(near);
                if is_upright || !near {
                    assert_eq!(map.cell(x, y), exact, "pixel ({x}, {y}) of {points:?}");
                }
                let [u, v] = Naive::project(&naive.inverse, [x as f32, y as f32]);
                if exact.is_some() {
                    let [p, q] = corners.homography().to_panel([x as f64, y as f64]);
                    naive_worst = naive_worst.max((f64::from(u) - p).hypot(f64::from(v) - q));
                }
            }
        }
    }
    assert!(on_borders > 1000, "{on_borders} pixels on borders");
    assert!(naive_worst > 5.0 * BORDER, "{naive_worst}");
}
