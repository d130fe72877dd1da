//! Recognises calibration formats by their text.

/// The first message of a topic `camera_info`, in the output of `ros2 topic echo` or `rostopic echo`.
pub fn camera_info(text: &str) -> Option<&str> {
    let text = text.trim_start_matches("---\n").trim_start();
    let message = text.split("\n---").next()?;
    let has = |key: &str| {
        message
            .lines()
            .any(|line| line.strip_prefix(key).is_some_and(|rest| rest.starts_with(':')))
    };
    let is_one = has("distortion_model") && (has("k") || has("K"));
    is_one.then_some(message)
}

/// Names a known format that is not a camera file, and what to use instead; `None` if the format is unknown.
pub fn foreign(text: &str) -> Option<&'static str> {
    let keys = |key: &str| text.lines().any(|line| line.trim_start().starts_with(key));
    let first = text.trim_start().chars().next();
    if first == Some('<') {
        return Some("XML, which is not supported: let OpenCV write it as YAML, into a file whose name ends in .yml");
    }
    if first == Some('{') || first == Some('[') && serde_json::from_str::<serde_json::Value>(text).is_ok() {
        return Some("JSON, which is not supported: write focal_px, principal_px and distortion into a TOML file");
    }
    if keys("intrinsics:") && (keys("camera_model:") || keys("distortion_coeffs:")) {
        return Some(
            "a calibration of Kalibr, which is not read: of a pinhole camera with radtan write its intrinsics fu, fv, cu, cv and its \
             distortion_coeffs into a TOML file: focal_px = [fu, fv], principal_px = [cu, cv], distortion = [k1, k2, p1, p2]",
        );
    }
    let is_yaml = text.starts_with("%YAML") || keys("---") || text.lines().any(|line| line.ends_with(':') || line.contains(": "));
    (is_yaml && toml::from_str::<toml::Table>(text).is_err() && !text.lines().any(|line| line.contains('='))).then_some(
        "YAML, but not a calibration of OpenCV or ROS with a camera_matrix: write focal_px, principal_px and distortion into a TOML file",
    )
}
