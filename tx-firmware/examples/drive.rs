//! What the pulses of the dimming cost in accuracy, at each light and the exposure that a camera takes there.

use tx_firmware::calibration::SWITCHED;
use tx_firmware::dimming::Duty;
use tx_firmware::drive::{Drive, Pulses, exposure_ns};

const CLOCK_HZ: u32 = 125_000_000;
const REFLECTANCE: f64 = 0.4;
const L2A_MOST: f64 = 4.0;

fn main() {
    let drive = Drive::new(&SWITCHED, CLOCK_HZ);
    println!("  full, cd/m²      L2A        lx  exposure    duty, %    PWM, kHz  ripple, %  step, %  current");
    for full_lx in [16_000, 100_000] {
        let full_cd_m2 = L2A_MOST * f64::from(full_lx) * REFLECTANCE;
        for l2a in [1.0, 2.0, 4.0] {
            for lx in [50, 200, 1_000, 4_000, 16_000, 40_000, 100_000] {
                let duty = l2a * f64::from(lx) * REFLECTANCE / full_cd_m2;
                if duty > 1.0 {
                    continue;
                }
                let pulses = drive.pulses(Duty::saturating_from_num(duty), Pulses::default());
                let given = pulses.duty(SWITCHED.low_current_share).to_num::<f64>();
                println!(
                    "{full_cd_m2:>13.0} {l2a:>8} {lx:>9}    1/{:<4.0} {:>11.4} {:>11.1} {:>10.2} {:>8.3}  {}",
                    1e9 / f64::from(exposure_ns(lx)),
                    100.0 * given,
                    f64::from(CLOCK_HZ) / 1e3 / f64::from(pulses.period),
                    f64::from(pulses.ripple_ppm(exposure_ns(lx), CLOCK_HZ)) / 1e4,
                    f64::from(pulses.step_ppm()) / 1e4,
                    if pulses.low_current { "low" } else { "full" },
                );
            }
        }
    }
}
