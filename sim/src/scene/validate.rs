//! The range of every key.

use link::panel::{LEDS, SIDE};

use super::{L2a, Leds, Link, Pose, Scene};

/// A value that is not allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{key} = {value}: must be {allowed}; {way_out}")]
pub struct RangeError {
    /// The scene key.
    pub key: String,
    /// Its value.
    pub value: String,
    /// What is allowed.
    pub allowed: String,
    /// What to do.
    pub way_out: String,
}

/// That `value` of `key` is finite and within `min` to `max`.
fn within(key: &str, value: f64, min: f64, max: f64) -> Result<(), RangeError> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(RangeError {
        key: key.into(),
        value: value.to_string(),
        allowed: format!("a number from {min} to {max}"),
        way_out: format!("set it with {key}=… or in the scene file"),
    })
}

/// The most panels of a scene: so that they and their tables are less than 1 GB.
pub const PANELS_MAX: usize = 4096;

impl Scene {
    /// Checks every key against its range; the names in `[effects]` are checked by whoever knows the effects.
    ///
    /// # Errors
    /// The first key that is out of range.
    pub fn validate(&self) -> Result<(), RangeError> {
        self.validate_camera()?;
        if self.panels.len() > PANELS_MAX {
            return Err(RangeError {
                key: "panel".into(),
                value: format!("{} panels", self.panels.len()),
                allowed: format!("at most {PANELS_MAX} of them"),
                way_out: "leave out those that are not looked at".into(),
            });
        }
        for (index, panel) in self.panels.iter().enumerate() {
            self.validate_panel(index, panel)?;
        }
        validate_pose("pose", &self.pose)?;
        within("ambient.illuminance_lx", self.ambient.illuminance_lx, 0.1, 200_000.0)?;
        within("ambient.background_reflectance", self.ambient.background_reflectance, 0.01, 1.0)?;
        within("atmosphere.transmission_at_70m", self.atmosphere.transmission_at_70m, 1e-6, 1.0)?;
        if let Some(luminance) = self.atmosphere.airlight_cd_m2 {
            within("atmosphere.airlight_cd_m2", luminance, 0.0, 1e6)?;
        }
        self.validate_link()?;
        within("effects.tolerance_grey", self.effects.tolerance_grey, 0.0, 255.0)?;
        Ok(())
    }

    fn validate_camera(&self) -> Result<(), RangeError> {
        let camera = &self.camera;
        within("camera.focal_length_mm", camera.focal_length_mm, 0.5, 1000.0)?;
        within("camera.pixel_pitch_um", camera.pixel_pitch_um, 0.5, 50.0)?;
        within("camera.width_px", camera.width_px as f64, 16.0, 8192.0)?;
        within("camera.height_px", camera.height_px as f64, 16.0, 8192.0)?;
        within("camera.frame_rate_hz", camera.frame_rate_hz, 1.0, 10_000.0)?;
        within("camera.exposure_max_s", camera.exposure_max_s, 1e-6, 1.0 / camera.frame_rate_hz)?;
        within("camera.f_number", camera.f_number, 0.7, 64.0)?;
        within("camera.iso_min", camera.iso_min, 1.0, 1e6)?;
        within("camera.iso_max", camera.iso_max, camera.iso_min, 1e7)?;
        within("camera.meter_constant", camera.meter_constant, 5.0, 30.0)?;
        within("camera.gamma", camera.gamma, 1.0, 4.0)?;
        within("camera.black_grey", camera.black_grey, 0.0, 64.0)?;
        within("camera.blur_sigma_px", camera.blur_sigma_px, 0.0, 20.0)?;
        within("camera.blur_aspect", camera.blur_aspect, 0.25, 4.0)?;
        within("camera.exposure_bias_ev", camera.exposure_bias_ev, -8.0, 8.0)?;
        within("camera.full_well_e", camera.full_well_e, 100.0, 1e7)?;
        within("camera.read_noise_e", camera.read_noise_e, 0.0, 1000.0)?;
        within("camera.readout_s", camera.readout_s, 0.0, 1.0 / camera.frame_rate_hz)?;
        within("camera.distortion_k1", camera.distortion_k1, -0.5, 0.5)?;
        within("camera.prnu_percent", camera.prnu_percent, 0.0, 20.0)?;
        within("camera.dsnu_e", camera.dsnu_e, 0.0, 1000.0)?;
        within("camera.hot_pixels_ppm", camera.hot_pixels_ppm, 0.0, 10_000.0)?;
        within("camera.hot_pixel_grey", camera.hot_pixel_grey, 0.0, 255.0)?;
        within("camera.sharpening", camera.sharpening, 0.0, 5.0)?;
        within("camera.sharpening_radius_px", camera.sharpening_radius_px, 0.3, 10.0)?;
        match camera.jpeg_quality {
            Some(quality) => within("camera.jpeg_quality", quality.into(), 1.0, 100.0),
            None => Ok(()),
        }
    }

