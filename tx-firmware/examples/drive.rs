//! What the pulses of the dimming cost in accuracy, at each light and the exposure that a camera takes there.

use fixed::types::U0F32;
use tx_firmware::drive::{
    Drive, EXPOSURE_LONG_NS, EXPOSURE_SHORT_NS, Limits, LowCurrent, Pulses, exposure_ns,
};

const CLOCK_HZ: u32 = 125_000_000;
const REFLECTANCE: f64 = 0.4;
const L2A_MOST: f64 = 4.0;
const LOW_CURRENT: U0F32 = U0F32::lit("0.125");

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let drive = Drive::new(Limits {
        clock_hz: CLOCK_HZ,
        shortest_pulse_ns: 100,
        longest_exposure_ns: EXPOSURE_LONG_NS,
        shortest_exposure_ns: EXPOSURE_SHORT_NS,
        low_current: LowCurrent::Share(LOW_CURRENT),
    })?;
    println!(
        "    full, cd/m²      L2A        lx   exposure    duty, %       PWM, kHz   ripple, %   step, %   low current"
    );
    for full_lx in [16_000, 100_000] {
        let full_cd_m2 = L2A_MOST * f64::from(full_lx) * REFLECTANCE;
        for l2a in [1.0, 2.0, 4.0] {
            for lx in [50, 200, 1_000, 4_000, 16_000, 40_000, 100_000] {
                let duty = l2a * f64::from(lx) * REFLECTANCE / full_cd_m2;
                if duty > 1.0 {
                    continue;
                }
                let pulses = drive.pulses(U0F32::saturating_from_num(duty), Pulses::default());
                println!(
                    "{full_cd_m2:>15.0} {l2a:>8} {lx:>9}   1/{:<6.0} {:>10.4} {:>14.1} {:>11.2} {:>9.3}   {}",
                    1e9 / f64::from(exposure_ns(lx)),
                    100.0 * pulses.duty(LowCurrent::Share(LOW_CURRENT)).to_num::<f64>(),
                    f64::from(CLOCK_HZ) / 1e3 / f64::from(pulses.period),
                    f64::from(pulses.ripple_ppm(exposure_ns(lx), CLOCK_HZ)) / 1e4,
                    f64::from(pulses.step_ppm()) / 1e4,
                    if pulses.low_current { "yes" } else { "" },
                );
            }
        }
    }
    Ok(())
}
