//! A renderer that is rebuilt for moved panels draws the same as a new one, without repeating finished work.

use std::path::PathBuf;

use link::panel::PanelFrame;
use sim::accuracy::Level;
use sim::renderer::Renderer;
use sim::renderer::canvas::Canvas;
use sim::scene::Scene;

/// A file of its own for each test, removed in the end.
struct Picture(PathBuf);

impl Picture {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("vocc-{name}-{}.png", std::process::id()));
        let ramp = image::GrayImage::from_fn(48, 27, |x, y| image::Luma([(40 + 3 * x + y) as u8]));
        ramp.save(&path).expect("room for a picture");
        Self(path)
    }

    fn scene(&self, settings: &[&str]) -> Scene {
        let settings = settings.iter().map(|set| set.to_string());
        let own = [
            format!("ambient.background_image={:?}", self.0),
            "camera.width_px=480".into(),
            "camera.height_px=270".into(),
            "effects.noise=on".into(),
        ];
        Scene::load("night", &settings.chain(own).collect::<Vec<_>>()).expect("a valid scene")
    }
}

impl Drop for Picture {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

fn frame(renderer: &Renderer) -> Vec<u8> {
    let sensor = renderer.sensor();
    let mut grey = vec![0; sensor.width * sensor.height];
    let mut canvas = Canvas::new(renderer.lit_region());
    let shown = [renderer.steady(0, PanelFrame::from_bits(0x0f0f_3333_5555_8001))];
    renderer.frame(1, &renderer.moment(1, 3), &shown, &mut canvas, &mut grey);
    grey
}

#[test]
fn frames_are_those_of_a_new_renderer() {
    let picture = Picture::new("rebuilt");
    let first = Renderer::new(&picture.scene(&[]), Level::Fast).expect("a visible scene");
    let start = frame(&first);
    for settings in [
        &["pose.x_m=1", "pose.distance_m=47"][..],
        &[
            "pose.distance_m=40",
            "atmosphere.airlight=true",
            "atmosphere.transmission_at_70m=0.5",
        ],
        &["ambient.illuminance_lx=900"],
        &["effects.photograph=off"],
        &["camera.vignetting=true", "effects.vignetting=on"],
        &["ambient.lamp_lx=30", "ambient.lamp_x_deg=3"],
    ] {
        let scene = picture.scene(settings);
        let rebuilt = frame(&first.rebuilt_for(&scene).expect("a visible scene"));
        let new = frame(&Renderer::new(&scene, Level::Fast).expect("a visible scene"));
        assert!(rebuilt == new, "{settings:?}");
        assert!(rebuilt != start, "{settings:?} changes nothing, so this shows nothing");
    }
}

#[test]
fn the_background_follows_the_lamp() {
    let picture = Picture::new("lamp");
    let lit = |settings: &[&str]| picture.scene(&[&["ambient.lamp_lx=30"], settings].concat());
    let first = Renderer::new(&lit(&[]), Level::Fast).expect("a visible scene");
    let start = frame(&first);
    for moved in [&["ambient.lamp_x_deg=3"][..], &["ambient.lamp_lx=60"]] {
        let rebuilt = frame(&first.rebuilt_for(&lit(moved)).expect("a visible scene"));
        let new = frame(&Renderer::new(&lit(moved), Level::Fast).expect("a visible scene"));
        assert!(rebuilt == new && rebuilt != start, "{moved:?}");
    }
}

#[test]
fn the_photograph_is_read_once() {
    let picture = Picture::new("once");
    let first = Renderer::new(&picture.scene(&[]), Level::Fast).expect("a visible scene");
    let moved = picture.scene(&["pose.x_m=1"]);
    drop(picture);
    assert!(Renderer::new(&moved, Level::Fast).is_err());
    assert!(first.rebuilt_for(&moved).is_ok());
}
