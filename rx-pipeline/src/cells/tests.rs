//! Cells by the homography, pixel by pixel, and poses without cells.

use super::*;
use properties::prelude::*;

fn square(x: f32, y: f32, pitch: f32) -> Corners {
    let far = 7.0 * pitch;
    Corners::new([[x, y], [x + far, y], [x + far, y + far], [x, y + far]]).unwrap()
}

#[test]
fn each_pixel_belongs_to_the_cell_that_holds_its_centre() {
    let map = CellMap::<1200>::new(&square(4.0, 6.0, 4.0), 40, 40).unwrap();
    assert_eq!(
        map.bounds(),
        Bounds {
            x: 2,
            y: 4,
            width: 33,
            height: 33
        }
    );
    // Borders lie at x = 2, 6, 10…: a pixel on one belongs to the cell on the right.
    assert_eq!(
        [1, 2, 5, 6, 33, 34].map(|x| map.cell(x, 6)),
        [None, Some(0), Some(0), Some(1), Some(7), None]
    );
    assert_eq!(
        [4, 7, 8, 35, 36].map(|y| map.cell(4, y)),
        [Some(0), Some(0), Some(8), Some(56), None]
    );
    assert!((0..64).all(|cell| map.pixels_of_cell(cell) == 16));
    assert_eq!(map.pixels_of_cell(64), 0);
}

#[test]
fn rho_points_to_the_led() {
    let map = CellMap::<1200>::new(&square(4.0, 6.0, 4.0), 40, 40).unwrap();
    assert_eq!(map.rho(8, 6), [0.0, 0.0]);
    approx::assert_abs_diff_eq!(map.rho(7, 6)[..], [1.0, 0.0][..], epsilon = 1e-6);
    let diagonal = core::f32::consts::FRAC_1_SQRT_2;
    approx::assert_abs_diff_eq!(map.rho(9, 7)[..], [-diagonal, -diagonal][..], epsilon = 1e-6);
    assert_eq!(map.rho(0, 0), [0.0, 0.0]);
}

#[test]
fn a_rim_of_one_pixel_is_needed() {
    // The first pixel of the cells is x = ceil(3 − 2) = 1, the last 31.5 floored.
    assert!(CellMap::<2000>::new(&square(3.0, 3.0, 4.0), 35, 35).is_ok());
    let outside = CellMap::<2000>::new(&square(2.0, 3.0, 4.0), 35, 35).unwrap_err();
    assert!(matches!(outside, CellsError::OutsideFrame { left: 0.0, width: 35, .. }));
    assert!(CellMap::<2000>::new(&square(3.0, 3.0, 4.0), 34, 35).is_err());
}

#[test]
fn maps_do_not_overflow() {
    let corners = square(10.0, 10.0, 4.0);
    let mut map = CellMap::<1000>::empty();
    let error = map.build(&corners, 100, 100).unwrap_err();
    assert_eq!(
        error,
        CellsError::TooLarge {
            width: 33,
            height: 33,
            capacity: 1000
        }
    );
    assert_eq!(map.bounds(), Bounds::default());
    assert!(matches!(
        CellMap::<4>::new(&square(200.0, 200.0, 50.0), 900, 900),
        Err(CellsError::TooLarge { .. })
    ));
}

#[test]
fn a_panel_seen_edge_on_has_empty_cells() {
    let flat = Corners::new([[10.0, 20.0], [24.0, 30.0], [38.0, 40.3], [24.0, 30.2]]).unwrap();
    assert!(matches!(CellMap::<2000>::new(&flat, 100, 100), Err(CellsError::EmptyCell { .. })));
}

properties! {
    #[test]
    fn the_map_agrees_with_the_homography(jitter in prop::array::uniform8(-6.0f32..6.0)) {
        let square = [[20.0, 20.0], [62.0, 20.0], [62.0, 62.0], [20.0, 62.0]];
        let points = core::array::from_fn(|i| {
            let [x, y]: [f32; 2] = square[i];
            [x + jitter[2 * i], y + jitter[2 * i + 1]]
        });
        let corners = Corners::new(points).unwrap();
        let map = CellMap::<9000>::new(&corners, 90, 90).unwrap();
        let homography = corners.homography();
        for y in 0..90 {
            for x in 0..90 {
                let position = homography.to_panel([x as f64, y as f64]);
                let on_border = position.iter().any(|c| (c + 0.5 - libm::round(c + 0.5)).abs() < 1e-4);
                if on_border {
                    continue;
                }
                let [column, row] = position.map(|c| libm::floor(c + 0.5));
                let within = (0.0..8.0).contains(&column) && (0.0..8.0).contains(&row);
                prop_assert_eq!(map.cell(x, y), within.then_some((8.0 * row + column) as usize));
                if within {
                    let [cx, cy] = homography.to_image([column, row]);
                    let (dx, dy) = (cx - x as f64, cy - y as f64);
                    let distance = libm::hypot(dx, dy);
                    let [rx, ry] = map.rho(x, y).map(f64::from);
                    prop_assert!((rx * distance - dx).abs() < 1e-4 && (ry * distance - dy).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn upright_panels_need_no_way_of_their_own(
        x in 9.0f32..11.0, y in 9.0f32..11.0, across in 2.0f32..4.2, down in 2.0f32..4.2,
    ) {
        let (right, bottom) = (x + 7.0 * across, y + 7.0 * down);
        let corners = Corners::new([[x, y], [right, y], [right, bottom], [x, bottom]]).unwrap();
        let map = CellMap::<2304>::new(&corners, 48, 48).unwrap();
        let homography = corners.homography();
        let Bounds { x: left, y: top, width, height } = map.bounds();
        let matrix = homography.inverse_from(left as f64, top as f64);
        prop_assert!(is_upright(&matrix));
        let centres = core::array::from_fn(|led| {
            let [x, y] = homography.to_image([(led % SIDE) as f64, (led / SIDE) as f64]);
            [(x - left as f64) as f32, (y - top as f64) as f32]
        });
        let mut slanted = CellMap::<2304>::empty();
        let mut pixels = [0; LEDS];
        slanted.fill_slanted(&matrix, &centres, map.bounds(), &mut pixels);
        let area = width * height;
        prop_assert_eq!(&map.cell[..area], &slanted.cell[..area]);
        prop_assert_eq!(map.pixels.map(u32::from), pixels);
        for (one, other) in [(&map.rho_x, &slanted.rho_x), (&map.rho_y, &slanted.rho_y)] {
            let apart = one[..area].iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            prop_assert!(apart < 1e-5, "{}", apart);
        }
    }

    #[test]
    fn no_pose_panics(
        points in prop::array::uniform4(prop::array::uniform2(-50.0f32..300.0)),
        width in 0usize..300,
        height in 0usize..300,
    ) {
        if let Ok(corners) = Corners::new(points)
            && let Ok(map) = CellMap::<16384>::new(&corners, width, height)
        {
            prop_assert!((0..64).all(|cell| map.pixels_of_cell(cell) > 0));
        }
    }
}
