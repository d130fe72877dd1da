//! Dense sweeps that measure the errors of the approximate functions in [`crate::error_limits`].

use fixed::types::{I6F26, I32F32, U12F20};
use glam::{DMat2, DVec2};
use libm::{erf, erfc};
use link::l2a_table::{Illuminance, Interval, L2aTable, log2};
use micromath::F32Ext;
use rx_pipeline::approximate::{CENSORED_LOSS_ERROR, ROOT_MIN, censored_loss, inverse_sqrt, root};
use sim::camera::curve::Curve;
use sim::camera::exposure::Exposure;
use sim::camera::grey::{self, GammaEncoder};
use sim::camera::noise::{Noise, PixelNoise};
use sim::disc::chords::Chords;
use sim::disc::gauss;
use sim::disc::kernel::{Exact, Kernel, KernelTables};
use sim::disc::outline::Outline;
use sim::scene::Scene;
use tx_firmware::ambient::{Ambient, Smoothing};
use tx_firmware::calibration::{BENCH, Calibration};
use tx_firmware::dimming::{Dimming, Duty};
use tx_firmware::drive::{Drive, Pulses};
use tx_firmware::power::exp2;

/// The maximum error; NaN is the largest.
fn worst(errors: impl IntoIterator<Item = f64>) -> f64 {
    errors.into_iter().fold(
        0.0,
        |worst: f64, error| {
            if error.is_nan() { f64::INFINITY } else { worst.max(error) }
        },
    )
}

const STEPS: u32 = 300_000;

/// Maximum relative error of an f32 function over equal steps.
pub fn relative(from: f64, to: f64, ours: impl Fn(f32) -> f32, exact: impl Fn(f64) -> f64) -> f64 {
    worst((0..=STEPS).map(|k| {
        let x = (from + (to - from) * f64::from(k) / f64::from(STEPS)) as f32;
        (f64::from(ours(x)) / exact(x.into()) - 1.0).abs()
    }))
}

/// Maximum relative error over equal steps of the logarithm.
pub fn logarithmic(from: f64, to: f64, ours: impl Fn(f32) -> f32, exact: impl Fn(f64) -> f64) -> f64 {
    worst((0..=STEPS).map(|k| {
        let x = (from * (to / from).powf(f64::from(k) / f64::from(STEPS))) as f32;
        (f64::from(ours(x)) / exact(x.into()) - 1.0).abs()
    }))
}

pub fn of_inverse_sqrt() -> f64 {
    logarithmic(1.2e-37, 3e38, inverse_sqrt, |x| 1.0 / x.sqrt())
}

pub fn of_root() -> f64 {
    logarithmic(ROOT_MIN.into(), 1e6, root, f64::sqrt)
}

pub fn of_censored_loss() -> f64 {
    worst((0..=18_000).map(|k| {
        let t = -8.0 + f64::from(k) / 1000.0;
        let exact = -(0.5 * erfc(t * std::f64::consts::FRAC_1_SQRT_2)).ln();
        (f64::from(censored_loss(t as f32)) - exact).abs() - CENSORED_LOSS_ERROR[1] * exact
    }))
}

pub fn of_encoder() -> f64 {
    worst([1.0, 1.3, 1.8, 2.2, 2.4, 3.1, 4.0].map(|gamma| {
        let encoder = GammaEncoder::new(gamma);
        let lights = (1e-30f32.to_bits()..1e5f32.to_bits()).step_by(9973).map(f32::from_bits);
        worst(lights.map(|x| (f64::from(encoder.unrounded(x)) - grey::unrounded(x.into(), gamma)).abs()))
    }))
}