    fn validate_panel(&self, index: usize, panel: &super::Panel) -> Result<(), RangeError> {
        let key = |name: &str| format!("panel.{name} (panel {index})");
        within(&key("led_diameter_m"), panel.led_diameter_m, 0.001, 1.0)?;
        within(&key("interval"), panel.interval, 0.05, 10.0)?;
        within(&key("reflectance"), panel.reflectance, 0.01, 1.0)?;
        let floor = panel.luminance_min_cd_m2.unwrap_or(0.0);
        within(&key("luminance_min_cd_m2"), floor, 0.0, 1e7)?;
        if let Some(top) = panel.luminance_max_cd_m2 {
            within(&key("luminance_max_cd_m2"), top, floor.max(1e-3), 1e7)?;
        }
        within(&key("led_spread"), panel.led_spread, 0.0, 0.5)?;
        for part in panel.colour {
            within(&key("colour"), part, 0.0, 1.0)?;
        }
        within_leds(&key("dead_leds"), &panel.dead_leds)?;
        within_leds(&key("stuck_leds"), &panel.stuck_leds)?;
        if let Some(row) = panel.dim_row {
            within(&key("dim_row"), row.into(), 0.0, (SIDE - 1) as f64)?;
        }
        within(&key("dim_row_light"), panel.dim_row_light, 0.0, 1.0)?;
        within(&key("pwm_hz"), panel.pwm_hz, 0.0, 1e7)?;
        within(&key("scan_rows"), f64::from(panel.scan_rows), 0.0, 8.0)?;
        if let Some(reflectance) = panel.board_reflectance {
            within(&key("board_reflectance"), reflectance, 0.0, 1.0)?;
        }
        match &panel.pose {
            Some(pose) => validate_pose(&format!("panel.pose (panel {index})"), pose),
            None => Ok(()),
        }
    }

    fn validate_link(&self) -> Result<(), RangeError> {
        let link = &self.link;
        if let L2a::Ratio(ratio) = link.l2a {
            within("link.l2a", ratio, 0.01, 10.0)?;
        }
        within("link.symbol_rate_hz", link.symbol_rate_hz, 0.1, 10_000.0)?;
        // One exposure may see the symbol at its start and two more.
        let longest_s = self.camera.exposure_max_s + self.camera.readout_s;
        let fastest = (Link::WINDOW - 1) as f64 / longest_s;
        within(
            "link.symbol_rate_hz (times exposure_max_s + readout_s)",
            link.symbol_rate_hz,
            0.1,
            fastest,
        )?;
        within("link.phase", link.phase, 0.0, 1.0)?;
        within("link.clock_ppm", link.clock_ppm, -10_000.0, 10_000.0)
    }
}

/// That some of a panel's LEDs are not more than there are, or none that is not there.
fn within_leds(key: &str, leds: &Leds) -> Result<(), RangeError> {
    match leds {
        Leds::Count(count) => within(key, (*count).into(), 0.0, LEDS as f64),
        Leds::List(list) => list.iter().try_for_each(|&led| within(key, led.into(), 0.0, (LEDS - 1) as f64)),
    }
}

fn validate_pose(table: &str, pose: &Pose) -> Result<(), RangeError> {
    let key = |name: &str| format!("{table}.{name}");
    within(&key("distance_m"), pose.distance_m, 0.5, 2000.0)?;
    within(&key("x_m"), pose.x_m, -2000.0, 2000.0)?;
    within(&key("y_m"), pose.y_m, -2000.0, 2000.0)?;
    within(&key("roll_deg"), pose.roll_deg, -180.0, 180.0)?;
    within(&key("yaw_deg"), pose.yaw_deg, -80.0, 80.0)?;
    within(&key("pitch_deg"), pose.pitch_deg, -80.0, 80.0)?;
    for part in pose.velocity_m_s {
        within(&key("velocity_m_s"), part, -200.0, 200.0)?;
    }
    Ok(())
}
