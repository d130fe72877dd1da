//! The transmitter's control path in fixed point: light → ratio → luminance → duty → pulses, over the full range of its types.

use fixed::types::{I32F32, U1F31, U12F20, U32F32};
use link::l2a_table::{AXIS_STEP_MIN_LOG2, Illuminance, Interval, L2A_ERROR_MAX, L2a, L2aTable, log2};
use link::serial::Measured;
use micromath::F32Ext;
use tx_firmware::ambient::{Ambient, BRIGHTEST_LX, DARKEST_LX, Smoothing};
use tx_firmware::calibration::{BENCH, Calibration, LOW_CURRENT_SHARE, LUMINANCE_CD_M2, PWM_PERIOD_NS, REFLECTANCE, SENSOR_GAIN, SWITCHED};
use tx_firmware::dimming::{DUTY_ERROR, Dimming, Duty, L2A_MAX, LUMINANCE_ERROR_CD_M2, duty_cycle};
use tx_firmware::drive::{Drive, Pulses};

fn calibration(measured: Measured) -> Calibration {
    Calibration::new(measured).expect("a panel")
}

/// All calibrations with values at the ends of their ranges.
fn corner_calibrations() -> impl Iterator<Item = Calibration> {
    let ends = |k: usize, bit: usize| k >> bit & 1 == 1;
    (0..32).map(move |k| {
        let pick = |bit: usize, range: [u32; 2]| range[usize::from(ends(k, bit))];
        let pwm_period_ns = pick(0, [*PWM_PERIOD_NS.start(), *PWM_PERIOD_NS.end()]);
        let end = |bit: usize, low: u64, high: u64| if ends(k, bit) { high } else { low };
        let share = |bit, range: &std::ops::RangeInclusive<U1F31>| {
            let bits = end(bit, range.start().to_bits().into(), range.end().to_bits().into());
            U1F31::from_bits(bits as u32)
        };
        let luminance = [LUMINANCE_CD_M2.start(), LUMINANCE_CD_M2.end()].map(|l| l.to_bits());
        calibration(Measured {
            luminance_full_cd_m2: U32F32::from_bits(end(1, luminance[0], luminance[1])),
            shortest_pulse_ns: pick(2, [0, pwm_period_ns]),
            pwm_period_ns,
            reflectance: share(3, &REFLECTANCE),
            low_current_share: share(4, &LOW_CURRENT_SHARE),
            ..BENCH
        })
    })
}

