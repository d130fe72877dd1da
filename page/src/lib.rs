//! The link in a browser: what a page asks of the simulator and the receiver, and what they answer.
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
//! exports                             what WebAssembly gives to JavaScript: the one place with `unsafe`
//! ask                                 requests and answers, as JSON
//! explore   compare   count   curve   a scene's frames · what accuracy costs · how often bits are wrong · over L2A
//! send      decode    receive         a message over the road · a picture's bits · a film's messages
//! told                                a scene as the page tells it
//! fault                               what can be wrong, in words for the page
//! ```
//!
//! # Which to choose
//!
//! [`Page::ask`] for all that is done now and then; [`Page::frame`] for the frames that a person watches, which allocates nothing.
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
pub use explore::Sight;
pub use fault::Fault;

/// The time since some moment: the browser's clock, or the system's where there is one.
fn clock() -> Duration {
    #[cfg(target_arch = "wasm32")]
    return exports::clock();
    #[cfg(not(target_arch = "wasm32"))]
    return sim::timing::system_clock();
}
