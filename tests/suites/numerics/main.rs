//! Hard cases for floating and fixed point: naive methods fail on them, and ours do not.
//!
//! `docs/numerics.md` lists the main ones. The whole suite: `cargo test -p vocc-tests --test numerics`.

mod control;
mod disc_integral;
mod distinguishability;
mod error_limits;
mod fisher_kmeans;
mod gamma;
mod homography;
mod least_squares;
mod llr_ldpc;
mod long_runs;
mod nist;
mod pose;
mod statistics;
mod sweeps;
mod synthetic;
