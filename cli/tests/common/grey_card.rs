//! A panel at 5 m in front of a wall as grey as a grey card, so that any part of the wall is a card.

/// The settings of such a scene; the camera exposes for On LEDs at full duty.
pub const SCENE: [&str; 5] = [
    "camera.width_px=640",
    "camera.height_px=480",
    "camera.exposure_bias_ev=-4",
    "pose.distance_m=5",
    "ambient.background_reflectance=0.18",
];

/// The corners of the panel and of the card in this scene.
pub const PLACES: [&str; 4] = ["--corners", "167,87,473,87,473,393,167,393", "--card", "20,100,100,200"];
