//! Plots the error of a variance over the offset: `cargo run -p vocc-tests --example offset_sweep` writes `docs/numerics/offset_sweep.svg`.

mod plot;

use std::error::Error;
use std::path::Path;

use plotters::prelude::*;
use studies::statistics::Moments;
use vocc_tests::naive;
use vocc_tests::offset::{values_about, variance};

use plot::{FONT, key, legend, svg, titled};

const SIZE: (u32, u32) = (900, 460);
/// Value at which zero error is drawn.
const LEAST: f64 = 1e-17;
/// Maximum error drawn.
const MOST: f64 = 1e12;

/// A variance algorithm: name, colour (Okabe & Ito 2008), and error at an offset.
struct Way {
    name: &'static str,
    colour: RGBColor,
    error: fn(f64) -> f64,
}

fn relative(got: f64) -> f64 {
    (got / variance() - 1.0).abs()
}

const WAYS: [Way; 3] = [
    Way {
        name: "E x² − (E x)²",
        colour: RGBColor(213, 94, 0),
        error: |offset| relative(naive::variance_by_squares(values_about(offset)).1),
    },
    Way {
        name: "Welford's updates, not shifted",
        colour: RGBColor(0, 114, 178),
        error: |offset| relative(naive::variance_unshifted(values_about(offset)).1),
    },
    Way {
        name: "Welford's updates about the first value (ours)",
        colour: RGBColor(0, 158, 115),
        error: |offset| {
            let mut moments = Moments::default();
            values_about(offset).for_each(|x| moments.push([x, 0.0]));
            relative(moments.covariance()[0][0])
        },
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/numerics/offset_sweep.svg");
    std::fs::write(&path, drawing()?)?;
    println!("{}", path.display());
    Ok(())
}

fn drawing() -> Result<String, Box<dyn Error>> {
    svg(SIZE, |surface| {
        let mut chart = titled(surface, "Error of the variance of 1000 values about an offset")
            .build_cartesian_2d(0..40i32, (LEAST..MOST).log_scale())?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .label_style((FONT, 13))
            .x_desc("offset, as a power of two; the spread is 1")
            .y_desc("relative error")
            .y_label_formatter(&|error| format!("{error:.0e}"))
            .draw()?;
        for Way { name, colour, error } in &WAYS {
            let at = |k: i32| (k, error(f64::from(k).exp2()).clamp(LEAST, MOST));
            chart
                .draw_series(LineSeries::new((0..=40).map(at), colour.stroke_width(2)).point_size(3))?
                .label(*name)
                .legend(key(*colour));
        }
        legend(&mut chart, SeriesLabelPosition::UpperLeft)
    })
}