/// Every intermediate value is a product or a quotient of non-negative factors, and so monotone in each: its maximum is at a corner of the
/// input ranges. There, builds other than `--release` check every operation for overflow.
#[test]
fn nothing_overflows_at_any_corner_of_the_declared_ranges() {
    // The product for the luminance, at the types' full precision, exceeds 64 bits.
    let product = u64::from(L2A_MAX.to_bits()).checked_mul(BRIGHTEST_LX.to_bits().into());
    let product = product.and_then(|bits| bits.checked_mul(U1F31::ONE.to_bits().into()));
    assert_eq!(product, None);
    let lights = [0, 1, DARKEST_LX.to_bits(), BRIGHTEST_LX.to_bits(), u32::MAX];
    let ratios = [0, 1, 1638, L2A_MAX.to_bits(), u16::MAX];
    for calibration in corner_calibrations() {
        let full = calibration.measured().luminance_full_cd_m2;
        for light in lights.map(Illuminance::from_bits) {
            for ratio in ratios.map(L2a::from_bits) {
                let dimming = Dimming::new(ratio, light, &calibration);
                assert!(dimming.luminance_cd_m2 <= full, "{dimming:?}");
                for clock_hz in [0, 1, 125_000_000, u32::MAX] {
                    let drive = Drive::new(calibration.measured(), clock_hz);
                    for low_current in [false, true] {
                        let before = Pulses {
                            low_current,
                            ..Pulses::default()
                        };
                        let pulses = drive.pulses(dimming.duty, before);
                        assert!(pulses.lit <= pulses.period, "{pulses:?}");
                        pulses.duty(calibration.measured().low_current_share);
                        pulses.ripple_ppm(u32::MAX, clock_hz);
                    }
                }
                for steps in [0, 1, u16::MAX] {
                    assert!(duty_cycle(dimming.duty, steps) <= steps);
                }
            }
        }
    }
    for gain in [*SENSOR_GAIN.start(), *SENSOR_GAIN.end(), U12F20::MAX, U12F20::ZERO] {
        for times in [[0; 4], [1, 0, 0, 0], [1, u16::MAX, u16::MAX, u16::MAX], [u16::MAX; 4]] {
            let [sample_period_ms, darker_ms, brighter_ms, still_ms] = times;
            let smoothing = Smoothing {
                sample_period_ms,
                darker_ms,
                brighter_ms,
                still_ms,
            };
            let mut ambient = Ambient::new(gain, smoothing);
            for reading in [I32F32::MIN, I32F32::MAX, I32F32::ZERO, I32F32::DELTA, I32F32::MAX] {
                let light = ambient.sense(reading);
                assert!((DARKEST_LX..=BRIGHTEST_LX).contains(&light), "{light}");
            }
        }
    }
    for interval in [Interval::ZERO, Interval::DELTA, Interval::MAX] {
        for light in lights.map(Illuminance::from_bits) {
            let ratio = L2aTable::shipped().l2a(light, interval).to_num::<f64>();
            assert!((0.2..=4.0).contains(&ratio), "{ratio}");
        }
    }
}

/// The logarithm's integer steps at the largest and smallest mantissa: 31 fractional bits, squared, fit 64 bits.
#[test]
fn the_logarithm_is_right_at_every_power_of_two_and_never_falls() {
    let mut naive_worst = 0.0f64;
    let mut last = log2(Illuminance::from_bits(1));
    let near = (0..32).flat_map(|bit| (-300i64..=300).map(move |step| (1i64 << bit) + step));
    let dense = (0..200_000).map(|k| (f64::from(k) * 32.0 / 200_000.0).exp2() as i64);
    let mut places: Vec<u32> = near.chain(dense).filter_map(|n| u32::try_from(n).ok()).collect();
    places.retain(|&bits| bits > 0);
    places.push(u32::MAX);
    places.sort_unstable();
    for bits in places {
        let light = Illuminance::from_bits(bits);
        let ours = log2(light);
        let exact = light.to_num::<f64>().log2();
        let error = (ours.to_num::<f64>() - exact).abs();
        assert!(error <= link::l2a_table::LOG2_ERROR_MAX, "{light}: {error:e}");
        assert!(ours >= last, "{light}");
        last = ours;
        naive_worst = naive_worst.max((f64::from(F32Ext::log2(light.to_num::<f32>())) - exact).abs());
    }
    assert!(naive_worst > 1000.0 * link::l2a_table::LOG2_ERROR_MAX, "{naive_worst}");
}

/// Extreme tables: the closest axes, values at both ends of the range, and the shipped one.
fn tables() -> [L2aTable; 3] {
    let close = 1.05 * f64::from(AXIS_STEP_MIN_LOG2);
    let axis = |from: f64, count: usize| -> Vec<f32> { (0..count).map(|k| (from * (close * k as f64).exp2()) as f32).collect() };
    let values = |count: usize| -> Vec<f32> { (0..count).map(|k| if k % 3 == 0 { 4.0 } else { 0.2 }).collect() };
    let far = [0.01f32, 1.0, 50.0, 1e6];
    [
        L2aTable::shipped(),
        L2aTable::new(&axis(3000.0, 16), &axis(8.0, 8), &values(128)).expect("a table"),
        L2aTable::new(&far, &[0.05, 15.0], &values(8)).expect("a table"),
    ]
}

