//! `import vocc`: the simulator and the receiver for Python.
//!
//! A thin layer over the same libraries as the command line, without physics or signal processing of its own. Each file has the name of the
//! command that does the same. Classes and functions are documented in Python, where their examples run as tests.
//!
//! Long calls release the GIL, respond to Ctrl-C, and start only the threads that the caller asks for: see `work`. Arrays are borrowed on
//! input and moved on output, never copied.

mod arrays;
mod camera;
mod decode;
mod errors;
mod evaluate;
mod frames;
mod optimize;
mod pose;
mod receiver;
mod record;
mod render;
mod scene;
mod table;
mod transmit;
mod work;

/// The native part of the package `vocc`.
#[pyo3::pymodule(name = "_vocc")]
mod native {
    use pyo3::prelude::*;

    /// The version of the package.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }

    #[pymodule_export]
    use crate::camera::{Camera, LearntCamera};
    #[pymodule_export]
    use crate::decode::{Decoded, decode};
    #[pymodule_export]
    use crate::errors::VoccError;
    #[pymodule_export]
    use crate::evaluate::{DetectorInput, Evaluation, evaluate};
    #[pymodule_export]
    use crate::frames::{Batch, Frame, Frames, frames};
    #[pymodule_export]
    use crate::optimize::{Optimization, Optimum, TableEntry, optimize};
    #[pymodule_export]
    use crate::pose::Pose;
    #[pymodule_export]
    use crate::receiver::{Loss, Message, Proof, Reading, Received, Receiver, Status};
    #[pymodule_export]
    use crate::render::{Renderer, render};
    #[pymodule_export]
    use crate::scene::{Decision, Scene};
    #[pymodule_export]
    use crate::table::Table;
    #[pymodule_export]
    use crate::transmit::{Flicker, as_bits, as_hex, flicker, transmit};
}
