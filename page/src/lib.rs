//! The link in a browser: the page's requests to simulator and receiver, and their answers.
//!
//! ```
//! use page::Page;
//! let mut page = Page::default();
//! let answer = page.ask(r#"{"do": "open", "scene": {"name": "day", "set": ["pose.distance_m=30"]}}"#, &[])?;
//! assert!(answer.contains("pitch_px"));
//! page.frame(0)?;
//! assert_eq!(page.sight().kmeans, page.sight().sent);
//! # Ok::<(), page::Fault>(())
//! ```
//!
//! # Layers
//!
//! ```text
//! exports                             WebAssembly's exports to JavaScript: the only place with `unsafe`
//! ask                                 requests and answers, as JSON
//! explore   compare   count   curve   a scene's frames · error against time · bit error rates · the same over L2A
//! send      decode    receive         a message over the road · a picture's bits · a film's messages
//! scene_text                          a scene as the page describes it
//! fault                               error texts for the page
//! ```
//!
//! # Which to choose
//!
//! [`Page::ask`] for single requests; [`Page::frame`], which does not allocate, for frames that play.
//! The page itself, its buttons and its pictures are in `page/web`, and `page/build` puts both into one file.

mod ask;
mod compare;
mod count;
mod curve;
mod decode;
mod explore;
#[cfg(target_arch = "wasm32")]
mod exports;
mod fault;
mod receive;
mod scene_text;
mod send;

use std::time::Duration;

pub use ask::Page;
pub use explore::FrameReadings;
pub use fault::Fault;

/// The time since an arbitrary time: the browser's clock or, outside a browser, the system's.
fn clock() -> Duration {
    #[cfg(target_arch = "wasm32")]
    return exports::clock();
    #[cfg(not(target_arch = "wasm32"))]
    return sim::timing::system_clock();
}
