//! Counts the events of a receiver over random panels, which are not a transmission.
//!
//! `cargo run --release -p vocc-link --example false_alarms [PANELS [SEED]]` (default: 10 000 000 and 1)

use link::framing::{Deframer, Event};
use link::panel::{PanelFrame, SoftPanel};
use link::scramble::split_mix64;

fn main() -> Result<(), std::num::ParseIntError> {
    let mut arguments = std::env::args().skip(1);
    let panels: u32 = arguments.next().map_or(Ok(10_000_000), |given| given.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |given| given.parse())?;
    let mut deframer = Deframer::new();
    let (mut syncs, mut versions, mut headers, mut beacons, mut sizes, mut messages) = (0, 0, 0, 0, 0, 0);
    for index in 0..panels {
        let bits = split_mix64(split_mix64(seed).wrapping_add(index.into()));
        match deframer.push(index, 0, &SoftPanel::certain(PanelFrame::from_bits(bits), 12)) {
            Event::Nothing | Event::Segment { .. } => {}
            Event::Rejected(_) => syncs += 1,
            Event::UnsupportedVersion(_) => versions += 1,
            Event::Header { .. } => headers += 1,
            Event::Beacon { .. } => beacons += 1,
            Event::Geometry(_) => sizes += 1,
            Event::Delivered(_) | Event::Signed(_) => messages += 1,
        }
    }
    println!(
        "{panels} random panels: {syncs} rejected (sync panels without header), {versions} headers of other versions, \
         {headers} headers, {beacons} beacons, {sizes} sizes, {messages} messages"
    );
    Ok(())
}
