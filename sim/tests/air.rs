//! Fog lies over panels and background alike.

use link::panel::PanelFrame;
use sim::accuracy::Level;
use sim::air::Air;
use sim::renderer::Renderer;
use sim::renderer::canvas::Canvas;
use sim::scene::Scene;

/// The darkest and the brightest linear value around the panel of `scene`, showing `bits`.
fn range(scene: &Scene, bits: u64) -> [f64; 2] {
    let renderer = Renderer::new(scene, Level::Reference).expect("a visible scene");
    let mut canvas = Canvas::<f64>::new(renderer.surroundings(0));
    let shown = [renderer.steady(0, PanelFrame::from_bits(bits))];
    renderer.draw_exact(&renderer.moment(1, 0), &shown, &mut canvas);
    let values = canvas.values().iter();
    values.fold([f64::INFINITY, 0.0], |[low, high], &value| [low.min(value), high.max(value)])
}

fn fog(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|set| set.to_string()).collect();
    Scene::load("fog", &overrides).expect("a valid scene")
}

#[test]
fn a_dark_led_like_the_background_is_seen_at_no_distance() {
    for distance in ["30", "70", "160"] {
        let distance = format!("pose.distance_m={distance}");
        let scene = fog(&["panel.reflectance=0.18", "panel.interval=3", &distance]);
        for value in range(&scene, 0) {
            assert!((value - 1.0).abs() < 1e-12, "{distance}: {value} on a background of 1");
        }
    }
}

#[test]
fn a_darker_led_stays_darker_than_the_background() {
    let [low, high] = range(&fog(&["panel.reflectance=0.05"]), 0);
    assert!(low < 0.99 && high < 1.0 + 1e-12, "{low} to {high}");
}

#[test]
fn the_contrast_of_an_on_led_falls_as_koschmieder_says() {
    let effects = ["effects.blur=off", "effects.pwm=off", "camera.exposure_bias_ev=-3", "link.l2a=2"];
    let of = |airlight: &str| {
        let airlight = format!("atmosphere.airlight={airlight}");
        let settings: Vec<&str> = effects.into_iter().chain([airlight.as_str()]).collect();
        fog(&settings)
    };
    // A lone LED of several pixels, so that one of them is all LED.
    let contrast = |scene: &Scene| {
        let mut scene = scene.clone();
        scene.panels[0].led_diameter_m = 0.1;
        let [low, high] = range(&scene, 1);
        (high - low) / low
    };
    let foggy = of("true");
    let mut clear = of("false");
    clear.atmosphere.transmission_at_70m = 1.0;
    let (distance_m, reflectance) = (clear.pose.distance_m, clear.ambient.background_reflectance);
    let air = Air::over(&foggy, distance_m);
    // The horizon is a white diffuser: in the background's own light it is 1/reflectance.
    let left = air.transmission / (air.transmission + (1.0 - air.transmission) / reflectance);
    let (seen, expected) = (contrast(&foggy), contrast(&clear) * left);
    assert!((seen - expected).abs() < 1e-3 * expected, "{seen} for {expected}");
}
