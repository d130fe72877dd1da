//! A panel's pose in metres and degrees, as text and as JSON.

use reception::panel_pose::{PanelPose, PoseResult, configured_size};
use rx_pipeline::pose::{Estimate, PanelSize};
use serde_json::{Value, json};

/// Options of the panel.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct PanelArguments {
    /// The gap between the panel's LEDs in LED diameters, as `panel.interval` in a scene. With --led-diameter, and focal_px in --camera,
    /// the panel's pose in metres is printed.
    #[arg(long, value_name = "I")]
    interval: Option<f64>,
    /// Diameter of the panel's LEDs in metres; the scenes' is 0.03.
    #[arg(long, value_name = "M")]
    led_diameter: Option<f64>,
}

impl PanelArguments {
    /// Whether any option is set.
    pub fn is_set(&self) -> bool {
        self.interval.or(self.led_diameter).is_some()
    }

    /// The panel's size, if set.
    pub fn size(&self) -> anyhow::Result<Option<PanelSize>> {
        Ok(configured_size(self.led_diameter, self.interval)?)
    }
}

/// The pose as JSON, with the closing speed once it is known.
pub fn panel_pose_json(panel_pose: &PanelPose) -> Value {
    let mut pose = as_json(panel_pose.measured());
    if let Some(Estimate { value, sigma }) = panel_pose.speed_m_s() {
        pose["closing_speed_m_s"] = value.into();
        pose["closing_speed_sigma_m_s"] = sigma.into();
    }
    if let Some(Estimate { value, sigma }) = panel_pose.time_to_collision_s() {
        pose["time_to_collision_s"] = value.into();
        pose["time_to_collision_sigma_s"] = sigma.into();
    }
    pose
}

/// The pose as text to append to a line, if it `is_asked`.
pub fn panel_pose_text(panel_pose: &PanelPose, is_asked: bool) -> String {
    if !is_asked {
        return String::new();
    }
    let mut text = format!("; {}", as_text(panel_pose.measured()));
    if let Some(speed) = panel_pose.speed_m_s() {
        text += &format!("; approaching at {} m/s", with_sigma(speed));
        if let Some(time) = panel_pose.time_to_collision_s() {
            text += &format!(", arriving in {} s", with_sigma(time));
        }
    }
    text
}

/// A pose as JSON: angles in degrees, standard deviations, covariances in metres and radians.
pub fn as_json(measured: &PoseResult) -> Value {
    let pose = match measured {
        Ok(pose) => pose,
        Err(why) => return json!({ "known": false, "why": why }),
    };
    let numbers = pose.numbers();
    let angles = [numbers.azimuth, numbers.elevation, numbers.roll, numbers.yaw, numbers.pitch];
    let [azimuth, elevation, roll, yaw, pitch] = angles.map(in_degrees);
    let solutions = pose.solutions.map(|solution| {
        let [roll, yaw, pitch] = solution.angles().map(f64::to_degrees);
        json!({
            "probability": solution.probability, "range_m": solution.range_m, "roll_deg": roll, "yaw_deg": yaw, "pitch_deg": pitch,
        })
    });
    json!({
        "known": true,
        "range_m": numbers.range_m.value, "range_sigma_m": numbers.range_m.sigma,
        "azimuth_deg": azimuth.value, "azimuth_sigma_deg": azimuth.sigma,
        "elevation_deg": elevation.value, "elevation_sigma_deg": elevation.sigma,
        "roll_deg": roll.value, "roll_sigma_deg": roll.sigma,
        "yaw_deg": yaw.value, "yaw_sigma_deg": yaw.sigma,
        "pitch_deg": pitch.value, "pitch_sigma_deg": pitch.sigma,
        "translation_m": pose.translation_m, "rotation": pose.rotation, "covariance": pose.covariance,
        "solutions": solutions, "inflation": pose.inflation,
    })
}

pub fn as_text(measured: &PoseResult) -> String {
    let pose = match measured {
        Ok(pose) => pose,
        Err(why) => return format!("pose unknown: {why}"),
    };
    let numbers = pose.numbers();
    let metres = with_sigma(numbers.range_m);
    let [azimuth, elevation, roll, yaw, pitch] =
        [numbers.azimuth, numbers.elevation, numbers.roll, numbers.yaw, numbers.pitch].map(|known| with_sigma(in_degrees(known)));
    let [_, other] = pose.solutions;
    let mirrored = if other.probability > 0.01 {
        let [_, yaw, pitch] = other.angles().map(f64::to_degrees);
        format!("; or, by {:.0} %, yaw {yaw:.0}°, pitch {pitch:.0}°", 100.0 * other.probability)
    } else {
        String::new()
    };
    format!("{metres} m away, azimuth {azimuth}°, elevation {elevation}°, roll {roll}°, yaw {yaw}°, pitch {pitch}°{mirrored}")
}

fn in_degrees(known: Estimate) -> Estimate {
    Estimate {
        value: known.value.to_degrees(),
        sigma: known.sigma.to_degrees(),
    }
}

/// Formats a number with its standard deviation to two digits of the latter.
pub fn with_sigma(Estimate { value, sigma }: Estimate) -> String {
    let digits = (1.0 - sigma.max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.digits$} ± {sigma:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_the_digits_that_are_known_of_it() {
        let of = |value, sigma| with_sigma(Estimate { value, sigma });
        assert_eq!(of(50.1234, 0.0123), "50.123 ± 0.012");
        assert_eq!(of(7.4, 12.0), "7 ± 12");
        assert_eq!(of(1.0, 0.0), "1.000000 ± 0.000000");
    }

    #[test]
    fn a_panel_s_size_is_checked() {
        let told = |interval, led_diameter| PanelArguments { interval, led_diameter }.size();
        assert!(told(None, None).unwrap().is_none());
        assert!(told(Some(1.0), None).unwrap().is_none());
        assert_eq!(told(Some(1.0), Some(0.03)).unwrap().unwrap().pitch_m(), 0.06);
        for (interval, diameter) in [(Some(-1.0), None), (None, Some(f64::NAN)), (Some(1.0), Some(0.0))] {
            assert!(told(interval, diameter).is_err());
        }
    }
}
