//! Sweeps on a cluster: Slurm itself, on this computer's loopback address, with two nodes of one processor each.
//!
//! Where Slurm is missing (`tests/run` installs it) or does not start, these tests are shown as ignored, with the reason. That of a dead
//! node takes a minute and is run on request:
//!
//! ```text
//! cargo test -p vocc-tests --test slurm -- --ignored
//! ```

mod cluster;
mod sweeps;

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use libtest_mimic::{Arguments, Trial};
use vocc_tests::programs;

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
    // They share two processors, and one of them kills a node.
    arguments.test_threads = Some(1);
    let setting = if arguments.list {
        Err("only listed".into())
    } else {
        provide()
    };
    if let (Err(missing), false) = (&setting, arguments.list) {
        let _ = writeln!(
            std::io::stderr(),
            "The tests with Slurm DID NOT RUN: {missing}"
        );
    }
    let setting = setting.map(Arc::new);
    let trial = |&(name, test): &(&'static str, Test), is_slow| match setting.clone() {
        Ok(setting) => Trial::test(name, move || {
            test(&setting);
            Ok(())
        })
        .with_ignored_flag(is_slow),
        Err(missing) => {
            Trial::test(name, || Err(missing.into())).with_ignored_flag(is_slow || !arguments.list)
        }
    };
    let quick = TESTS.iter().map(|test| trial(test, false));
    let slow = SLOW_TESTS.iter().map(|test| trial(test, true));
    let trials = quick.chain(slow).collect();
    libtest_mimic::run(&arguments, trials).exit_code()
}

fn provide() -> Result<Setting, String> {
    Ok(Setting {
        cluster: Cluster::provide()?,
        vocc: programs::vocc()?,
    })
}
