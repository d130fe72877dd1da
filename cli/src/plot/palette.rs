//! The colours of all charts. A series that several charts show has the same colour in each.

pub use plotters::style::RGBColor;
pub use plotters::style::colors::{BLACK, WHITE};

/// Colours of series. Colour-blind readers can distinguish the first seven (Okabe & Ito 2008).
const COLOURS: [RGBColor; 10] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
    RGBColor(140, 86, 75),
    RGBColor(120, 130, 0),
    RGBColor(110, 60, 180),
];
/// On LEDs.
pub const ON: RGBColor = COLOURS[1];
/// Off LEDs.
pub const OFF: RGBColor = COLOURS[0];
/// A Pareto front, behind its points.
pub const FRONT: RGBColor = RGBColor(205, 205, 205);
/// Grid lines.
pub const GRID: RGBColor = RGBColor(232, 232, 232);
/// A chart's frame.
pub const EDGE: RGBColor = RGBColor(90, 90, 90);

/// Fixed colours of series that several charts show, by name.
const OWN: [(&str, RGBColor); 14] = [
    ("ml", COLOURS[0]),
    ("kmeans", COLOURS[1]),
    ("fisher", COLOURS[2]),
    ("fisher-ngr", COLOURS[3]),
    ("otsu", COLOURS[4]),
    ("kmeans-raw", COLOURS[5]),
    ("genie", COLOURS[6]),
    ("interval 0.5", COLOURS[0]),
    ("interval 1", COLOURS[1]),
    ("interval 1.5", COLOURS[2]),
    ("interval 2", COLOURS[3]),
    ("Bvar", COLOURS[0]),
    ("Wvar", COLOURS[3]),
    ("B2W", COLOURS[2]),
];

/// The colours of a plot's series, in order: fixed ones by name, the remaining ones from those left.
pub fn colours(names: &[impl AsRef<str>]) -> Vec<RGBColor> {
    let own = |name: &str| OWN.iter().find(|(known, _)| *known == name);
    let own: Vec<Option<RGBColor>> = names.iter().map(|name| own(name.as_ref()).map(|&(_, colour)| colour)).collect();
    let left = COLOURS.iter().filter(|colour| !own.contains(&Some(**colour)));
    // Once all are used, colours repeat.
    let mut left = left.chain(&COLOURS).cycle();
    let mut next = || *left.next().unwrap_or(&BLACK);
    own.iter().map(|own| own.unwrap_or_else(&mut next)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_detector_has_one_colour_whatever_is_beside_it() {
        let alone = colours(&["otsu"]);
        let among = colours(&["a", "ml", "otsu", "b"]);
        assert_eq!(alone[0], among[2]);
        for (k, colour) in among.iter().enumerate() {
            assert!(!among[..k].contains(colour), "{among:?}");
        }
        assert_eq!(colours(&vec!["x"; 25]).len(), 25);
    }
}
