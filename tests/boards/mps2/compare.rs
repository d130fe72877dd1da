//! The board beside this computer.

use std::path::Path;

use link::framing::Event;
use rx_pipeline::board::{Answer, MethodChoice, Report, Request, Unread, WireReading};
use rx_pipeline::corners::Corners;
use rx_pipeline::frame::Frame;
use rx_pipeline::parameters::tracking::PATIENCE_FRAMES;
use rx_pipeline::receiver::{NoSearch, Receiver, ReceiverMemory};

use vocc_tests::firmware::say;

use crate::board::{Board, instructions};
use crate::film::{Cut, Film, MESSAGE};
use crate::measure::{Costs, KMEANS_STACK_MAX, STACK_MAX};

/// What a report says, the message apart.
pub struct Told {
    pub reading: Result<WireReading, Unread>,
    message: Option<Vec<u8>>,
    ticks: u32,
    pub stage_ticks: Vec<u32>,
}

impl Told {
    fn of(report: &Report<'_>) -> Self {
        Self {
            reading: report.reading,
            message: report.message.map(|message| message.bytes.to_vec()),
            ticks: report.ticks,
            stage_ticks: report.stage_ticks.to_vec(),
        }
    }
}

/// Has the board read a region.
pub fn read(board: &mut Board, cut: &Cut, corners: Option<Corners>) -> Told {
    board.ask(&Request::Region(cut.region(corners)), |answer| match answer {
        Answer::Report(report) => Told::of(report),
        other => panic!("{other:?}"),
    })
}

/// Where the panel will be, by where it was seen.
struct Course {
    place: [f32; 2],
    speed: Option<[f32; 2]>,
    missed: f32,
}

impl Course {
    fn from(place: [f32; 2]) -> Self {
        Self {
            place,
            speed: None,
            missed: 0.0,
        }
    }

    fn next(&mut self) -> [f32; 2] {
        self.missed += 1.0;
        let speed = self.speed.unwrap_or_default();
        [0, 1].map(|axis| self.place[axis] + self.missed * speed[axis])
    }

    fn seen(&mut self, place: [f32; 2]) {
        self.speed = Some([0, 1].map(|axis| (place[axis] - self.place[axis]) / self.missed));
        (self.place, self.missed) = (place, 0.0);
    }
}

/// Shows the board a film in regions of `side` px around where it saw the panel last, and this computer's receiver the same.
fn show(image: &Path, film: &Film, side: u16, method: MethodChoice) -> Costs {
    let settings = Film::settings(method);
    let mut board = Board::begin(image, settings);
    let memory = Box::<ReceiverMemory<9216>>::default();
    let mut host = Receiver::new(settings.into(), memory, NoSearch).expect("settings in range");
    let mut course = Course::from(film.corners.centre_px());
    let mut costs = Costs::default();
    let (mut messages, mut host_messages) = (vec![], vec![]);
    // Frames that show one symbol: how many there are, and how many were read.
    let clear = film.sent.iter().flatten().count();
    let (mut read_clear, mut wrong) = (0, 0);
    for (number, pixels) in film.frames.iter().enumerate() {
        let cut = Cut::around(course.next(), side, number as u64, pixels);
        let told = read(&mut board, &cut, (number == 0).then_some(film.corners));
        costs.add(told.ticks, &told.stage_ticks);
        messages.extend(told.message);
        let square = usize::from(side);
        let frame = Frame::new(&cut.pixels, square, square).expect("a frame");
        if number == 0 {
            host.place(film.corners, cut.origin, (square, square))
                .expect("a panel in the region");
        }
        let outcome = host.region(number as u64, cut.origin, &frame, &mut ());
        if let Event::Delivered(delivery) = outcome.event {
            host_messages.push(delivery.message.to_vec());
        }
        match (told.reading, outcome.reading) {
            (Ok(sight), Ok(reading)) => {
                assert_eq!(sight.bits, reading.detection.bits.bits(), "frame {number}");
                let soft = sight.soft.as_flattened().iter();
                for (board, host) in soft.zip(reading.detection.soft.0) {
                    let apart = (i32::from(*board) - i32::from(host)).abs();
                    costs.soft_apart = costs.soft_apart.max(apart);
                }
                let corners = Corners::new(sight.corners).expect("a panel");
                let [x, y] = cut.origin.map(f32::from);
                for (seen, here) in corners.points().iter().zip(reading.corners.points()) {
                    let apart = (seen[0] - x - here[0]).hypot(seen[1] - y - here[1]);
                    costs.corners_apart_px = costs.corners_apart_px.max(apart);
                }
                course.seen(corners.centre_px());
                if let Some(sent) = film.sent[number] {
                    read_clear += 1;
                    wrong += (sent ^ sight.bits).count_ones();
                }
            }
            (Err(board), Err(host)) => assert_eq!(board, Unread::from(host)),
            (board, host) => panic!("frame {number}: {board:?} and {host:?}"),
        }
    }
    let last = board.ask(&Request::Finish, |answer| match answer {
        Answer::Finished(message) => message.map(|message| message.bytes.to_vec()),
        other => panic!("{other:?}"),
    });
    messages.extend(last);
    if let Event::Delivered(delivery) = host.finish() {
        host_messages.push(delivery.message.to_vec());
    }
    costs.stack_bytes = board.stack_bytes();
    assert!(read_clear * 20 >= clear * 19, "{read_clear} of {clear}");
    assert_eq!(wrong, 0, "bits that are not those sent");
    assert_eq!(messages, host_messages);
    assert!(costs.soft_apart <= 1, "{} steps", costs.soft_apart);
    assert!(costs.corners_apart_px < 0.01, "{} px", costs.corners_apart_px);
    costs.tell(&format!("{method:?}, {side} × {side} px"));
    assert!(messages.iter().all(|message| message == MESSAGE));
    assert!(!messages.is_empty() || film.delivered.is_empty());
    costs
}

