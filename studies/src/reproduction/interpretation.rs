//! The interpretations of the paper's contradictions and gaps, each as a few scene keys.

/// One interpretation: its differences from the scene `paper`.
#[derive(Clone, Copy, Debug)]
pub struct Interpretation {
    /// A short name.
    pub name: &'static str,
    /// Its reading of the paper.
    pub summary: &'static str,
    /// Scene keys in the form of `--set`.
    pub overrides: &'static [&'static str],
}

/// The other interpretations in the report, besides the unchanged scene.
pub const INTERPRETATIONS: [Interpretation; 9] = [
    Interpretation {
        name: "eq10",
        summary: "an On LED is 1 + r times as bright as an Off one, as Eq. (10) prints it",
        overrides: &["link.contrast=eq10"],
    },
    Interpretation {
        name: "18mm",
        summary: "the lens of section 4.3 instead of Table 1's",
        overrides: &["camera.focal_length_mm=18"],
    },
    Interpretation {
        name: "iso3200",
        summary: "the ISO limit of Table 1, which darkens the frame below 500 lx, 3 % of the paper's light: here at its lowest, 50 lx",
        overrides: &["camera.iso_max=3200", "ambient.illuminance_lx=50"],
    },
    Interpretation {
        name: "8000cd",
        summary: "LEDs give no more than the 8000 cd/m² of Table 1, which bounds the ratio in strong light: here at 10 000 lx",
        overrides: &["panel.luminance_max_cd_m2=8000", "ambient.illuminance_lx=10000"],
    },
    Interpretation {
        name: "eq10-18mm",
        summary: "both: contrast 1 + r and the 18 mm lens",
        overrides: &["link.contrast=eq10", "camera.focal_length_mm=18"],
    },
    Interpretation {
        name: "blur-0.8",
        summary: "a blur of 1.5 px cut to 3 × 3 pixels, MATLAB's default size: an effective 0.8 px",
        overrides: &["camera.blur_sigma_px=0.8"],
    },
    Interpretation {
        name: "board",
        summary: "the LEDs sit on a black board of reflectance 0.05 instead of the grey background",
        overrides: &["panel.board_reflectance=0.05"],
    },
    Interpretation {
        name: "gamma-1",
        summary: "features of linear grey: no gamma before clipping",
        overrides: &["camera.gamma=1"],
    },
    Interpretation {
        name: "noise",
        summary: "beyond the paper: shot and read noise, at 50 lx and so ISO 32 000",
        overrides: &["effects.noise=auto", "ambient.illuminance_lx=50"],
    },
];