/// Position of a value between the logarithms of an axis: the lower entry, and the fraction towards the next.
fn place(axis: &[f64], value: f64) -> (usize, f64) {
    let value = value.clamp(axis[0], axis[axis.len() - 1]);
    let below = axis.partition_point(|&node| node <= value).saturating_sub(1).min(axis.len() - 2);
    (below, (value / axis[below]).log2() / (axis[below + 1] / axis[below]).log2())
}

/// Bilinear interpolation in the logarithms, in doubles.
pub fn exact_ratio(table: &L2aTable, light: Illuminance, interval: Interval) -> f64 {
    let rows: Vec<f64> = table.illuminances_lx().iter().map(|lx| lx.to_num()).collect();
    let columns: Vec<f64> = table.intervals().iter().map(|i| i.to_num()).collect();
    let ((row, down), (column, across)) = (place(&rows, light.to_num()), place(&columns, interval.to_num()));
    let value = |r: usize, c: usize| table.values()[r * columns.len() + c].to_num::<f64>();
    let along = |r: usize| value(r, column) + across * (value(r, column + 1) - value(r, column));
    along(row) + down * (along(row + 1) - along(row))
}

#[test]
fn the_ratio_is_exact_at_every_node_of_a_table_and_within_its_bound_between() {
    let mut naive_worst = 0.0f64;
    for table in tables() {
        let (lights, intervals) = (table.illuminances_lx(), table.intervals());
        for (row, &light) in lights.iter().enumerate() {
            for (column, &interval) in intervals.iter().enumerate() {
                let value = table.values()[row * intervals.len() + column];
                assert_eq!(table.l2a(light, interval), value, "at {light} lx, {interval}");
            }
        }
        let between = |from: f64, to: f64, k: u32| from * (to / from).powf(f64::from(k) / 40.0);
        for rows in lights.windows(2) {
            for columns in intervals.windows(2) {
                for k in 0..=40 {
                    let lx = between(rows[0].to_num(), rows[1].to_num(), k);
                    for l in 0..=40 {
                        let i = between(columns[0].to_num(), columns[1].to_num(), l);
                        let (light, interval) = (Illuminance::from_num(lx), Interval::from_num(i));
                        let ratio = table.l2a(light, interval).to_num::<f64>();
                        let error = (ratio - exact_ratio(&table, light, interval)).abs();
                        assert!(error <= L2A_ERROR_MAX, "at {light} lx, {interval}: {error:e}");
                        naive_worst = naive_worst.max(by_micromath(&table, light, rows));
                    }
                }
            }
        }
    }
    assert!(naive_worst > 100.0 * L2A_ERROR_MAX, "{naive_worst}");
}

/// Error of the ratio between two rows with `micromath`'s logarithm, at most the table's range.
fn by_micromath(table: &L2aTable, light: Illuminance, rows: &[Illuminance]) -> f64 {
    let logs = [rows[0], light, rows[1]].map(|lx| f64::from(F32Ext::log2(lx.to_num::<f32>())));
    let share = (logs[1] - logs[0]) / (logs[2] - logs[0]);
    let (_, exact) = place(&[rows[0].to_num(), rows[1].to_num()], light.to_num());
    let most = table.values().into_iter().max();
    let range = most.map_or(0.0, |most| most.to_num::<f64>());
    range * (share - exact).abs().min(1.0)
}

/// Illuminances over the whole range: every step in the dark, then increasing steps, and every value near a node.
fn lights(nodes: &[Illuminance]) -> Vec<Illuminance> {
    let (dark, bright) = (DARKEST_LX.to_bits(), BRIGHTEST_LX.to_bits());
    let octaves = (f64::from(bright) / f64::from(dark)).log2();
    let dense = (0..60_000u32).map(|k| (f64::from(dark) * (octaves * f64::from(k) / 60_000.0).exp2()) as u32);
    let beside = nodes.iter().flat_map(|node| {
        let at = node.to_bits();
        at.saturating_sub(500)..at.saturating_add(500)
    });
    let mut bits: Vec<u32> = dense.chain(beside).chain(dark..dark + 20_000).collect();
    // Each value and its successor.
    bits.extend(bits.clone().into_iter().map(|bits| bits + 1));
    bits.sort_unstable();
    bits.dedup();
    bits.retain(|bits| (dark..=bright).contains(bits));
    bits.into_iter().map(Illuminance::from_bits).collect()
}

