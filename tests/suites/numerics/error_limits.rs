//! A table of the errors of all approximate functions in the workspace: their limits, and the results of dense sweeps.
//!
//! `cargo test -p vocc-tests --test numerics error_limits -- --nocapture` prints it. Limits are constants of the functions' modules, where
//! declared.

use std::path::Path;

use link::l2a_table::{L2A_ERROR_MAX, LOG2_ERROR_MAX};
use micromath::F32Ext;
use rx_pipeline::approximate::{CENSORED_LOSS_ERROR, INVERSE_SQRT_ERROR, ROOT_ERROR};
use sim::camera::encoder::CURVE_ERROR_GREY;
use sim::camera::noise::LAW_ERROR;
use sim::disc::kernel::CURVATURE;
use tx_firmware::ambient::FILTER_ERROR_OCTAVES;
use tx_firmware::dimming::{DUTY_ERROR, LUMINANCE_ERROR_CD_M2};
use tx_firmware::power::EXP2_ERROR;

use crate::disc_integral;
use crate::sweeps::*;

/// Kind of error.
enum Of {
    Absolute,
    Relative,
}

/// A row of the table.
struct Row {
    function: &'static str,
    range: &'static str,
    of: Of,
    limit: f64,
    measure: fn() -> f64,
    /// Where the limit does not apply, and which does.
    exceptions: &'static str,
}

const NONE: &str = "none";

/// Maximum ratio of a limit to the observed error; a looser limit would miss regressions.
const LOOSEST: f64 = 10.0;

/// Half a count of the shortest period: pulses of 13 counts instead of 13.5 lose this fraction of the 972 counts in the shortest exposure.
const HALF_COUNT: f64 = 0.5 / (972.0 * 13.0 / 13.5);

fn table() -> Vec<Row> {
    use Of::{Absolute, Relative};
    let row = |function, range, of, limit, measure, exceptions| Row {
        function,
        range,
        of,
        limit,
        measure,
        exceptions,
    };
    vec![
        row(
            "rx_pipeline::approximate::inverse_sqrt",
            "1e-37 to 1e38",
            Relative,
            INVERSE_SQRT_ERROR,
            of_inverse_sqrt,
            "0 and subnormals: finite",
        ),
        row(
            "rx_pipeline::approximate::root",
            "1e-6 to 1e6",
            Relative,
            ROOT_ERROR,
            of_root,
            "below 1e-6, NaN: √1e-6",
        ),
        row(
            "rx_pipeline::approximate::censored_loss",
            "−8 to 10, beyond 5 %",
            Absolute,
            CENSORED_LOSS_ERROR[0],
            of_censored_loss,
            "beyond 10: up to 14 % too little",
        ),
        row(
            "sim::camera::grey::GammaEncoder",
            "γ 1 to 4, all light",
            Absolute,
            CURVE_ERROR_GREY,
            of_encoder,
            NONE,
        ),
        row(
            "sim::disc::kernel::Exact, against 30 digits",
            "σ 0.001 to 50 px, light down to 1e-30",
            Relative,
            1e-11,
            disc_integral::edge_error,
            NONE,
        ),
        row(
            "sim::disc::kernel::KernelTables, 256 phases",
            "σ 1.5 px",
            Absolute,
            CURVATURE / (8.0 * 256.0 * 256.0 * 1.5 * 1.5) + 3e-7,
            of_tabulated,
            "beyond its reach: 0 or 1",
        ),
        row(
            "sim::disc::gauss::nodes, of a Gaussian",
            "panels of 5 σ",
            Absolute,
            5e-15,
            of_gauss,
            "9, 11, 14 σ: 8e-9, 7e-7, 8e-5",
        ),
        row(
            "sim::disc::chords::Chords::within(1e-4)",
            "discs of 0.3 to 30 px, σ 0.5 to 3 px",
            Absolute,
            1e-4,
            of_chords,
            "none where too many chords were needed",
        ),
        row(
            "sim::camera::noise::PixelNoise",
            "light 1e-4 to 20, ISO 100 to 32 000",
            Absolute,
            LAW_ERROR,
            of_noise,
            "over 65 000 electrons: a thirtieth of a grey level",
        ),
        row(
            "link::l2a_table::log2",
            "all illuminances",
            Absolute,
            LOG2_ERROR_MAX,
            of_log2,
            "of 0: as of 1/4096",
        ),
        row(
            "link::l2a_table::L2aTable::l2a",
            "the shipped table",
            Absolute,
            L2A_ERROR_MAX,
            of_l2a,
            "outside the axes: the edge's",
        ),
        row(
            "tx_firmware::power::exp2",
            "−32 to 32, beyond a step of 2⁻³²",
            Relative,
            EXP2_ERROR,
            of_exp2,
            NONE,
        ),
        row(
            "tx_firmware::ambient::Ambient, octaves",
            "T/τ of 1/1000 and more",
            Absolute,
            FILTER_ERROR_OCTAVES,
            of_ambient,
            "below 20 lx a step of 1/4096 lx shows",
        ),
        row(
            "tx_firmware::dimming, cd/m²",
            "0.01 to 130 000 lx",
            Absolute,
            LUMINANCE_ERROR_CD_M2,
            of_luminance,
            "above the top, below the floor: as stated",
        ),
        row(
            "tx_firmware::dimming, duty",
            "0.01 to 130 000 lx",
            Absolute,
            DUTY_ERROR,
            of_duty,
            "likewise",
        ),
        row(
            "tx_firmware::drive, duty of the pulses",
            "from the floor up, 125 MHz",
            Relative,
            HALF_COUNT,
            of_pulses,
            "below the floor: dimmer",
        ),
        row(
            "libm::expf",
            "−87 to 88",
            Relative,
            1.2e-7,
            || relative(-87.0, 88.0, libm::expf, f64::exp),
            NONE,
        ),
        row(
            "libm::sqrtf",
            "1e-37 to 1e38",
            Relative,
            6e-8,
            || logarithmic(1e-37, 1e38, libm::sqrtf, f64::sqrt),
            NONE,
        ),
        row("libm::powf, (g/118)^γ", "g 1 to 255, γ 1 to 4", Relative, 1.2e-7, of_powf, NONE),
    ]
}

