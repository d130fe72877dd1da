//! Cameras with a given exposure time.

use sim::camera::exposure::Exposure;
use sim::scene::Scene;
use sim::scene::SceneError;

/// The widest aperture for setting an exposure.
const WIDEST_F_NUMBER: f64 = 1.4;

/// The scene with a camera that exposes for that time, s: by its aperture, which also models a grey filter before the lens, and beyond
/// f/1.4 by the ISO.
///
/// ```
/// use sim::camera::exposure::Exposure;
/// use sim::scene::Scene;
/// use studies::signalling::exposed_for;
/// let phone = Scene::load("phone", &[])?;
/// for exposure_s in [0.001, 0.01] {
///     assert!((Exposure::of(&exposed_for(&phone, exposure_s)?).time_s - exposure_s).abs() < 1e-9);
/// }
/// # Ok::<(), sim::scene::SceneError>(())
/// ```
///
/// # Errors
/// [`SceneError`] for an impossible exposure.
pub fn exposed_for(scene: &Scene, exposure_s: f64) -> Result<Scene, SceneError> {
    let key = if scene.camera.exposure_s.is_some() {
        "exposure_s"
    } else {
        "exposure_max_s"
    };
    let stops = exposure_s / Exposure::of(scene).time_s;
    let f_number = (scene.camera.f_number * stops.sqrt()).max(WIDEST_F_NUMBER);
    scene.with(
        "the exposure",
        &[format!("camera.{key}={exposure_s}"), format!("camera.f_number={f_number}")],
    )
}
