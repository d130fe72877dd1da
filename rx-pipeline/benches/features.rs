//! Times each stage: `cargo bench -p vocc-rx-pipeline`.

use divan::{Bencher, black_box};
use link::camera::Camera;
use rx_pipeline::{
    cells::CellMap,
    corners::Corners,
    detect::Detector,
    features::Features,
    frame::Frame,
    likelihood::MaximumLikelihood,
    locate::{Locator, LocatorMemory},
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
        let around = [[-reach, -reach], [reach, -reach], [reach, reach], [-reach, reach]];
        Corners::new(around.map(|[x, y]| [39.7 + cos * x - sin * y, 39.3 + sin * x + cos * y])).expect("a valid pose")
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
    let map = CellMap::<8192>::new(&pose.corners(), FRAME_WIDTH, FRAME_WIDTH).expect("the panel is in the frame");
    let pixels = noise();
    let frame = Frame::new(&pixels, FRAME_WIDTH, FRAME_WIDTH).expect("as many pixels as the frame has");
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
    let map = CellMap::<8192>::new(&corners, FRAME_WIDTH, FRAME_WIDTH).expect("the panel is in the frame");
    let pixels = spots(&corners, FRAME_WIDTH, FRAME_WIDTH);
    let frame = Frame::new(&pixels, FRAME_WIDTH, FRAME_WIDTH).expect("as many pixels as the frame has");
    let features = Features::measure(&frame, &map).expect("the map was built for this frame");
    bencher.bench_local(|| detector.detect(black_box(&features)));
}

/// Reads a followed panel by its pixels; every frame shows other bits.
#[divan::bench(args = [&POSES[0], &POSES[1]])]
fn read_by_likelihood(bencher: Bencher, pose: &Pose) {
    let corners = pose.corners();
    let frames = noisy_frames(&corners);
    let mut detector = Box::new(MaximumLikelihood::<8192>::new(Camera::default()));
    let mut next = 0;
    let mut read = || {
        next = (next + 1) % frames.len();
        let frame = Frame::new(&frames[next].1, FRAME_WIDTH, FRAME_WIDTH).expect("as many pixels as the frame has");
        detector.detect(black_box(&frame), &corners).expect("a panel")
    };
    for _ in 0..32 {
        read();
    }
    bencher.bench_local(read);
}

/// Reads the same panels by features and k-means.
#[divan::bench(args = [&POSES[0], &POSES[1]])]
fn read_by_kmeans(bencher: Bencher, pose: &Pose) {
    let corners = pose.corners();
    let frames = noisy_frames(&corners);
    let map = CellMap::<8192>::new(&corners, FRAME_WIDTH, FRAME_WIDTH).expect("the panel is in the frame");
    let mut next = 0;
    bencher.bench_local(|| {
        next = (next + 1) % frames.len();
        let frame = Frame::new(&frames[next].1, FRAME_WIDTH, FRAME_WIDTH).expect("as many pixels as the frame has");
        let features = Features::measure(black_box(&frame), &map).expect("the map was built for this frame");
        Detector::KMeans.detect(&features)
    });
}

/// Panels of random bits, with noise of up to two grey levels per pixel.
fn noisy_frames(corners: &Corners) -> Vec<(u64, Vec<u8>)> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut word = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    (0..64)
        .map(|_| {
            let bits = word();
            let mut pixels = spots_of(bits, corners, FRAME_WIDTH, FRAME_WIDTH);
            for pixel in &mut pixels {
                *pixel = pixel.saturating_add((word() % 5) as u8) - 2;
            }
            (bits, pixels)
        })
        .collect()
}

/// A panel somewhere in a frame of 1920×1080 pixels, and the plain frame without it.
#[divan::bench(args = [true, false], max_time = 2)]
fn locate_full_hd(bencher: Bencher, with_panel: bool) {
    let (width, height) = (1920, 1080);
    let corners = POSES[0].corners().shifted(900.0, 500.0).expect("a valid pose");
    let pixels = if with_panel {
        spots(&corners, width, height)
    } else {
        vec![118; width * height]
    };
    let frame = Frame::new(&pixels, width, height).expect("as many pixels as the frame has");
    let locator = Locator::new(Camera::default()).expect("valid settings");
    let mut memory = Box::new(LocatorMemory::<16384>::new());
    assert_eq!(locator.locate(&frame, &mut memory).is_ok(), with_panel);
    bencher.bench_local(|| locator.locate(black_box(&frame), &mut memory));
}

/// A panel of Gaussian spots, two in three of them On.
fn spots(corners: &Corners, width: usize, height: usize) -> Vec<u8> {
    spots_of(0xdb6d_b6db_6db6_db6d << 1, corners, width, height)
}

/// A panel of Gaussian spots of the given bits.
fn spots_of(bits: u64, corners: &Corners, width: usize, height: usize) -> Vec<u8> {
    let mut light = vec![1.0; width * height];
    let homography = corners.homography();
    for led in 0..64 {
        let [cx, cy] = homography.to_image([f64::from(led % 8), f64::from(led / 8)]);
        let peak = if bits >> led & 1 == 1 { 2.5 } else { 0.3 };
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
