//! The light sensor's loop, and the watchdog.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, Ticker};
use tx_firmware::{
    light_sensor::{LightSensor, PolledSensor},
    light_watch::{LightSample, SensorRange},
};

use crate::shared::{RingMatrix, Shared};

/// Interval between polls of the sensor.
const POLL: Duration = Duration::from_millis(20);

/// A watchdog's timeout on all boards: longer than any erase of a sector of the flash.
pub const WATCHDOG: Duration = Duration::from_secs(2);

/// Dims the panel to the light, and calls `feed` while `position`, the place in the ring of panels, advances. Run it at the lowest level,
/// so that the watchdog is fed only if all others run.
pub async fn follow<L: RawMutex, M: RingMatrix>(
    sensor: impl LightSensor,
    shared: &Shared<L, M>,
    position: impl Fn() -> usize,
    mut feed: impl FnMut(),
) -> ! {
    let mut sensor = PolledSensor::new(sensor);
    let mut ticks = Ticker::every(POLL);
    let mut seen = position();
    let mut seen_at = Instant::now();
    loop {
        ticks.next().await;
        let wanted = shared.with(|transmitter| transmitter.next_range());
        let sample = sensor.poll(Instant::now().as_millis(), wanted);
        match sample {
            Some((range, sample)) => take_reading(shared, range, sample),
            None => shared.with(|transmitter| {
                let Ok(_) = transmitter.watch(Instant::now().as_millis());
            }),
        }
        let present = position();
        if present != seen {
            seen = present;
            seen_at = Instant::now();
        }
        if seen_at.elapsed() < WATCHDOG {
            feed();
        }
    }
}

/// Processes a sensor's reading up to the duty; a separate function, so that its time can be measured.
#[inline(never)]
fn take_reading<L: RawMutex, M: RingMatrix>(shared: &Shared<L, M>, range: SensorRange, sample: LightSample) {
    let now_ms = Instant::now().as_millis();
    shared.with(|transmitter| {
        let Ok(_) = transmitter.sense(now_ms, range, sample);
    });
}