pub fn of_tabulated() -> f64 {
    let exact = Exact::new(1.5);
    let table = KernelTables::new(1.5, 12.0, 256);
    worst((0..4000).flat_map(|k| {
        let first = -14.0 + f64::from(k) * 0.002_237;
        let (mut bells, mut steps) = ([0.0; 28], [0.0; 28]);
        table.add_bells(first, 1.0, &mut bells);
        table.add_steps(first, 1.0, &mut steps);
        let pairs = bells.into_iter().zip(steps).enumerate();
        pairs
            .map(|(i, (bell, step))| {
                let s = first + i as f64;
                let bell = (f64::from(bell) - exact.bell(s)).abs();
                bell.max((f64::from(step) - exact.step(s)).abs())
            })
            .collect::<Vec<_>>()
    }))
}

pub fn of_gauss() -> f64 {
    let density = |z: f64| (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    worst((0..2000).map(|k| {
        let from = -7.5 + f64::from(k) * 0.005;
        let sum: f64 = gauss::nodes(from, from + 5.0).map(|(z, weight)| weight * density(z)).sum();
        let below = |z: f64| 0.5 * erf(z * std::f64::consts::FRAC_1_SQRT_2);
        (sum - (below(from + 5.0) - below(from))).abs()
    }))
}

pub fn of_chords() -> f64 {
    worst([0.3, 1.1, 4.0, 30.0].into_iter().flat_map(|radius| {
        [0.5, 1.5, 3.0].map(|sigma| {
            let outline = Outline::Ellipse(DMat2::from_diagonal(DVec2::splat(radius)));
            let Some(chords) = Chords::within(&outline, sigma, 1e-4) else {
                return 0.0;
            };
            let kernel = Exact::new(sigma);
            let reach = radius + 2.0 * sigma;
            worst((0..400).map(|k| {
                let fraction = |step: f64| (f64::from(k) * step).fract() * 2.0 - 1.0;
                let at = reach * DVec2::new(fraction(0.618_034), fraction(0.754_878));
                (chords.light(&kernel, at) - outline.light(sigma, at)).abs()
            }))
        })
    }))
}

pub fn of_noise() -> f64 {
    worst(["20000", "500", "50"].map(|illuminance| {
        let scene = Scene::load("paper", &[format!("ambient.illuminance_lx={illuminance}")]).expect("a scene");
        let noise = Noise::new(&scene, &Exposure::of(&scene), Curve::of(&scene.camera));
        let pixels = PixelNoise::new(&noise);
        worst((0..60).map(|k| {
            let light = (1e-4 * 2e5f64.powf(f64::from(k) / 60.0)) as f32;
            let laws = pixels.distribution(light).into_iter().zip(noise.distribution(light.into()));
            laws.map(|(drawn, exact)| (drawn - exact).abs()).sum::<f64>() / 2.0
        }))
    }))
}

pub fn of_log2() -> f64 {
    worst((0..STEPS).map(|k| {
        let light = Illuminance::from_bits((f64::from(k) * 32.0 / f64::from(STEPS)).exp2() as u32);
        (log2(light).to_num::<f64>() - light.to_num::<f64>().log2()).abs()
    }))
}

pub fn of_l2a() -> f64 {
    let table = L2aTable::shipped();
    worst((0..200_000).map(|k| {
        let share = f64::from(k) / 200_000.0;
        let light = Illuminance::from_num(50.0 * 320f64.powf(share));
        let interval = Interval::from_num(0.5 + 1.5 * (f64::from(k) * 0.618_034).fract());
        (table.l2a(light, interval).to_num::<f64>() - crate::control::exact_ratio(&table, light, interval)).abs()
    }))
}

pub fn of_exp2() -> f64 {
    worst((i32::MIN..i32::MAX).step_by(10_007).map(|bits| {
        let y = I6F26::from_bits(bits);
        let exact = y.to_num::<f64>().exp2();
        let step = 1.0 / (1u64 << 32) as f64;
        ((exp2(y).to_num::<f64>() - exact).abs() - step) / exact
    }))
}

/// A step of the ambient light by the module's formula, at illuminances well above the type's step.
pub fn of_ambient() -> f64 {
    let cases = [(100u16, 100u16), (100, 10_000), (10, 10_000), (1000, 1000), (7, 3000)];
    worst(cases.into_iter().flat_map(|(sample_period_ms, time_ms)| {
        let smoothing = Smoothing {
            sample_period_ms,
            darker_ms: time_ms,
            brighter_ms: time_ms,
            still_ms: time_ms,
        };
        [(100_000u32, 200u32), (200, 100_000), (30_000, 29_000)].map(|(from, to)| {
            let mut ambient = Ambient::new(U12F20::ONE, smoothing);
            ambient.sense(I32F32::from_num(from));
            let decay = (-f64::from(sample_period_ms) / f64::from(time_ms)).exp();
            worst((1..=60).map(|reading| {
                let light = ambient.sense(I32F32::from_num(to)).to_num::<f64>();
                let exact = f64::from(to).log2() + (f64::from(from) / f64::from(to)).log2() * decay.powi(reading);
                // Subtracts half a step of the result, the type's rounding.
                (light.log2() - exact).abs() - (0.5 / 4096.0 / light) / std::f64::consts::LN_2
            }))
        })
    }))
}

/// Dimmings at the ratio 2, and their luminance in doubles.
fn dimmings() -> impl Iterator<Item = (Dimming, f64)> {
    let calibration = Calibration::new(BENCH).expect("a panel");
    (0..200_000).map(move |k| {
        let light = Illuminance::from_num(0.01 * 1.3e7f64.powf(f64::from(k) / 200_000.0));
        let dimming = Dimming::new(link::l2a_table::L2a::lit("2.1"), light, &calibration);
        let exact = dimming.l2a.to_num::<f64>() * light.to_num::<f64>() * BENCH.reflectance.to_num::<f64>();
        (dimming, exact)
    })
}

pub fn of_luminance() -> f64 {
    worst(dimmings().map(|(dimming, exact)| (dimming.wanted_cd_m2.to_num::<f64>() - exact).abs()))
}

pub fn of_duty() -> f64 {
    let unlimited = dimmings().filter(|(dimming, _)| dimming.limited.is_none());
    worst(unlimited.map(|(dimming, exact)| (dimming.duty.to_num::<f64>() - exact / 26_000.0).abs()))
}

pub fn of_pulses() -> f64 {
    let drive = Drive::new(&BENCH, 125_000_000);
    let floor = drive.floor_at_full_current().to_num::<f64>();
    worst((0..STEPS).map(|k| {
        let duty = Duty::saturating_from_num(1.001 * floor * (1.0 / floor).powf(f64::from(k) / f64::from(STEPS)));
        let given = drive.pulses(duty, Pulses::default()).duty(BENCH.low_current_share);
        (given.to_num::<f64>() / duty.to_num::<f64>() - 1.0).abs()
    }))
}

pub fn of_powf() -> f64 {
    worst((1..=255u8).flat_map(|level| {
        [1.0f32, 1.8, 2.2, 4.0].map(|gamma| {
            let x = f32::from(level) / 118.0;
            (f64::from(libm::powf(x, gamma)) / f64::from(x).powf(gamma.into()) - 1.0).abs()
        })
    }))
}

pub fn of_micromath_grey() -> f64 {
    worst((0..STEPS).map(|k| {
        let light = (1e-6 * 6e6f64.powf(f64::from(k) / f64::from(STEPS))) as f32;
        let ours = f64::from(118.0 * F32Ext::powf(light, 1.0 / 2.2)).min(255.0);
        (ours - grey::unrounded(light.into(), 2.2)).abs()
    }))
}

pub fn of_micromath_log2() -> f64 {
    worst((0..STEPS).map(|k| {
        let light = (0.01 * 1.3e7f64.powf(f64::from(k) / f64::from(STEPS))) as f32;
        (f64::from(F32Ext::log2(light)) - f64::from(light).log2()).abs()
    }))
}
