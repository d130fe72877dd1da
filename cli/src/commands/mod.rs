//! The commands, one per module: arguments in, library calls, output.

pub mod accuracy;
pub mod decode;
pub mod device;
pub mod evaluate;
pub mod figures;
pub mod frames;
pub mod keys;
pub mod link;
pub mod merge;
pub mod optimize;
pub mod plan;
pub mod receive;
pub mod render;
pub mod scene;
pub mod sweep;
pub mod table;
pub mod transmit;