#[test]
fn more_light_never_gives_less_luminance_but_for_one_step() {
    let table = L2aTable::shipped();
    let calibration = calibration(SWITCHED);
    let reflectance = SWITCHED.reflectance.to_num::<f64>();
    let drive = Drive::new(&SWITCHED, 125_000_000);
    let mut naive_falls = 0;
    for interval in ["0.5", "0.77", "1", "1.5", "2", "3"].map(|text| text.parse().expect("an interval")) {
        let mut last = (0.0, 0.0, Pulses::default());
        let mut naive_last = 0.0;
        for light in lights(&table.illuminances_lx()) {
            let dimming = Dimming::new(table.l2a(light, interval), light, &calibration);
            let luminance = dimming.luminance_cd_m2.to_num::<f64>();
            // One step of the ratio, 2⁻¹³.
            let step = light.to_num::<f64>() * reflectance / 8192.0;
            assert!(luminance >= last.0 - step, "{light} lx: {luminance} after {}", last.0);
            let pulses = drive.pulses(dimming.duty, last.2);
            let given = pulses.duty(SWITCHED.low_current_share).to_num::<f64>();
            let rounding = 1e-6 * f64::from(pulses.step_ppm() + last.2.step_ppm());
            let step = step / 26_000.0 + given * rounding;
            assert!(given >= last.1 - step, "{light} lx: {given} after {}", last.1);
            last = (luminance, given, pulses);
            // Nearest entry instead of interpolation.
            let nearest = table.illuminances_lx().into_iter().min_by_key(|node| node.abs_diff(light));
            let ratio = table.l2a(nearest.expect("a node"), interval);
            let naive = Dimming::new(ratio, light, &calibration).luminance_cd_m2.to_num::<f64>();
            naive_falls += usize::from(naive < naive_last - 2.0 * light.to_num::<f64>() * reflectance / 8192.0);
            naive_last = naive;
        }
    }
    assert!(naive_falls >= 6, "{naive_falls}");
}

#[test]
fn luminance_and_duty_keep_their_bounds_at_every_node_and_between() {
    let table = L2aTable::shipped();
    let calibration = calibration(BENCH);
    let floor = calibration.luminance_floor_cd_m2().to_num::<f64>();
    for light in lights(&table.illuminances_lx()).into_iter().step_by(7) {
        for interval in [Interval::lit("0.5"), Interval::lit("1.2"), Interval::lit("2")] {
            let ratio = table.l2a(light, interval);
            let dimming = Dimming::new(ratio, light, &calibration);
            let exact = ratio.to_num::<f64>() * light.to_num::<f64>() * BENCH.reflectance.to_num::<f64>();
            let error = (dimming.wanted_cd_m2.to_num::<f64>() - exact).abs();
            assert!(error <= LUMINANCE_ERROR_CD_M2 + exact * 1e-15, "{light} lx: {error:e}");
            if exact > floor && exact < 26_000.0 {
                let error = (dimming.duty.to_num::<f64>() - exact / 26_000.0).abs();
                assert!(error <= DUTY_ERROR, "{light} lx: {error:e}");
            }
        }
    }
    // A duty of 12 bits at night: its half step of 26 000/4096 cd/m² exceeds the required 1.3 cd/m².
    let dim = Duty::from_num(1.3 / 26_000.0);
    assert_eq!((dim.to_num::<f64>() * 4096.0).round(), 0.0);
    assert!((dim.to_num::<f64>() * 26_000.0 - 1.3).abs() < 1e-5);
}
