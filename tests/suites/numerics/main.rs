//! Hard cases: where floating and fixed point go wrong, that the ways that come to mind first do, and that ours do not.
//!
//! `docs/numerics.md` says what each is about. The whole suite: `cargo test -p vocc-tests --test numerics`.

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
