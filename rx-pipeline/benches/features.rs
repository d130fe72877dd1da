//! How long each stage takes: `cargo bench -p rx-pipeline`.

use divan::{Bencher, black_box};
use rx_pipeline::{
    cells::CellMap,
    corners::Corners,
    detect::Detector,
    features::Features,
    frame::Frame,
    locate::{Locator, LocatorSettings},
};

fn main() {
    divan::main();
}

const FRAME_WIDTH: usize = 80;

/// Panels of about 35×35 and 65×65 pixels, upright, and turned by 5°.
const POSES: [Pose; 3] = [
    Pose {
        name: "35x35",
        pitch_px: 4.36,
        roll_deg: 0.0,
    },
    Pose {
        name: "65x65",
        pitch_px: 8.1,
        roll_deg: 0.0,
    },
    Pose {
        name: "35x35 roll 5°",
        pitch_px: 4.0,
        roll_deg: 5.0,
    },
];

struct Pose {
    name: &'static str,
    pitch_px: f32,
    roll_deg: f32,
}

impl std::fmt::Display for Pose {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl Pose {
    fn corners(&self) -> Corners {
        let (sin, cos) = self.roll_deg.to_radians().sin_cos();
        let reach = 3.5 * self.pitch_px;
        let around = [
            [-reach, -reach],
            [reach, -reach],
            [reach, reach],
            [-reach, reach],
        ];
        Corners::new(around.map(|[x, y]| [39.7 + cos * x - sin * y, 39.3 + sin * x + cos * y]))
            .expect("a valid pose")
    }
}

fn noise() -> Vec<u8> {
    (0..(FRAME_WIDTH * FRAME_WIDTH) as u32)
        .map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect()
}

#[divan::bench(args = POSES)]
fn cell_map(bencher: Bencher, pose: &Pose) {
    let corners = pose.corners();
    let mut map = CellMap::<8192>::empty();
    bencher.bench_local(move || map.build(black_box(&corners), FRAME_WIDTH, FRAME_WIDTH));
}

#[divan::bench(args = POSES)]
fn features(bencher: Bencher, pose: &Pose) {
    let map = CellMap::<8192>::new(&pose.corners(), FRAME_WIDTH, FRAME_WIDTH)
        .expect("the panel is in the frame");
    let pixels = noise();
    let frame =
        Frame::new(&pixels, FRAME_WIDTH, FRAME_WIDTH).expect("as many pixels as the frame has");
    bencher.bench_local(|| Features::measure(black_box(&frame), black_box(&map)));
}

#[divan::bench(args = ["kmeans", "kmeans-raw", "otsu"])]
fn detect(bencher: Bencher, detector: &str) {
    let detector = match detector {
        "kmeans" => Detector::KMeans,
        "kmeans-raw" => Detector::KMeansRaw,
        _ => Detector::Otsu,
    };
    let corners = POSES[0].corners();
    let map = CellMap::<8192>::new(&corners, FRAME_WIDTH, FRAME_WIDTH)
        .expect("the panel is in the frame");
    let pixels = spots(&corners, FRAME_WIDTH, FRAME_WIDTH);
    let frame =
        Frame::new(&pixels, FRAME_WIDTH, FRAME_WIDTH).expect("as many pixels as the frame has");
    let features = Features::measure(&frame, &map).expect("the map was built for this frame");
    bencher.bench_local(|| detector.detect(black_box(&features)));
}

/// A panel somewhere in a frame of 1920×1080 pixels, and the plain frame without it.
#[divan::bench(args = [true, false], max_time = 2)]
fn locate_full_hd(bencher: Bencher, with_panel: bool) {
    let (width, height) = (1920, 1080);
    let corners = POSES[0]
        .corners()
        .shifted(900.0, 500.0)
        .expect("a valid pose");
    let pixels = if with_panel {
        spots(&corners, width, height)
    } else {
        vec![118; width * height]
    };
    let frame = Frame::new(&pixels, width, height).expect("as many pixels as the frame has");
    let locator = Locator::new(LocatorSettings::default()).expect("valid settings");
    assert_eq!(locator.locate(&frame).is_ok(), with_panel);
    bencher.bench_local(|| locator.locate(black_box(&frame)));
}

/// A panel of Gaussian spots, two in three of them On.
fn spots(corners: &Corners, width: usize, height: usize) -> Vec<u8> {
    let mut light = vec![1.0; width * height];
    let homography = corners.homography();
    for led in 0..64 {
        let [cx, cy] = homography.to_image([f64::from(led % 8), f64::from(led / 8)]);
        let peak = if led % 3 == 0 { 0.3 } else { 2.5 };
        for y in (cy as usize - 8)..(cy as usize + 9) {
            for x in (cx as usize - 8)..(cx as usize + 9) {
                let square = (x as f64 - cx).powi(2) + (y as f64 - cy).powi(2);
                light[width * y + x] += peak * (-square / 5.0).exp();
            }
        }
    }
    light
        .iter()
        .map(|light: &f64| (118.0 * light.powf(1.0 / 2.2)).round() as u8)
        .collect()
}
