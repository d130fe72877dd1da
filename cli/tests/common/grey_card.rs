//! A panel at 5 m before a wall that is as grey as a card, so that any part of it is one.

/// What makes a scene so; the camera exposes for On LEDs at full duty.
pub const SCENE: [&str; 5] = [
    "camera.width_px=640",
    "camera.height_px=480",
    "camera.exposure_bias_ev=-4",
    "pose.distance_m=5",
    "ambient.background_reflectance=0.18",
];

/// Where the panel and the card then are.
pub const PLACES: [&str; 4] = ["--corners", "167,87,473,87,473,393,167,393", "--card", "20,100,100,200"];
