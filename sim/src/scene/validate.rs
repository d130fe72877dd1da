//! Checks every key against the ranges of the scene's [tables](super::tables).

use super::range::{RangeError, Ranged};
use super::{Link, Scene};

/// The most panels of a scene, so that they and their tables take less than 1 GB.
const PANELS_MAX: usize = 4096;

impl Scene {
    /// Checks every key against its range; the names in `[effects]` are checked by the module of effects.
    ///
    /// # Errors
    /// The first key that is out of range.
    pub fn validate(&self) -> Result<(), RangeError> {
        self.camera.check(|key| format!("camera.{key}"))?;
        if !(1..=PANELS_MAX).contains(&self.panels.len()) {
            return Err(RangeError {
                key: "panel".into(),
                value: format!("{} panels", self.panels.len()),
                allowed: format!("1 to {PANELS_MAX} of them"),
                way_out: "give the one that sends, and leave out those that are not looked at".into(),
            });
        }
        for (index, panel) in self.panels.iter().enumerate() {
            // Overrides set keys of the first panel only.
            let of_panel = |error: RangeError| match index {
                0 => error,
                _ => RangeError {
                    key: format!("{} (panel {index})", error.key),
                    way_out: "set it in the scene file".into(),
                    ..error
                },
            };
            panel.check(|key| format!("panel.{key}")).map_err(of_panel)?;
            if let Some(pose) = &panel.pose {
                pose.check(|key| format!("panel.pose.{key}")).map_err(of_panel)?;
            }
        }
        self.pose.check(|key| format!("pose.{key}"))?;
        self.ambient.check(|key| format!("ambient.{key}"))?;
        self.atmosphere.check(|key| format!("atmosphere.{key}"))?;
        self.link.check(|key| format!("link.{key}"))?;
        // One exposure may see the symbol at its start and two more.
        let exposure_s = self.camera.exposure_s.unwrap_or(self.camera.exposure_max_s);
        let longest_s = exposure_s + self.camera.readout_s;
        let fastest = (Link::WINDOW - 1) as f64 / longest_s;
        let times = |error: RangeError| RangeError {
            key: format!("{} (times exposure_s or exposure_max_s, + readout_s)", error.key),
            ..error
        };
        let rate = self.link.symbol_rate_hz.check(0.1..=fastest, &|| "link.symbol_rate_hz".into());
        rate.map_err(times)?;
        self.link.waveform()?;
        self.effects.check(|key| format!("effects.{key}"))
    }
}