#[test]
fn every_approximate_function_keeps_its_limit() {
    println!("| function | range | error | limit | measured | exceptions |\n|---|---|---|---|---|---|");
    for row in table() {
        let measured = (row.measure)();
        let of = match row.of {
            Of::Absolute => "absolute",
            Of::Relative => "relative",
        };
        println!(
            "| `{}` | {} | {of} | {:.1e} | {measured:.1e} | {} |",
            row.function, row.range, row.limit, row.exceptions
        );
        assert!(measured <= row.limit, "{}: {measured:e} > {:e}", row.function, row.limit);
        assert!(
            row.limit <= LOOSEST * measured,
            "{}: {:e} holds nothing: {measured:e} is measured",
            row.function,
            row.limit
        );
    }
}

/// micromath's functions in place of ours, with the limits that would apply.
fn micromath() -> [(&'static str, f64, f64); 5] {
    [
        (
            "invsqrt",
            INVERSE_SQRT_ERROR,
            logarithmic(1e-6, 1e6, F32Ext::invsqrt, |x| 1.0 / x.sqrt()),
        ),
        ("sqrt", ROOT_ERROR, logarithmic(1e-6, 1e6, F32Ext::sqrt, f64::sqrt)),
        ("powf(x, 1/2.2), grey levels", CURVE_ERROR_GREY, of_micromath_grey()),
        ("log2", LOG2_ERROR_MAX, of_micromath_log2()),
        ("exp", 1.2e-7, relative(-20.0, 20.0, F32Ext::exp, f64::exp)),
    ]
}

#[test]
fn micromath_runs_on_no_panel_and_in_no_receiver_because_it_keeps_no_limit() {
    println!("| micromath | limit | measured |\n|---|---|---|");
    for (function, limit, measured) in micromath() {
        println!("| `{function}` | {limit:.1e} | {measured:.1e} |");
        assert!(measured > limit, "{function} may be used: {measured:e} <= {limit:e}");
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for package in [
        "link",
        "tx-firmware",
        "tx-firmware/boards/embassy",
        "tx-firmware/boards/light_sensors",
        "tx-firmware/boards/nucleo-g474",
        "tx-firmware/boards/pico",
        "rx-pipeline",
        "rx-pipeline/boards/mps2-an500",
        "rx-pipeline/boards/pico",
    ] {
        let manifest = root.join(package).join("Cargo.toml");
        let text = std::fs::read_to_string(&manifest).expect("a manifest");
        assert!(!text.contains("micromath"), "{}", manifest.display());
    }
}
