//! Sweeps on a cluster: Slurm on this computer's loopback address, with two nodes of one processor each.
//!
//! Skipped if Slurm is absent (`tests/run` installs it). The test of a dead node takes a minute and runs on request:
//!
//! ```text
//! VOCC_TEST_CASES=all cargo test -p vocc-tests --test slurm
//! ```

mod cluster;
mod sweeps;

use std::path::PathBuf;
use std::process::ExitCode;

use vocc_tests::trials::{self, Unready};
use vocc_tests::{all_cases, programs, tests};

use crate::cluster::Cluster;

/// Resources of the tests.
struct Setting {
    cluster: Cluster,
    vocc: PathBuf,
}

type Test = fn(&Setting);

fn main() -> ExitCode {
    let tests = tests![
        sweeps::shards_on_a_cluster_are_one_run_byte_for_byte,
        sweeps::a_shard_that_failed_is_done_again_alone,
        sweeps::a_task_that_is_told_to_end_keeps_what_it_has_and_goes_on_later,
    ];
    let on_request = tests![sweeps::a_node_that_dies_in_mid_shard_changes_nothing];
    let slow = all_cases().then_some(on_request).into_iter().flatten();
    // The tests share two processors.
    trials::run("sweeps with Slurm", Some(1), tests.into_iter().chain(slow), provide)
}

fn provide() -> Result<Setting, Unready> {
    Ok(Setting {
        cluster: Cluster::provide()?,
        vocc: programs::vocc()?,
    })
}
