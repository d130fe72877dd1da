//! Renders the view of an HM01B0: `hm01b0_eye [SCENE [key=value]…]`.
//!
//! Reads JSON requests, one per line, from standard input ([`vocc_tests::hm01b0::Request`]); answers a frame with its pixels, one byte
//! each, on standard output. Exits with an error at the first invalid request.

use std::error::Error;
use std::io::{Write, stdin, stdout};

use vocc_tests::hm01b0::{Eye, Request};

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let scene = words.next().unwrap_or_else(|| "hm01b0".into());
    let mut eye = Eye::new(&scene, &words.collect::<Vec<_>>())?;
    for line in stdin().lines() {
        match serde_json::from_str(&line?)? {
            Request::Scene(changes) => eye.change(&changes)?,
            Request::Frame(frame) => {
                let mut out = stdout().lock();
                out.write_all(&eye.see(&frame)?)?;
                out.flush()?;
            }
        }
    }
    Ok(())
}
