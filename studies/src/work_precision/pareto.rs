//! The Pareto front of error and cost.

use super::point::Point;

/// Marks the points that no other beats: no other is at least as good in both and better in one.
///
/// Errors that are bounds count with their bound.
pub fn mark_front(points: &mut [Point]) {
    let places: Vec<[f64; 2]> = points.iter().map(|p| [p.error, p.cost.median]).collect();
    let beats = |one: &[f64; 2], other: &[f64; 2]| one[0] <= other[0] && one[1] <= other[1] && (one[0] < other[0] || one[1] < other[1]);
    for (point, place) in points.iter_mut().zip(&places) {
        point.on_front = place.iter().all(|value| value.is_finite()) && !places.iter().any(|other| beats(other, place));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::work_precision::quartiles::Quartiles;
    use properties::prelude::*;

    properties! {
        #[test]
        fn each_point_is_on_the_front_or_beaten_by_one_that_is(values in prop::collection::vec((0u8..20, 0u8..20), 1..30)) {
            let mut points: Vec<Point> = values.iter().map(|&(error, cost)| Point {
                cost: Quartiles::exactly(cost.into()),
                ..Point::new("", error.into())
            }).collect();
            mark_front(&mut points);
            for point in &points {
                let by_front = points.iter().any(|other| {
                    other.on_front && other.error <= point.error && other.cost.median <= point.cost.median
                        && (other.error < point.error || other.cost.median < point.cost.median)
                });
                prop_assert_ne!(point.on_front, by_front);
            }
        }
    }

    #[test]
    fn only_what_is_beaten_in_both_is_behind_the_front() {
        let mut points = [(3.0, 1.0), (1.0, 3.0), (3.0, 3.0)].map(|(error, cost)| Point {
            cost: Quartiles::exactly(cost),
            ..Point::new("", error)
        });
        mark_front(&mut points);
        assert_eq!(points.map(|point| point.on_front), [true, true, false]);
    }

    #[test]
    fn what_is_no_number_is_on_no_front() {
        let mut points = [Point::new("", f64::NAN)];
        mark_front(&mut points);
        assert!(!points[0].on_front);
    }
}