/// With the paper's detector, to a delivered message: half of the frames within the aim, none above 1.8 million instructions.
pub fn k_means_reads_as_on_this_computer(image: &Path) {
    let film = Film::draw(35.0, 30);
    assert!(!film.delivered.is_empty());
    show(image, &film, 64, MethodChoice::KMeans).assert_within([1_500_000, 1_800_000], KMEANS_STACK_MAX);
}

/// With the better detector, to a delivered message: seven times the instructions of k-means for half of the frames, seventy for a few.
pub fn maximum_likelihood_reads_as_on_this_computer(image: &Path) {
    let film = Film::draw(35.0, 20);
    assert!(!film.delivered.is_empty());
    show(image, &film, 64, MethodChoice::MaximumLikelihood).assert_within([9_000_000, 135_000_000], STACK_MAX);
}

/// Regions of 128 × 128 pixels, nearly filled by the panel.
pub fn the_largest_region_is_read(image: &Path) {
    for (method, frames, instructions) in [
        (MethodChoice::KMeans, 8, [4_200_000, 6_200_000]),
        (MethodChoice::MaximumLikelihood, 4, [115_000_000, 115_000_000]),
    ] {
        show(image, &Film::draw(17.0, frames), 128, method).assert_within(instructions, STACK_MAX);
    }
}

/// What a frame may cost in which the panel is looked for around its place.
const SEARCH_MAX: u64 = 32_000_000;

/// A panel that is gone is missed, given up, and read again when its place is told.
pub fn a_lost_panel_is_reported(image: &Path) {
    let film = Film::draw(35.0, 1);
    let mut board = Board::begin(image, Film::settings(MethodChoice::KMeans));
    let cut = Cut::around(film.corners.centre_px(), 64, 0, &film.frames[0]);
    assert_eq!(read(&mut board, &cut, None).reading, Err(Unread::NoPlace));
    assert!(read(&mut board, &cut, Some(film.corners)).reading.is_ok());
    let mut longest = 0;
    for missed in 1..=PATIENCE_FRAMES {
        let told = read(&mut board, &cut.blank(missed.into()), None);
        assert_eq!(told.reading, Err(Unread::Coasting { missed }));
        longest = longest.max(instructions(told.ticks));
    }
    let number = u64::from(PATIENCE_FRAMES) + 1;
    let gone = read(&mut board, &cut.blank(number), None).reading;
    assert_eq!(gone, Err(Unread::Lost));
    assert!(read(&mut board, &cut, Some(film.corners)).reading.is_ok());
    let stack_bytes = board.stack_bytes();
    say(&format!(
        "a frame without the panel: at most {longest} instructions, stack {stack_bytes} bytes"
    ));
    assert!(longest <= SEARCH_MAX && stack_bytes <= STACK_MAX);
}
