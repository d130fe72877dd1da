//! Sweeps on a cluster: Slurm itself, on this computer's loopback address, with two nodes of one processor each.
//!
//! Where Slurm is absent (`tests/run` installs it), these tests are skipped. That of a dead node takes a minute and is run on request:
//!
//! ```text
//! VOCC_TEST_CASES=all cargo test -p vocc-tests --test slurm
//! ```

mod cluster;
mod sweeps;

use std::path::PathBuf;
use std::process::ExitCode;

use libtest_mimic::Arguments;
use vocc_tests::trials::{self, Unready};
use vocc_tests::{all_cases, programs};

use crate::cluster::Cluster;

/// What the tests run.
struct Setting {
    cluster: Cluster,
    vocc: PathBuf,
}

type Test = fn(&Setting);

const TESTS: &[(&str, Test)] = &[
    (
        "shards_on_a_cluster_are_one_run_byte_for_byte",
        sweeps::shards_on_a_cluster_are_one_run_byte_for_byte,
    ),
    (
        "a_shard_that_failed_is_done_again_alone",
        sweeps::a_shard_that_failed_is_done_again_alone,
    ),
    (
        "a_task_that_is_told_to_end_keeps_what_it_has_and_goes_on_later",
        sweeps::a_task_that_is_told_to_end_keeps_what_it_has_and_goes_on_later,
    ),
];

/// Run on request.
const SLOW_TESTS: &[(&str, Test)] = &[(
    "a_node_that_dies_in_mid_shard_changes_nothing",
    sweeps::a_node_that_dies_in_mid_shard_changes_nothing,
)];

fn main() -> ExitCode {
    let mut arguments = Arguments::from_args();
    // They share two processors.
    arguments.test_threads = Some(1);
    let slow = all_cases().then_some(SLOW_TESTS).into_iter().flatten();
    let tests = TESTS.iter().chain(slow).copied();
    trials::run(&arguments, "sweeps with Slurm", tests, provide)
}

fn provide() -> Result<Setting, Unready> {
    Ok(Setting {
        cluster: Cluster::provide()?,
        vocc: programs::vocc()?,
    })
}
